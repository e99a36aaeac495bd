//! The firmware on an Adafruit Feather STM32F405 Express: four stepper drivers, four home switches, a lamp, three
//! photodiodes, a button. The README lists the wiring.
//!
//! For another scanner, change the arms' settings in `machine.rs` and the pins here.

#![no_std]
#![no_main]

mod flash;
mod machine;

use core::convert::Infallible;
use core::panic::PanicInfo;

use cortex_m::peripheral::{DWT, SCB};
use cortex_m_rt::{ExceptionFrame, entry, exception};
use defmt_rtt as _; // log over RTT
use glimpse_arms::axis::Axis;
use glimpse_arms::goniometer::Goniometer;
use glimpse_arms::scanner::{Button, Command, Event, Platform, Scanner, Seeds, log_values};
use glimpse_arms::sensor::{Photometer, Sensor};
use glimpse_arms::station::{ARMS, Station};
use glimpse_arms::store::readings::Readings;
use glimpse_arms::store::recipes::Recipes;
use glimpse_arms::{MEMORY_WORDS, Model, retained};
use glimpse_core::recipe::memory_words;
use glimpse_core::scan::Residual;
use stm32f4xx_hal::adc::Adc;
use stm32f4xx_hal::adc::config::{AdcConfig, SampleTime};
use stm32f4xx_hal::flash::LockedFlash;
use stm32f4xx_hal::gpio::{Analog, ErasedPin, Input, Output, PA4, PA5, PA6};
use stm32f4xx_hal::pac::{self, ADC1, USART3};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Config;
use stm32f4xx_hal::serial::{Rx, Tx};
use stm32f4xx_hal::watchdog::IndependentWatchdog;

use flash::{Flash, sector};
use machine::{arm, machine, white};

/// The bundled recipe; a host may send another one.
static RECIPE: &[u8] = include_bytes!("../../../../../trainer/recipes/neural-n8.recipe");
/// Maximum size of a recipe in the flash.
const RECIPE_BYTES: usize = 16 * 1024;
/// The memory is large enough for the bundled recipe.
const _: () = assert!(memory_words(&[RECIPE]) <= MEMORY_WORDS);
/// Readings of the converter that are averaged to one reading of the scan.
const REPEATS: u16 = 64;
/// Clock of the core and its cycle counter, MHz.
const CORE_MHZ: u32 = 168;
/// Timeout of the watchdog: longer than erasing a sector, four seconds at worst.
const WATCHDOG_MS: u32 = 10_000;

unsafe extern "C" {
    /// Memory that start-up code does not initialize.
    #[link_name = "_retained"]
    static mut RETAINED: [u32; retained::WORDS];
}

#[entry]
fn main() -> ! {
    static mut MEMORY: [f32; MEMORY_WORDS] = [0.0; MEMORY_WORDS];
    static mut BUFFER: [u8; RECIPE_BYTES] = [0; RECIPE_BYTES];

    let (Some(chip), Some(mut core)) = (pac::Peripherals::take(), cortex_m::Peripherals::take())
    else {
        reset()
    };
    // The watchdog starts before the clocks, so it resets the chip if the PLL does not lock.
    let mut watchdog = IndependentWatchdog::new(chip.IWDG);
    watchdog.stop_on_debug(&chip.DBGMCU, true);
    watchdog.start(WATCHDOG_MS.millis());
    let cause = chip.RCC.csr().read();
    defmt::info!(
        "reset: power {=bool}, brown-out {=bool}, pin {=bool}, software {=bool}, watchdog {=bool}",
        cause.porrstf().bit(),
        cause.borrstf().bit(),
        cause.padrstf().bit(),
        cause.sftrstf().bit(),
        cause.wdgrstf().bit()
    );
    chip.RCC.csr().modify(|_, w| w.rmvf().set_bit());

    // The internal oscillator, accurate to 1 % at room temperature, which is enough for a UART.
    let mut rcc = chip.RCC.freeze(
        Config::hsi()
            .sysclk(CORE_MHZ.MHz())
            .pclk1(42.MHz())
            .pclk2(84.MHz()),
    );
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
    defmt::info!("clocks: core at {=u32} Hz", rcc.clocks.sysclk().raw());

    let a = chip.GPIOA.split(&mut rcc);
    let b = chip.GPIOB.split(&mut rcc);
    let c = chip.GPIOC.split(&mut rcc);
    let steps: [ErasedPin<Output>; ARMS] = [
        b.pb13.into_push_pull_output().erase(), // SCK
        b.pb15.into_push_pull_output().erase(), // MO
        c.pc7.into_push_pull_output().erase(),  // D5
        c.pc6.into_push_pull_output().erase(),  // D6
    ];
    let directions: [ErasedPin<Output>; ARMS] = [
        b.pb8.into_push_pull_output().erase(), // D9
        b.pb9.into_push_pull_output().erase(), // D10
        c.pc3.into_push_pull_output().erase(), // D11
        c.pc2.into_push_pull_output().erase(), // D12
    ];
    let switches: [ErasedPin<Input>; ARMS] = [
        a.pa7.into_pull_up_input().erase(),  // A3
        c.pc4.into_pull_up_input().erase(),  // A4
        c.pc5.into_pull_up_input().erase(),  // A5
        b.pb14.into_pull_up_input().erase(), // MI
    ];
    let lamp: ErasedPin<Output> = c.pc1.into_push_pull_output().erase(); // D13, with the red LED
    let contact: ErasedPin<Input> = b.pb7.into_pull_up_input().erase(); // SDA
    let photodiodes = Photodiodes {
        converter: Adc::new(chip.ADC1, true, AdcConfig::default(), &mut rcc),
        red: a.pa4.into_analog(),   // A0
        green: a.pa5.into_analog(), // A1
        blue: a.pa6.into_analog(),  // A2
    };
    let pins = (b.pb10, b.pb11); // TX, RX
    let Ok(serial) = chip.USART3.serial::<u8>(pins, 115_200.bps(), &mut rcc) else {
        defmt::error!("the UART does not support 115200 baud at this clock");
        reset()
    };
    let (send, receive) = serial.split();

    let mut number = 0..;
    let mut pins = steps.into_iter().zip(directions).zip(switches);
    let arms: [Option<Axis<_, _, _>>; ARMS] = core::array::from_fn(|_| {
        let ((step, direction), switch) = pins.next()?;
        Some(Axis::new(step, direction, switch, arm(number.next()?)))
    });
    let [Some(theta_i), Some(phi_i), Some(theta_o), Some(phi_o)] = arms else {
        reset() // unreachable: there are as many pins as arms
    };
    let photometer = Photometer::new(photodiodes, lamp, white(), REPEATS);
    let arms = Goniometer::new([theta_i, phi_i, theta_o, phi_o]);
    let mut station = Station::new(arms, photometer, machine());

    // SAFETY: the linker script reserves these words for this static alone, any bits are valid, and this is the only
    // reference, because `main` runs once.
    let positions = unsafe { unique_static(&raw mut RETAINED) };
    match retained::decode(*positions) {
        Some(counts) => {
            defmt::info!("arms: step counts survived the reset");
            station.assume(counts);
        }
        None => defmt::info!(
            "arms: positions are unknown; make sure that the lamp is not outside of the sensor at the same azimuth"
        ),
    }

    let mut flash = Flash(LockedFlash::new(chip.FLASH));
    let readings = Readings::mount(&mut flash, [sector(0x8_0000), sector(0xA_0000)]);
    let recipes = Recipes::mount(&mut flash, [sector(0xC_0000), sector(0xE_0000)], BUFFER);
    let (Ok(mut readings), Ok(recipes)) = (readings, recipes) else {
        defmt::error!("the flash cannot be read: check its sectors");
        reset()
    };
    let Ok(boots) = readings.count_boot(&mut flash) else {
        defmt::error!("the flash cannot be written: check its sectors");
        reset()
    };
    let mut board = Board {
        watchdog,
        send,
        receive,
        contact,
        button: Button::default(),
        elapsed_us: 0,
        positions,
        cycles: DWT::cycle_count(),
    };
    let mut scanner = Scanner {
        station,
        flash,
        readings,
        recipes,
        seeds: Seeds::new(boots),
    };
    defmt::info!("ready: press the button");
    scanner.serve::<Model>(RECIPE, BUFFER, MEMORY, &mut board)
}

