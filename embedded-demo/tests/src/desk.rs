//! A scanner on a desk: everything around a firmware, and everything that outlives a run of it.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::f32::consts::TAU;
use std::pin::pin;
use std::sync::MutexGuard;
use std::task::{Context, Waker};

use embassy_time::{Duration, Instant, MockDriver, Timer};
use glimpse_core::driver::{Config, Host};
use glimpse_core::error::Error;
use glimpse_core::fit::AnyModel;
use glimpse_core::geometry::{Arms, Directions};
use glimpse_core::gonio::{Footprint, Machine as Reach, Reading};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Residual, Scan};
use glimpse_core::store::{Layout, Store};
use glimpse_scanner::{ColorSensor, Command, Event, Operator, White, run};

use crate::optics::{Light, Registers, SensorFault};
use crate::{Computer, Flash, Line, Machine, SECTOR_BYTES, take_clock};

/// The place of the store: two areas of sixteen sectors.
pub const LAYOUT: Layout = Layout {
    start: 0,
    area_bytes: 16 * SECTOR_BYTES as u32,
};

/// The white tile of the calibration.
pub const WHITE: White = White {
    at: Arms {
        theta_o: 0.785,
        ..Arms::NORMAL
    },
    reflectance: [0.99; 3],
    footprint: Footprint::LightLarger,
};

/// A desk.
pub struct Desk {
    /// The recipe of the firmware.
    pub recipe: &'static [u8],
    /// The arms.
    pub machine: Machine,
    /// Lamp and room.
    pub light: Light,
    /// A fault of the sensor.
    pub sensor: Cell<SensorFault>,
    /// The flash.
    pub flash: RefCell<Flash>,
    /// The line.
    pub line: Cell<Line>,
    /// The host at its other end.
    pub host: RefCell<Computer>,
    /// Options of the firmware to change.
    pub configure: Cell<fn(&mut Config)>,
    /// Commands, and the number of readings after which each is given.
    pub commands: RefCell<VecDeque<(usize, Command)>>,
    /// Number of times that the operator goes on after a failure or a question.
    pub patience: Cell<usize>,
    /// An axis that misses steps after this number of readings: readings, axis, steps.
    pub stalls: Cell<Option<(usize, usize, u32)>>,
    /// Number of readings until now.
    pub readings: Cell<usize>,
    /// The true angles at each of them.
    pub read_at: RefCell<Vec<[f32; 4]>>,
    /// The residual and the values of each result.
    pub results: RefCell<Vec<(Residual, Vec<f32>)>>,
    /// Each failure.
    pub failures: RefCell<Vec<Error>>,
    /// The text of each event.
    pub texts: RefCell<Vec<String>>,
    pub(crate) registers: Cell<Registers>,
    pub(crate) next_break: Cell<Option<Instant>>,
    _clock: MutexGuard<'static, ()>,
}

impl Desk {
    /// Creates a desk whose firmware is calibrated and has checked its directions. The arms stand anywhere.
    pub fn new(recipe: &'static [u8]) -> Self {
        let desk = Self::uncalibrated(recipe);
        desk.save_white();
        desk.save_proven();
        desk
    }

    /// Saves that the directions of the present settings are right.
    pub fn save_proven(&self) {
        let settings = self.machine.unproven().settings_checksum();
        self.with_store(|store| store.save_proven(settings))
            .unwrap();
    }

    /// Saves a calibration with the present light.
    pub fn save_white(&self) {
        let [dark, white] = [&self.light.dark, &self.light.white].map(|counts| [counts.get(); 3]);
        self.with_store(|store| store.save_white(dark, white))
            .unwrap();
    }

    /// Calls the store while the firmware does not run.
    pub fn with_store<T>(&self, call: impl FnOnce(&mut Store<&mut Flash>) -> T) -> T {
        let mut flash = self.flash.borrow_mut();
        call(&mut Store::mount(&mut *flash, LAYOUT, &self.parsed()).unwrap())
    }

    /// Creates a desk with a new firmware, whose flash is erased.
    pub fn uncalibrated(recipe: &'static [u8]) -> Self {
        let _clock = take_clock();
        Self {
            recipe,
            machine: Machine::new([900, 3000, 700, 5000]),
            light: Light::default(),
            sensor: Cell::default(),
            flash: RefCell::new(Flash::new(32)),
            line: Cell::new(Line::Unplugged),
            host: RefCell::default(),
            configure: Cell::new(|_| ()),
            commands: RefCell::default(),
            patience: Cell::new(2),
            stalls: Cell::new(None),
            readings: Cell::new(0),
            read_at: RefCell::default(),
            results: RefCell::default(),
            failures: RefCell::default(),
            texts: RefCell::default(),
            registers: Cell::default(),
            next_break: Cell::new(None),
            _clock,
        }
    }

