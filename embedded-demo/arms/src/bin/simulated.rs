//! The firmware in QEMU: netduinoplus2 has a UART, but no arms, no ADC, no clocks and no flash
//! controller. The scanner is simulated, and it and the flash lie where a reset leaves them alone.
//!
//! Bytes on the UART play the world while no host listens: `a` to `d` let an arm lose its next forty
//! steps. While the firmware asks about saved readings, `p` presses the button shortly, and `h` holds
//! it.

#![no_std]
#![no_main]

use core::panic::PanicInfo;
use core::ptr;

use cortex_m::peripheral::SCB;
use cortex_m_rt::{entry, exception};
use defmt_semihosting as _;
use glimpse_arms::flash_ram::{FlashRam, SECTOR};
use glimpse_arms::scanner::{Command, End, News, Platform, Scanner, Seeds, log_values};
use glimpse_arms::simulated::World;
use glimpse_arms::station::ARMS;
use glimpse_arms::store::readings::Readings;
use glimpse_arms::store::recipes::Recipes;
use glimpse_arms::{MEMORY_WORDS, Model, retained};
use glimpse_core::recipe::memory_words;
use glimpse_core::scan::Residual;

/// The recipe that it comes with.
static RECIPE: &[u8] = include_bytes!("../../../../trainer/recipes/neural-n8.recipe");
/// The bundled recipe fits.
const _: () = assert!(memory_words(&[RECIPE]) <= MEMORY_WORDS);
/// Two sectors for readings, two and two for recipes.
const FLASH_BYTES: usize = 6 * SECTOR;
/// Steps that an arm loses at a time.
const STALL: u32 = 40;
/// By this the memory is known again.
const MAGIC: u32 = 0x6C1A_4D05;

/// What a reset leaves. Any bits are one.
#[repr(C)]
struct Kept {
    magic: u32,
    world: World,
    positions: [u32; retained::WORDS],
    flash: [u8; FLASH_BYTES],
}

unsafe extern "C" {
    /// The linker script's memory that start-up code does not touch.
    #[link_name = "_kept"]
    static mut KEPT: Kept;
}

#[entry]
fn main() -> ! {
    static mut MEMORY: [f32; MEMORY_WORDS] = [0.0; MEMORY_WORDS];
    static mut BUFFER: [u8; 2 * SECTOR] = [0; 2 * SECTOR];

    // SAFETY: the linker script sets these bytes aside for it alone, there is room for it, any bits
    // are one, and this is the only reference, since `main` runs once.
    let kept = unsafe { only(&raw mut KEPT) };
    if kept.magic != MAGIC {
        // Power was off: the arms' positions are unknown, and the flash is new.
        kept.world.place([300, 500, 40, 700]);
        kept.world.command(Command::NewScan); // somebody presses the button
        kept.positions = retained::words(None);
        kept.flash.fill(0xFF);
        kept.magic = MAGIC;
    }
    let mut flash = FlashRam(&mut kept.flash);
    let mut station = kept.world.station();
    if let Some(positions) = retained::positions(kept.positions) {
        station.assume(positions);
    }
    let mut platform = Simulation {
        world: &kept.world,
        positions: &mut kept.positions,
        uart: Uart::start(),
        is_alone: false,
        is_asking: false,
    };
    let sector =
        |sectors: core::ops::Range<u32>| sectors.start * SECTOR as u32..sectors.end * SECTOR as u32;
    let readings = Readings::mount(&mut flash, [sector(0..1), sector(1..2)]);
    let recipes = Recipes::mount(&mut flash, [sector(2..4), sector(4..6)], BUFFER);
    let (Ok(mut readings), Ok(recipes)) = (readings, recipes) else {
        defmt::error!("the flash cannot be read");
        reset()
    };
    let Ok(boots) = readings.count_boot(&mut flash) else {
        defmt::error!("the flash cannot be written");
        reset()
    };
    let mut scanner = Scanner {
        station,
        flash,
        readings,
        recipes,
        seeds: Seeds::new(boots),
    };
    defmt::info!("ready: press the button");
    scanner.serve::<Model>(RECIPE, BUFFER, MEMORY, &mut platform)
}

/// What is around the scanner in QEMU.
struct Simulation<'w> {
    world: &'w World,
    positions: &'w mut [u32; retained::WORDS],
    uart: Uart,
    /// No host listens, so that bytes play the world.
    is_alone: bool,
    /// The firmware has asked about saved readings, and no byte has come since.
    is_asking: bool,
}

impl Platform for Simulation<'_> {
    /// Simulated arms need simulated time: each round takes 40 us.
    fn elapsed(&mut self) -> u32 {
        40
    }

    fn receive(&mut self) -> Option<u8> {
        let byte = self.uart.read()?;
        let is_asking = core::mem::take(&mut self.is_asking);
        match byte {
            b'p' if is_asking => self.world.command(Command::NewScan),
            b'h' if is_asking => self.world.command(Command::Continue),
            b'a'..=b'd' if self.is_alone => self.world.stall(usize::from(byte - b'a'), STALL),
            _ if self.is_alone => {}
            _ => return Some(byte),
        }
        None
    }

    fn send(&mut self, byte: u8) -> bool {
        self.uart.write(byte)
    }

    fn command(&mut self) -> Option<Command> {
        self.world.take_command()
    }

    fn remember(&mut self, positions: Option<[i32; ARMS]>) {
        *self.positions = retained::words(positions);
    }

    fn tell(&mut self, news: News) {
        news.log();
        match news {
            News::End(end) => self.is_alone = end == End::Alone,
            News::Saved { .. } => self.is_asking = true,
            _ => {}
        }
    }

    fn finished(&mut self, residual: Residual, values: &mut dyn Iterator<Item = f32>) {
        log_values(values);
        defmt::info!("residual {=u32:08x}", residual.mean.to_bits());
    }
}

/// USART1, which QEMU joins with its serial line.
struct Uart;

impl Uart {
    const STATUS: *const u32 = ptr::without_provenance(0x4001_1000);
    const DATA: *mut u32 = ptr::without_provenance_mut(0x4001_1004);
    const CONTROL: *mut u32 = ptr::without_provenance_mut(0x4001_100C);

    fn start() -> Self {
        // SAFETY: the register of netduinoplus2's USART1: enabled, transmitter and receiver on.
        unsafe { Self::CONTROL.write_volatile(1 << 13 | 1 << 3 | 1 << 2) };
        Self
    }

    fn status(&self) -> u32 {
        // SAFETY: as above.
        unsafe { Self::STATUS.read_volatile() }
    }

    fn read(&mut self) -> Option<u8> {
        // SAFETY: as above.
        (self.status() & 1 << 5 != 0).then(|| unsafe { Self::DATA.read_volatile() } as u8)
    }

    fn write(&mut self, byte: u8) -> bool {
        let ready = self.status() & 1 << 7 != 0;
        if ready {
            // SAFETY: as above.
            unsafe { Self::DATA.write_volatile(byte.into()) };
        }
        ready
    }
}

/// A static's only reference.
///
/// # Safety
/// `place` is a static, any bits are one of it, and there is no other reference to it, now or later.
unsafe fn only<T>(place: *mut T) -> &'static mut T {
    // SAFETY: by the caller's word.
    unsafe { &mut *place }
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    defmt::error!("panic");
    reset()
}

#[exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    reset()
}

fn reset() -> ! {
    SCB::sys_reset()
}