/// The platform on a board.
struct Board {
    watchdog: IndependentWatchdog,
    send: Tx<USART3>,
    receive: Rx<USART3>,
    /// Pin of the button, low while it is pressed.
    contact: ErasedPin<Input>,
    button: Button,
    /// Time since the button was last read, us.
    elapsed_us: u32,
    positions: &'static mut [u32; retained::WORDS],
    /// Value of the cycle counter at the last whole microsecond.
    cycles: u32,
}

impl Platform for Board {
    fn elapsed_us(&mut self) -> u32 {
        self.watchdog.feed();
        let microseconds = DWT::cycle_count().wrapping_sub(self.cycles) / CORE_MHZ;
        self.cycles = self.cycles.wrapping_add(microseconds * CORE_MHZ);
        self.elapsed_us = self.elapsed_us.saturating_add(microseconds);
        microseconds
    }

    fn receive(&mut self) -> Option<u8> {
        self.receive.read().ok()
    }

    fn send(&mut self, byte: u8) -> bool {
        self.send.write(byte).is_ok()
    }

    fn command(&mut self) -> Option<Command> {
        let elapsed_us = core::mem::take(&mut self.elapsed_us);
        self.button.poll(self.contact.is_low(), elapsed_us)
    }

    fn save_positions(&mut self, positions: Option<[i32; ARMS]>) {
        for (to, from) in self.positions.iter_mut().zip(retained::encode(positions)) {
            // SAFETY: a valid reference. The write is volatile, so it is not optimized out and survives a reset.
            unsafe { core::ptr::from_mut(to).write_volatile(from) };
        }
    }

    fn report(&mut self, event: Event) {
        event.log();
    }

    fn report_fit(&mut self, residual: Residual, values: &mut dyn Iterator<Item = f32>) {
        log_values(values);
        defmt::info!("{}", residual);
        if let Some(reason) = residual.implausible {
            defmt::warn!("the material is implausible: {}", reason);
        }
    }
}

/// Three photodiodes and their converter.
struct Photodiodes {
    converter: Adc<ADC1>,
    red: PA4<Analog>,
    green: PA5<Analog>,
    blue: PA6<Analog>,
}

impl Sensor for Photodiodes {
    type Error = Infallible;

    fn read(&mut self) -> Result<[u16; 3], Infallible> {
        let time = SampleTime::Cycles_84;
        Ok([
            self.converter.convert(&self.red, time),
            self.converter.convert(&self.green, time),
            self.converter.convert(&self.blue, time),
        ])
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

/// Resets the chip: the arms stop, and do not move before the next press of the button.
#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    defmt::error!("panic");
    reset()
}

#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    reset()
}

fn reset() -> ! {
    SCB::sys_reset()
}
