//! Firmware of a scanner that moves its own arms: four stepper axes, a color sensor, a button, and a line to a host.
//!
//! Change the numbers of this file to those of your machine. `boards/` has the pins.

#![no_std]
#![no_main]

#[path = "boards/{{board}}.rs"]
mod board;

use core::convert::Infallible;

use embedded_hal::digital::{InputPin, OutputPin};
use embedded_hal_async::digital::Wait;
use embedded_hal_async::i2c::I2c;
use embedded_io_async::{Read, Write};
use embedded_storage::nor_flash::NorFlash;
use glimpse_core::driver::{Config, Host};
use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::gonio::{Calibration, Machine};
use glimpse_core::model::Neural;
use glimpse_core::recipe::{Recipe, max_samples, memory_words};
use glimpse_core::scan::Scan;
use glimpse_embassy::{ColorSensor, Command, Event, FlashMemory, Operator, Steppers, run};
use glimpse_motion::axis::{Axis, Settings};
use glimpse_motion::goniometer::Goniometer;
use glimpse_motion::store::{Layout, Store};
use static_cell::StaticCell;

/// The recipe, and its model in [`Model`].
static RECIPE: &[u8] = include_bytes!(concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/{{glimpse}}/trainer/recipes/completed/neural-n8.recipe"
));
type Model = Neural;
const SAMPLES: usize = max_samples(&[RECIPE]);
const MEMORY_WORDS: usize = memory_words(&[RECIPE]);

/// The smallest angle between lamp and sensor, in radians.
const MIN_SEPARATION: f32 = 0.09;
/// Counts of the sensor in the dark and on a white tile, and the tile's reflectance: measure them.
const DARK: [f32; 3] = [0.0; 3];
const WHITE: [f32; 3] = [20_000.0; 3];
const REFLECTANCE: [f32; 3] = [0.99; 3];

/// The axes theta_i, phi_i, theta_o and phi_o, angles in radians: a motor of 200 steps with 16 microsteps and a gear of
/// 4. The lamp's switch is near the normal, the sensor's near the horizon.
const AXES: [Settings; 4] = [
    Settings {
        home: -0.05,
        min_angle: 0.0,
        max_angle: 1.5,
        ..POLAR
    },
    AZIMUTH,
    Settings {
        home: 1.55,
        min_angle: 0.0,
        max_angle: 1.5,
        ..POLAR
    },
    AZIMUTH,
];
const AZIMUTH: Settings = Settings {
    home: -3.2,
    min_angle: -3.14,
    max_angle: 3.14,
    ..POLAR
};
const POLAR: Settings = Settings {
    steps_per_radian: 200.0 * 16.0 * 4.0 / core::f32::consts::TAU,
    speed: 4_000.0,
    acceleration: 20_000.0,
    homing_speed: 1_000.0,
    home: 0.0,
    min_angle: 0.0,
    max_angle: 0.0,
    tolerance: 2,
    reversed: false,
};

const FAULT: Error = Error::new(ErrorCode::Machine);

/// Returns the place of readings in the flash: two areas of whole sectors from `start` on.
const fn readings_at(start: u32, area_bytes: u32) -> Layout {
    Layout {
        start,
        area_bytes,
        slot_bytes: 0,
    }
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

/// The button: it starts a scan, stops it, and continues after a failure.
struct Button<W> {
    pin: W,
    next: Command,
}

impl<W: Wait> Operator for Button<W> {
    async fn command(&mut self) -> Command {
        // A pin that cannot be read gives no command.
        if self.pin.wait_for_falling_edge().await.is_err() {
            core::future::pending::<()>().await;
        }
        core::mem::replace(&mut self.next, Command::Stop)
    }

    fn show(&mut self, event: Event<'_>) {
        match event {
            Event::Finished(residual, _) => {
                self.next = Command::Restart;
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

/// Scans after a press of the button, one material after the other. Returns an error of recipe, settings, sensor or flash.
async fn scan<S, D, H>(
    board: Board<S, D, H, impl I2c, impl NorFlash, (impl Read, impl Write), impl Wait>,
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
        axis(theta_i, lamp).map_err(|_| FAULT)?,
        axis(phi_i, lamp_azimuth).map_err(|_| FAULT)?,
        axis(theta_o, sensor).map_err(|_| FAULT)?,
        axis(phi_o, sensor_azimuth).map_err(|_| FAULT)?,
    ];
    let arms = Goniometer::new(axes, MIN_SEPARATION, None).map_err(|_| FAULT)?;
    let mut config = Config::new(Host::Listens);
    config.machine = Some(Machine::new(arms.limits()));
    config.sequence_seed = boots;
    let calibration = Calibration::new(DARK, WHITE, REFLECTANCE)?;
    let color_sensor = ColorSensor::new(board.sensor, calibration).await?;
    let mut machine = Steppers::new(arms, color_sensor);
    let memory = MEMORY.try_init([0.0; MEMORY_WORDS]).ok_or(FAULT)?;
    let scan = Scan::<Model>::new(recipe, memory)?;
    let mut button = Button {
        pin: board.button,
        next: Command::Resume,
    };
    defmt::info!("press the button to scan");
    button.command().await;
    run(
        scan,
        config,
        board.line,
        &mut machine,
        &mut flash,
        &mut button,
    )
    .await
}

/// Restarts the firmware, which then waits for the button.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    board::reset()
}
