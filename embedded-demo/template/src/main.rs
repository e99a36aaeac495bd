//! Firmware of a scanner that moves its own arms: four stepper axes, a color sensor, a button, and a line to a host.
//!
//! Change the numbers of this file and of `axes.rs` to those of your machine. `boards/` has the pins.

#![no_std]
#![no_main]

mod axes;
#[path = "boards/{{board}}.rs"]
mod board;

use core::convert::Infallible;

use axes::{AXES, MIN_SEPARATION};
use embedded_hal::digital::{InputPin, OutputPin};
use embedded_hal_async::digital::Wait;
use embedded_hal_async::i2c::I2c;
use embedded_io_async::{Read, Write};
use embedded_storage::nor_flash::NorFlash;
use glimpse_core::driver::{Config, Host};
use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::geometry::Arms;
use glimpse_core::gonio::{Footprint, Machine};
use glimpse_core::model::Neural;
use glimpse_core::recipe::{Recipe, memory_words};
use glimpse_core::scan::Scan;
use glimpse_core::store::{Layout, Store};
use glimpse_scanner::axis::Axis;
use glimpse_scanner::goniometer::Goniometer;
use glimpse_scanner::{ColorSensor, Instrument, Operator, Panel, White, report, run};
use static_cell::StaticCell;

/// The recipe of build.rs.
static RECIPE: &[u8] = include_bytes!(env!("RECIPE"));
/// Its model: `model::Neural`, `model::Phong`, `model::CookTorrance` or `fit::Linear` of `glimpse_core`.
type Model = Neural;
const MEMORY_WORDS: usize = memory_words(&[RECIPE]);

/// The white tile of the calibration: the arms while it is read, and its reflectance. `footprint` is the larger spot on
/// the sample, at all angles: that of the light, or that which the sensor sees.
const WHITE: White = White {
    at: Arms {
        theta_o: 0.785,
        ..Arms::NORMAL
    },
    reflectance: [0.99; 3],
    footprint: Footprint::LightLarger,
};

/// Changes options of the scan.
fn configure(config: &mut Config) {
    // If the lamp cannot be switched: 0. You cover it for the calibration. No reading shows room light then, nor that the
    // lamp is off.
    config.limits.dark = 0.05;
}

/// Returns the place of the store in the flash: two areas of whole sectors from `start` on.
const fn store_at(start: u32, area_bytes: u32) -> Layout {
    Layout { start, area_bytes }
}

/// The parts of a board: for each axis the pins step, direction and switch; the rest in the order of its fields.
struct Board<S, H, B, F, L, W> {
    axes: [(S, S, H); 4],
    /// It switches the lamp on while it is high.
    lamp: S,
    sensor: B,
    flash: F,
    /// The place of the store in the flash.
    layout: Layout,
    line: L,
    button: W,
    /// The light of the panel.
    light: S,
}

/// Scans on command, one material after the other, or reports an error of recipe, settings or flash.
async fn scan<S: OutputPin, H: InputPin>(
    board: Board<S, H, impl I2c, impl NorFlash, (impl Read, impl Write), impl Wait + InputPin>,
) {
    let mut panel = Panel::new(board.button, board.light);
    let (mut receiver, mut sender) = board.line;
    let line = (&mut receiver, &mut sender);
    let machine = (board.axes, board.lamp, board.sensor);
    let Err(error) = start(machine, (board.flash, board.layout), line, &mut panel).await;
    report(error, &mut panel, &mut sender).await
}

async fn start<S: OutputPin, H: InputPin>(
    (axes, lamp, sensor): ([(S, S, H); 4], S, impl I2c),
    (flash, layout): (impl NorFlash, Layout),
    line: (impl Read, impl Write),
    panel: &mut impl Operator,
) -> Result<Infallible, Error> {
    static MEMORY: StaticCell<[f32; MEMORY_WORDS]> = StaticCell::new();
    let memory = MEMORY
        .try_init([0.0; MEMORY_WORDS])
        .ok_or(Error::new(ErrorCode::Memory))?;
    let scan = Scan::<Model>::new(Recipe::parse(RECIPE)?, memory)?;
    let mut store = Store::mount(flash, layout, scan.recipe())?;
    let mut settings = AXES.into_iter();
    let axes = axes.map(|(step, direction, switch)| {
        let settings = settings.next().unwrap_or(AXES[0]); // there are four
        Axis::new(step, direction, switch, settings)
    });
    let arms = Goniometer::new(axes, MIN_SEPARATION)?;
    let mut config = Config::new(Host::Listens);
    config.machine = Some(Machine::new(arms.limits()));
    config.sequence_seed = store.count_boot()?;
    configure(&mut config);
    let mut instrument = Instrument::new(arms, lamp, ColorSensor::new(sensor));
    run(scan, config, WHITE, &mut instrument, &mut store, panel, line).await
}

/// Restarts the firmware, which then waits for the button.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    defmt::error!("a panic restarts the firmware");
    board::reset()
}
