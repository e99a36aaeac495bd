//! A scanner on a desk: everything around a firmware, and everything that outlives a run of it.

use std::cell::{Cell, RefCell};
use std::f32::consts::TAU;
use std::pin::pin;
use std::sync::MutexGuard;
use std::task::{Context, Waker};

use embassy_time::{Duration, Instant, MockDriver, Timer};
use glimpse_core::driver::{Config, Host};
use glimpse_core::error::Error;
use glimpse_core::fit::AnyModel;
use glimpse_core::geometry::Arms;
use glimpse_core::gonio::{Footprint, Machine as Reach, Reading};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Residual, Scan};
use glimpse_core::store::{Layout, Store};
use glimpse_scanner::route::AxisAngles;
use glimpse_scanner::{ColorSensor, Command, Event, Operator, White, run};

use crate::arms::Machine;
use crate::flash::{Flash, SECTOR_BYTES};
use crate::line::{Computer, Line};
use crate::optics::{Brdf, DARK, PLASTIC, SensorFault, ggx};
use crate::pin::{Output, Pin};
use crate::random::Random;
use crate::take_clock;

/// The place of the store: two areas of sixteen sectors.
const LAYOUT: Layout = Layout {
    start: 0,
    area_bytes: 16 * SECTOR_BYTES as u32,
};

type Action = Box<dyn FnOnce(&Desk)>;

/// A desk. Set its fields before a run; cells may change during one. A new desk has the axes of the template: set the
/// fields of [`Machine`] and `tile` to those of your firmware, and call [`Desk::calibrate`].
pub struct Desk {
    /// The recipe of the firmware.
    pub recipe: Recipe<'static>,
    /// The arms.
    pub machine: Machine,
    /// The firmware's white tile.
    pub tile: White,
    /// The firmware's options. A run sets machine and seed.
    pub config: Config,
    /// The material on the sample's place.
    pub material: Brdf,
    /// Brightness of the lamp, and its change per second.
    pub lamp: (f32, f32),
    /// True if the firmware cannot switch the lamp off.
    pub is_always_lit: bool,
    /// Counts of the room's light, and their change per second.
    pub room: (f32, f32),
    /// Counts of the white tile with light along the normal, with the nominal exposure.
    pub white_counts: f32,
    /// A fault of the sensor.
    pub sensor: Cell<Option<SensorFault>>,
    /// The registers of the sensor.
    pub registers: Cell<[u8; 32]>,
    /// The flash.
    pub flash: RefCell<Flash>,
    /// The line.
    pub line: Line,
    /// The host at its other end.
    pub host: RefCell<Computer>,
    /// The next command of the operator, who otherwise resumes.
    pub command: Cell<Option<Command>>,
    /// The true angles at each reading of the sensor.
    pub readings: RefCell<Vec<AxisAngles>>,
    /// The residual of each result.
    pub results: RefCell<Vec<Residual>>,
    /// Each failure.
    pub failures: RefCell<Vec<Error>>,
    /// The text of each event.
    pub texts: RefCell<Vec<String>>,
    /// An action, and the text and the number of the event that it follows.
    after: RefCell<Option<(&'static str, usize, Action)>>,
    pub(crate) is_lit: Cell<bool>,
    pub(crate) random: RefCell<Random>,
    _clock: MutexGuard<'static, ()>,
}

impl Desk {
    /// Creates a desk with the template's axes. The firmware is calibrated and has checked its directions, and the sample is
    /// of plastic. The arms stand anywhere.
    pub fn new(recipe: &'static [u8]) -> Self {
        let _clock = take_clock();
        let desk = Self {
            recipe: Recipe::parse(recipe).unwrap(),
            machine: Machine::new([900, 3000, 700, 5000]),
            tile: White {
                at: Arms::from_array([0.0, 0.0, 0.785, 0.0]),
                reflectance: [0.99; 3],
                footprint: Footprint::LightLarger,
            },
            config: Config::new(Host::Listens),
            material: ggx(PLASTIC),
            lamp: (1.0, 0.0),
            is_always_lit: false,
            room: (0.0, 0.0),
            white_counts: 4_000.0,
            sensor: Cell::default(),
            registers: Cell::default(),
            flash: RefCell::new(Flash::new(32)),
            line: Line::Unplugged,
            host: RefCell::default(),
            command: Cell::default(),
            readings: RefCell::default(),
            results: RefCell::default(),
            failures: RefCell::default(),
            texts: RefCell::default(),
            after: RefCell::default(),
            is_lit: Cell::default(),
            random: RefCell::new(Random(1)),
            _clock,
        };
        desk.calibrate();
        desk
    }

    /// Saves a calibration with the present exposure, and that the directions of the present settings are right.
    pub fn calibrate(&self) {
        let settings = self.machine.arms(false).settings_checksum();
        let saved = self.with_store(|store| {
            store.save_white([DARK; 3], [self.white_counts; 3])?;
            store.save_proven(settings)
        });
        saved.unwrap();
    }

    /// Flashes a new firmware, with the arms at their switches.
    pub fn erase(&self) {
        self.flash.borrow_mut().bytes.fill(0xFF);
        self.machine.place([170, -20, 1, 0]);
    }

    /// Calls the store while the firmware does not run.
    pub fn with_store<T>(&self, call: impl FnOnce(&mut Store<&mut Flash>) -> T) -> T {
        let mut flash = self.flash.borrow_mut();
        call(&mut Store::mount(&mut *flash, LAYOUT, &self.recipe).unwrap())
    }

