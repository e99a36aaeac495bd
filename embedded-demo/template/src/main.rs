//! Firmware of a scanner that moves its own arms: four stepper axes, a color sensor, a button, and a line to a host.
//!
//! Change the numbers of this file and of `axes.rs` to those of your machine. `boards/` has the pins.

#![no_std]
#![no_main]

mod axes;
#[path = "boards/{{board}}.rs"]
mod board;

use core::convert::Infallible;

use axes::{AXES, DIRECTIONS_CHECKED, MIN_SEPARATION};
use embassy_time::Timer;
use embedded_hal::digital::{InputPin, OutputPin};
use embedded_hal_async::digital::Wait;
use embedded_hal_async::i2c::I2c;
use embedded_io_async::{Read, Write};
use embedded_storage::nor_flash::NorFlash;
use glimpse_core::driver::{Config, Host};
use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::geometry::{ArmAngles, Spherical};
use glimpse_core::gonio::{Calibration, Footprint, Machine};
use glimpse_core::model::Neural;
use glimpse_core::recipe::{Recipe, max_samples, memory_words};
use glimpse_core::scan::Scan;
use glimpse_scanner::axis::Axis;
use glimpse_scanner::goniometer::Goniometer;
use glimpse_scanner::store::{Layout, Store};
use glimpse_scanner::{Button, ColorSensor, Command, Event, FlashMemory, Operator, Steppers, run};
use static_cell::StaticCell;

/// The recipe of build.rs.
static RECIPE: &[u8] = include_bytes!(env!("RECIPE"));
/// Its model: `model::Neural`, `model::Phong`, `model::CookTorrance` or `fit::Linear` of `glimpse_core`.
type Model = Neural;
const SAMPLES: usize = max_samples(&[RECIPE]);
const MEMORY_WORDS: usize = memory_words(&[RECIPE]);

/// True: log the sensor's counts instead of scanning, for the next four constants.
const CALIBRATES: bool = false;
/// Counts in the dark and on a white tile, with the arms at `WHITE_AT`, and the tile's reflectance.
const DARK: [f32; 3] = [0.0; 3];
const WHITE: [f32; 3] = [20_000.0; 3];
const WHITE_AT: ArmAngles = ArmAngles {
    incoming: Spherical {
        theta: 0.0,
        phi: 0.0,
    },
    outgoing: Spherical {
        theta: 0.785,
        phi: 0.0,
    },
};
const REFLECTANCE: [f32; 3] = [0.99; 3];
/// The larger spot on the sample, at all angles: that of the light, or that which the sensor sees.
const FOOTPRINT: Footprint = Footprint::LightLarger;

/// Returns the place of readings in the flash: two areas of whole sectors from `start` on.
const fn readings_at(start: u32, area_bytes: u32) -> Layout {
    Layout { start, area_bytes }
}

/// The parts of a board: for each axis the pins step, direction and switch; the rest in the order of its fields.
struct Board<S, D, H, B, F, L, W> {
    axes: [(S, D, H); 4],
    sensor: B,
    flash: F,
    /// The place of the readings in the flash.
    layout: Layout,
    line: L,
    button: W,
}

/// The button: it starts a scan, stops it, and begins again after a failure.
struct Panel<W> {
    button: Button<W>,
    next: Command,
}

impl<W: Wait + InputPin> Operator for Panel<W> {
    async fn command(&mut self) -> Command {
        self.button.pressed().await;
        core::mem::replace(&mut self.next, Command::Stop)
    }

    fn show(&mut self, event: Event<'_>) {
        match event {
            Event::Finished(residual, values) => {
                self.next = Command::Restart;
                for (index, value) in values.enumerate() {
                    defmt::info!("value {}: {}", index, value);
                }
                defmt::info!("finished: {}", residual);
            }
            Event::Failed(error) => {
                self.next = Command::Resume;
                defmt::error!("{}", error);
            }
            Event::Unsaved => defmt::warn!("a reading is not saved"),
        }
    }
}

/// Scans after a press of the button, one material after the other, or logs an error of recipe, settings, sensor or flash.
async fn scan<S, D, H>(
    board: Board<S, D, H, impl I2c, impl NorFlash, (impl Read, impl Write), impl Wait + InputPin>,
) where
    S: OutputPin,
    D: OutputPin,
    H: InputPin,
{
    let Err(error) = start(board).await;
    defmt::error!("{}; the button does nothing until a reset", error);
}

async fn start<S, D, H>(
    board: Board<S, D, H, impl I2c, impl NorFlash, (impl Read, impl Write), impl Wait + InputPin>,
) -> Result<Infallible, Error>
where
    S: OutputPin,
    D: OutputPin,
    H: InputPin,
{
    static MEMORY: StaticCell<[f32; MEMORY_WORDS]> = StaticCell::new();
    let recipe = Recipe::parse(RECIPE)?;
    let storage = |_| Error::new(ErrorCode::Storage);
    let mut store = Store::<_, SAMPLES>::mount(board.flash, board.layout).map_err(storage)?;
    let boots = store.count_boot().map_err(storage)?;
    let mut flash = FlashMemory::new(store, &recipe)?;
    let [theta_i, phi_i, theta_o, phi_o] = board.axes;
    let [lamp, lamp_azimuth, sensor, sensor_azimuth] = AXES;
    let axis = |(step, direction, switch), settings| Axis::new(step, direction, switch, settings);
    let axes = [
        axis(theta_i, lamp),
        axis(phi_i, lamp_azimuth),
        axis(theta_o, sensor),
        axis(phi_o, sensor_azimuth),
    ];
    let mut arms = Goniometer::new(axes, MIN_SEPARATION)?;
    if DIRECTIONS_CHECKED {
        arms.trust_directions();
    }
    let mut config = Config::new(Host::Listens);
    config.machine = Some(Machine::new(arms.limits()));
    config.sequence_seed = boots;
    let calibration = Calibration::new(DARK, WHITE, REFLECTANCE)?;
    let color_sensor = ColorSensor::new(board.sensor, calibration, &WHITE_AT, FOOTPRINT);
    let mut color_sensor = color_sensor.await?;
    while CALIBRATES {
        defmt::info!("counts: {}", color_sensor.counts().await?);
        Timer::after_millis(500).await;
    }
    if arms.needs_confirmation() {
        defmt::warn!("make sure that the lamp is nearer to the normal than the sensor");
    }
    let mut machine = Steppers::new(arms, color_sensor);
    let memory = MEMORY
        .try_init([0.0; MEMORY_WORDS])
        .ok_or(Error::new(ErrorCode::Memory))?;
    let scan = Scan::<Model>::new(recipe, memory)?;
    let mut panel = Panel {
        button: Button::new(board.button),
        next: Command::Resume,
    };
    defmt::info!("press the button to scan");
    panel.command().await;
    run(
        scan,
        config,
        board.line,
        &mut machine,
        &mut flash,
        &mut panel,
    )
    .await
}

/// Restarts the firmware, which then waits for the button.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    defmt::error!("a panic restarts the firmware");
    board::reset()
}
