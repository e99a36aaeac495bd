//! The firmware in QEMU. netduinoplus2 has a UART, but no arms, ADC, clocks or flash controller. The scanner is
//! simulated. The scanner and the flash lie in memory that survives a reset.
//!
//! While no host replies, bytes on the UART control the simulation: `a` to `d` let an arm lose its next forty steps.
//! While the firmware waits for a command because of saved readings or a new recipe, `p` is a short press of the button,
//! and `h` a long one.

#![no_std]
#![no_main]

use core::panic::PanicInfo;
use core::ptr;

use cortex_m::peripheral::SCB;
use cortex_m_rt::{entry, exception};
use defmt_semihosting as _;
use glimpse_arms::flash_ram::{FlashRam, SECTOR_BYTES};
use glimpse_arms::scanner::{Command, Event, Outcome, Platform, Scanner, Seeds, log_values};
use glimpse_arms::simulated::SimulatedScanner;
use glimpse_arms::station::ARMS;
use glimpse_arms::store::readings::Readings;
use glimpse_arms::store::recipes::Recipes;
use glimpse_arms::{MEMORY_WORDS, Model, retained};
use glimpse_core::recipe::memory_words;
use glimpse_core::scan::Residual;

/// The bundled recipe.
static RECIPE: &[u8] = include_bytes!("../../../../trainer/recipes/neural-n8.recipe");
/// The memory is large enough for the bundled recipe.
const _: () = assert!(memory_words(&[RECIPE]) <= MEMORY_WORDS);
/// The largest recipe that the flash stores.
const RECIPE_BYTES: usize = 3 * SECTOR_BYTES;
/// Two sectors for readings, and three for each of two recipes.
const FLASH_BYTES: usize = 8 * SECTOR_BYTES;
/// Number of steps that an arm loses per command.
const LOST_STEPS: u32 = 40;
/// Value that marks initialized state.
const MAGIC: u32 = 0x6C1A_4D05;

/// Memory that survives a reset. Any bits are valid.
#[repr(C)]
struct Retained {
    magic: u32,
    simulated: SimulatedScanner,
    positions: [u32; retained::WORDS],
    flash: [u8; FLASH_BYTES],
}

unsafe extern "C" {
    /// Memory that start-up code does not initialize.
    #[link_name = "_retained"]
    static mut RETAINED: Retained;
}

#[entry]
fn main() -> ! {
    static mut MEMORY: [f32; MEMORY_WORDS] = [0.0; MEMORY_WORDS];
    static mut BUFFER: [u8; RECIPE_BYTES] = [0; RECIPE_BYTES];

    // SAFETY: the linker script reserves these bytes for this static alone, there is room for it, any bits are valid,
    // and this is the only reference, because `main` runs once.
    let state = unsafe { unique_static(&raw mut RETAINED) };
    if state.magic != MAGIC {
        // After a power cut the arms' positions are unknown, and the flash is new.
        state.simulated.reset([300, 500, 40, 700]);
        state.simulated.command(Command::NewScan); // simulates a short press of the button
        state.positions = retained::encode(None);
        state.flash.fill(0xFF);
        state.magic = MAGIC;
    }
    let mut flash = FlashRam(&mut state.flash);
    let mut station = state.simulated.station();
    if let Some(positions) = retained::decode(state.positions) {
        station.assume(positions);
    }
    let mut platform = Simulation {
        simulated: &state.simulated,
        positions: &mut state.positions,
        uart: Uart::start(),
        has_no_host: false,
        awaits_command: false,
    };
    let sector = |sectors: core::ops::Range<u32>| {
        sectors.start * SECTOR_BYTES as u32..sectors.end * SECTOR_BYTES as u32
    };
    let readings = Readings::mount(&mut flash, [sector(0..1), sector(1..2)]);
    let recipes = Recipes::mount(&mut flash, [sector(2..5), sector(5..8)], BUFFER);
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

/// The platform in QEMU.
struct Simulation<'w> {
    simulated: &'w SimulatedScanner,
    positions: &'w mut [u32; retained::WORDS],
    uart: Uart,
    /// No host replies, so bytes on the UART control the simulation.
    has_no_host: bool,
    /// The firmware has reported saved readings or a new recipe, and no byte was received since.
    awaits_command: bool,
}

impl Platform for Simulation<'_> {
    /// Returns the simulated time of an iteration: 40 us, or 10 us while a host may reply. Simulated time is faster than
    /// real time, and a host on a busy PC must not exceed the timeout of a reply.
    fn elapsed_us(&mut self) -> u32 {
        if self.has_no_host { 40 } else { 10 }
    }

    fn receive(&mut self) -> Option<u8> {
        let byte = self.uart.read()?;
        let awaits_command = core::mem::take(&mut self.awaits_command);
        match byte {
            b'p' if awaits_command => self.simulated.command(Command::NewScan),
            b'h' if awaits_command => self.simulated.command(Command::Continue),
            b'a'..=b'd' if self.has_no_host => {
                self.simulated.stall(usize::from(byte - b'a'), LOST_STEPS)
            }
            _ if self.has_no_host => {}
            _ => return Some(byte),
        }
        None
    }

    fn send(&mut self, byte: u8) -> bool {
        self.uart.write(byte)
    }

    fn command(&mut self) -> Option<Command> {
        self.simulated.take_command()
    }

    fn save_positions(&mut self, positions: Option<[i32; ARMS]>) {
        *self.positions = retained::encode(positions);
    }

    fn report(&mut self, event: Event) {
        event.log();
        match event {
            Event::Ended(outcome) => self.has_no_host = outcome == Outcome::NoHost,
            Event::Saved { .. } | Event::RecipeUpdate(Ok(())) => self.awaits_command = true,
            _ => {}
        }
    }

    fn report_fit(&mut self, residual: Residual, values: &mut dyn Iterator<Item = f32>) {
        log_values(values);
        defmt::info!("residual {=u32:08x}", residual.mean.to_bits());
    }
}

/// USART1, which QEMU connects with its serial line.
struct Uart;

impl Uart {
    const STATUS: *const u32 = ptr::without_provenance(0x4001_1000);
    const DATA: *mut u32 = ptr::without_provenance_mut(0x4001_1004);
    const CONTROL: *mut u32 = ptr::without_provenance_mut(0x4001_100C);

    fn start() -> Self {
        // SAFETY: the control register of netduinoplus2's USART1: enabled, transmitter and receiver on.
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

/// Returns the only reference to a static.
///
/// # Safety
/// `pointer` points to a static, any bits are valid for `T`, and no other reference to the static ever exists.
unsafe fn unique_static<T>(pointer: *mut T) -> &'static mut T {
    // SAFETY: guaranteed by the caller.
    unsafe { &mut *pointer }
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