    /// Runs the firmware until it shows a result or a failure.
    pub fn scan(&self) {
        let count = || self.results.borrow().len() + self.failures.borrow().len();
        let before = count();
        self.run(|| count() > before);
    }

    /// Registers an action that follows the event with this number among those whose texts begin with `text`.
    pub fn after(&self, text: &'static str, count: usize, action: impl FnOnce(&Self) + 'static) {
        self.after.replace(Some((text, count, Box::new(action))));
    }

    /// Returns the number of events whose texts begin with `text`.
    pub fn count(&self, text: &str) -> usize {
        let texts = self.texts.borrow();
        texts.iter().filter(|shown| shown.starts_with(text)).count()
    }

    /// Starts the firmware, and runs it until a condition holds. Panics after half an hour.
    pub fn run(&self, until: impl Fn() -> bool) {
        self.run_with(&mut { self }, until);
    }

    /// As [`Desk::run`], with another operator.
    pub fn run_with(&self, operator: &mut impl Operator, until: impl Fn() -> bool) {
        let mut memory = vec![0.0; self.recipe.memory_words()];
        let scan = Scan::<AnyModel>::new(self.recipe, &mut memory).unwrap();
        let mut flash = self.flash.borrow_mut();
        let store = &mut Store::mount(&mut *flash, LAYOUT, &self.recipe).unwrap();
        let arms = self.machine.arms(false);
        let mut config = self.config;
        config.machine = Some(Reach::new(arms.limits()));
        config.sequence_seed = store.count_boot().unwrap();
        let lamp: Output<'_> = Pin(Box::new(|level| self.is_lit.set(level)));
        let instrument = &mut glimpse_scanner::Instrument::new(arms, lamp, ColorSensor::new(self));
        let (operator, line) = (&mut Recorder(operator, self), (self, self));
        let mut firmware = pin!(run(
            scan, config, self.tile, instrument, store, operator, line
        ));
        let mut context = Context::from_waker(Waker::noop());
        let end = Instant::now() + Duration::from_secs(1800);
        while !until() {
            assert!(firmware.as_mut().poll(&mut context).is_pending());
            assert!(Instant::now() < end, "hangs: {:?}", self.texts.borrow());
            MockDriver::get().advance(Duration::from_micros(20));
        }
    }

    /// Returns the mean relative difference between the BRDFs of two fits, at 512 directions, with light at the normal and at
    /// 50 degrees: that of the saved readings, and that of exact readings of the material.
    pub fn error(&self) -> f32 {
        let saved = self.fitted(|scan| {
            self.with_store(|store| store.restore(scan)).unwrap();
        });
        let exact = self.fitted(|scan| {
            for (index, at) in self.recipe.directions() {
                scan.record(index, Reading::new((self.material)(&at)))
                    .unwrap();
            }
        });
        let pairs = saved.iter().zip(&exact);
        pairs
            .map(|(saved, exact)| (saved / exact - 1.0).abs())
            .sum::<f32>()
            / saved.len() as f32
    }

    /// Returns the BRDF that is fitted to the recorded readings.
    fn fitted(&self, record: impl FnOnce(&mut Scan<'_, AnyModel>)) -> Vec<f32> {
        let mut memory = vec![0.0; self.recipe.memory_words()];
        let mut scan = Scan::<AnyModel>::new(self.recipe, &mut memory).unwrap();
        record(&mut scan);
        _ = scan.finish_early(); // after a target loss
        let mut fit = scan.fit().unwrap();
        while !fit.advance(u32::MAX).is_complete() {}
        _ = fit.finish(); // it may be implausible
        let fitted = scan.fitted().unwrap();
        let at = |index: u16| {
            let [t, p] = [index / 2 % 16, index / 32].map(|step| (f32::from(step) + 0.5) / 16.0);
            let theta_i = if index.is_multiple_of(2) { 0.0 } else { 0.87 };
            Arms::from_array([theta_i, 0.0, 1.4 * t, TAU * p]).directions()
        };
        (0..512)
            .flat_map(|index| fitted.brdf(&at(index)).unwrap())
            .collect()
    }
}

/// An operator who gives the next command at once, and otherwise resumes every 10 ms.
impl Operator for &Desk {
    async fn command(&mut self) -> Command {
        if self.command.get().is_none() {
            Timer::after_millis(10).await;
        }
        self.command.take().unwrap_or(Command::Resume)
    }

    fn show(&mut self, _event: &mut Event<'_>) {}
}

/// An operator, and a desk that records the events.
struct Recorder<'a, O>(&'a mut O, &'a Desk);

impl<O: Operator> Operator for Recorder<'_, O> {
    async fn command(&mut self) -> Command {
        self.0.command().await
    }

    fn show(&mut self, event: &mut Event<'_>) {
        let desk = self.1;
        desk.texts.borrow_mut().push(event.to_string());
        match event {
            Event::Finished(residual, _) => desk.results.borrow_mut().push(*residual),
            Event::Failed(error) => desk.failures.borrow_mut().push(*error),
            _ => {}
        }
        self.0.show(event);
        let is_due = |after: &mut (&str, usize, Action)| desk.count(after.0) == after.1;
        let due = desk.after.borrow_mut().take_if(is_due);
        due.into_iter().for_each(|(.., action)| action(desk));
    }
}