    fn parsed(&self) -> Recipe<'static> {
        Recipe::parse(self.recipe).unwrap()
    }

    /// Returns the true directions of lamp and sensor.
    pub fn directions(&self) -> Directions<f32> {
        Arms::from_array(self.machine.angles()).directions()
    }

    /// Runs the firmware until a condition holds: after a restart, as from the start. Fails after half an hour.
    pub fn run(&self, host: Host, until: impl Fn() -> bool) {
        self.run_with(host, &mut { self }, until);
    }

    /// As [`Desk::run`], with another operator.
    pub fn run_with(&self, host: Host, operator: &mut impl Operator, until: impl Fn() -> bool) {
        let recipe = self.parsed();
        let mut memory = vec![0.0; recipe.memory_words()];
        let mut flash = self.flash.borrow_mut();
        let mut store = Store::mount(&mut *flash, LAYOUT, &recipe).unwrap();
        let scan = Scan::<AnyModel>::new(recipe, &mut memory).unwrap();
        let arms = self.machine.unproven();
        let mut config = Config::new(host);
        config.machine = Some(Reach::new(arms.limits()));
        config.sequence_seed = store.count_boot().unwrap();
        self.configure.get()(&mut config);
        self.registers.set(Registers::default());
        let lamp = self.light.pin.pin();
        let mut machine = glimpse_scanner::Machine::new(arms, lamp, ColorSensor::new(self));
        let line = (self, self);
        let mut firmware = pin!(run(
            scan,
            config,
            WHITE,
            &mut machine,
            &mut store,
            operator,
            line
        ));
        let mut context = Context::from_waker(Waker::noop());
        let end = Instant::now() + Duration::from_secs(1800);
        while !until() {
            assert!(firmware.as_mut().poll(&mut context).is_pending());
            assert!(Instant::now() < end, "hangs: {:?}", self.texts.borrow());
            MockDriver::get().advance(Duration::from_micros(20));
        }
    }

    /// Runs the firmware until it shows a result or the operator gives up.
    pub fn scan(&self) {
        self.run(Host::Listens, || self.is_over(1));
    }

    /// Returns true if the firmware has shown this number of results, or the operator has given up.
    pub fn is_over(&self, results: usize) -> bool {
        self.results.borrow().len() >= results || self.has_given_up()
    }

    fn has_given_up(&self) -> bool {
        !self.failures.borrow().is_empty() && self.patience.get() == 0
    }

    /// Returns the mean relative difference between two BRDFs at 512 directions, with light at the normal and at 50 degrees:
    /// those of fits to the saved readings, and to exact readings of the material.
    pub fn error(&self) -> f32 {
        let recipe = self.parsed();
        let material = self.light.material.borrow();
        let exact = |scan: &mut Scan<'_, AnyModel>| {
            for (index, at) in recipe.directions() {
                scan.record(index, Reading::new(material(&at))).unwrap();
            }
        };
        let saved = |scan: &mut Scan<'_, AnyModel>| {
            self.with_store(|store| store.restore(scan)).unwrap();
        };
        let (exact, saved) = (fitted(recipe, exact), fitted(recipe, saved));
        let errors = exact
            .iter()
            .zip(&saved)
            .map(|(exact, saved)| (saved / exact - 1.0).abs());
        errors.sum::<f32>() / exact.len() as f32
    }
}

/// Returns the fitted BRDF at 512 directions.
fn fitted(recipe: Recipe<'_>, record: impl FnOnce(&mut Scan<'_, AnyModel>)) -> Vec<f32> {
    let mut memory = vec![0.0; recipe.memory_words()];
    let mut scan = Scan::<AnyModel>::new(recipe, &mut memory).unwrap();
    record(&mut scan);
    if scan.next_pending().is_some() {
        scan.finish_early().unwrap();
    }
    let mut fit = scan.fit().unwrap();
    while !fit.advance(u32::MAX).is_complete() {}
    _ = fit.finish();
    let fitted = scan.fitted().unwrap();
    let mut brdf = Vec::new();
    for theta_i in [0.0_f32, 50.0] {
        for (t, p) in (0..16_u8).flat_map(|t| (0..16_u8).map(move |p| (t, p))) {
            let theta = (f32::from(t) + 0.5) / 16.0 * 80.0_f32.to_radians();
            let phi = (f32::from(p) + 0.5) / 16.0 * TAU;
            let arms = Arms::from_array([theta_i.to_radians(), 0.0, theta, phi]);
            brdf.extend(fitted.brdf(&arms.directions()).unwrap());
        }
    }
    brdf
}

impl Operator for &Desk {
    async fn command(&mut self) -> Command {
        loop {
            let next = self.commands.borrow().front().copied();
            if let Some((readings, command)) = next
                && readings <= self.readings.get()
            {
                self.commands.borrow_mut().pop_front();
                return command;
            }
            Timer::after_millis(10).await;
        }
    }

    fn show(&mut self, event: &mut Event<'_>) {
        self.texts.borrow_mut().push(event.to_string());
        let mut commands = self.commands.borrow_mut();
        let mut go_on = || match self.patience.get().checked_sub(1) {
            Some(left) => {
                self.patience.set(left);
                commands.push_back((0, Command::Resume));
            }
            None => {}
        };
        match event {
            Event::Waiting | Event::Saved => commands.push_back((0, Command::Resume)),
            Event::Question => go_on(),
            Event::Finished(residual, values) => {
                self.results
                    .borrow_mut()
                    .push((*residual, values.collect()));
            }
            Event::Failed(error) => {
                self.failures.borrow_mut().push(*error);
                go_on();
            }
            _ => {}
        }
    }
}
