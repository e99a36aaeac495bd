//! Scans of a simulated machine in virtual time: a motor that stalls, an operator, resets, a host, and a flash that fails.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::convert::Infallible;
use std::future::{Future, pending};
use std::pin::pin;
use std::sync::MutexGuard;
use std::task::{Context, Waker};

use embassy_time::{Duration, Instant, MockDriver, Timer};
use embedded_io_async::{ErrorType, Read, Write};
use glimpse_core::driver::{Config, Host};
use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::geometry::{ArmAngles, Directions, Spherical};
use glimpse_core::gonio::{Machine as Reach, Reading};
use glimpse_core::link::{FRAME_BYTES, PROTOCOL, Reply, Request, Server};
use glimpse_core::model::Neural;
use glimpse_core::recipe::{Recipe, memory_words};
use glimpse_core::scan::Scan;
use glimpse_desk::{Effect, Flash, Machine, SECTOR_BYTES, take_clock};
use glimpse_scanner::store::{Layout, Store};
use glimpse_scanner::{Command, Event, FlashMemory, Operator, Sensor, Steppers, run};

static RECIPE: &[u8] = include_bytes!("../../../../trainer/recipes/completed/neural-n8.recipe");
const LAYOUT: Layout = Layout {
    start: 0,
    area_bytes: 2 * SECTOR_BYTES as u32,
};

/// The BRDF of the simulated material.
fn brdf(at: &Directions<f32>) -> [f32; 3] {
    let cosine = at.incoming[2] * at.outgoing[2];
    [0.3, 0.2, 0.1].map(|albedo| albedo * (1.0 - 0.5 * cosine))
}

/// A scanner on a desk, with everything that outlives a run of its firmware.
struct Desk {
    machine: Machine,
    flash: RefCell<Flash>,
    /// Commands, and the number of readings after which each is given.
    commands: RefCell<VecDeque<(usize, Command)>>,
    readings: Cell<usize>,
    /// True if the operator resumes after a failure.
    resumes: Cell<bool>,
    /// The number of readings after which a motor misses steps.
    stall_after: Cell<Option<usize>>,
    /// The fitted values of each scan that was shown.
    results: RefCell<Vec<Vec<f32>>>,
    failures: RefCell<Vec<Error>>,
    unsaved: Cell<usize>,
    host: RefCell<Computer>,
    _clock: MutexGuard<'static, ()>,
}

impl Desk {
    fn new() -> Self {
        Self {
            _clock: take_clock(),
            machine: Machine::new([900, 3000, 700, 5000]),
            flash: RefCell::new(Flash::new()),
            commands: RefCell::default(),
            readings: Cell::new(0),
            resumes: Cell::new(false),
            stall_after: Cell::new(None),
            results: RefCell::default(),
            failures: RefCell::default(),
            unsaved: Cell::new(0),
            host: RefCell::default(),
        }
    }

    /// Runs the firmware until a condition holds: after a reset, as from the start.
    fn run(&self, host: Host, until: impl Fn() -> bool) {
        let mut memory = [0.0; memory_words(&[RECIPE])];
        let recipe = Recipe::parse(RECIPE).unwrap();
        let flash = &mut *self.flash.borrow_mut();
        let mut store =
            FlashMemory::new(Store::<_, 8>::mount(flash, LAYOUT).unwrap(), &recipe).unwrap();
        let scan = Scan::<Neural>::new(recipe, &mut memory).unwrap();
        let arms = self.machine.arms(None);
        let mut config = Config::new(host);
        config.machine = Some(Reach::new(arms.limits()));
        let mut steppers = Steppers::new(arms, self);
        let mut operator = self;
        let line = (self, self);
        let mut firmware = pin!(run(
            scan,
            config,
            line,
            &mut steppers,
            &mut store,
            &mut operator
        ));
        let mut context = Context::from_waker(Waker::noop());
        while !until() {
            assert!(firmware.as_mut().poll(&mut context).is_pending());
            assert!(Instant::now().as_secs() < 600, "{:?}", self.failures);
            MockDriver::get().advance(Duration::from_micros(20));
        }
    }

    fn has_results(&self, count: usize) -> bool {
        self.results.borrow().len() == count
    }

    /// Compares the last result with a fit of exact readings.
    fn check_result(&self) {
        let mut memory = [0.0; memory_words(&[RECIPE])];
        let mut scan = Scan::<Neural>::new(Recipe::parse(RECIPE).unwrap(), &mut memory).unwrap();
        while let Some((index, directions)) = scan.next_pending() {
            scan.record(index, Reading::new(brdf(&directions))).unwrap();
        }
        let mut fit = scan.fit().unwrap();
        while !fit.advance(100).is_complete() {}
        let exact: Vec<f32> = fit.finish().unwrap().values().collect();
        let results = self.results.borrow();
        let pairs = results.last().unwrap().iter().zip(&exact);
        let error = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(error < 0.02 && exact.len() == 675, "{error}");
    }
}

impl Sensor for &Desk {
    async fn read(&mut self, arms: &ArmAngles) -> Result<Reading, Error> {
        assert!(arms.directions().separation() > 0.0);
        Timer::after_millis(50).await;
        let [theta_i, phi_i, theta_o, phi_o] = self.machine.angles();
        let at = |theta, phi| Spherical { theta, phi };
        let (incoming, outgoing) = (at(theta_i, phi_i), at(theta_o, phi_o));
        self.readings.set(self.readings.get() + 1);
        if self.stall_after.get() == Some(self.readings.get()) {
            self.machine.arms[2].stalled.set(500);
        }
        let directions = ArmAngles { incoming, outgoing }.directions();
        Ok(Reading::new(brdf(&directions)))
    }
}

impl Operator for &Desk {
    async fn command(&mut self) -> Command {
        loop {
            let commands = &self.commands;
            let next = commands.borrow().front().copied();
            if let Some((readings, command)) = next
                && readings <= self.readings.get()
            {
                commands.borrow_mut().pop_front();
                return command;
            }
            Timer::after_millis(10).await;
        }
    }

    fn show(&mut self, event: Event<'_>) {
        match event {
            Event::Finished(_, values) => self.results.borrow_mut().push(values.collect()),
            Event::Failed(error) => {
                self.failures.borrow_mut().push(error);
                let commands = &mut self.commands.borrow_mut();
                commands.extend(self.resumes.get().then_some((0, Command::Resume)));
            }
            Event::Unsaved => self.unsaved.set(self.unsaved.get() + 1),
        }
    }
}

/// A host that listens, at the other end of the line.
#[derive(Default)]
struct Computer {
    server: Server,
    is_unplugged: bool,
    replies: VecDeque<u8>,
    values: Vec<f32>,
    has_result: bool,
}

impl ErrorType for &Desk {
    type Error = Infallible;
}

impl Read for &Desk {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        loop {
            let reply = self.host.borrow_mut().replies.pop_front();
            if let Some(byte) = reply {
                buffer[0] = byte;
                return Ok(1);
            }
            Timer::after_millis(1).await;
        }
    }
}

impl Write for &Desk {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        if self.host.borrow().is_unplugged {
            pending::<()>().await;
        }
        let host = &mut *self.host.borrow_mut();
        let mut frame = [0; FRAME_BYTES];
        for byte in bytes {
            let reply = host.server.answer(*byte, &mut frame, |request| {
                match &request {
                    Request::Hello { .. } => return Some(Reply::Welcome { protocol: PROTOCOL }),
                    Request::Values { values, .. } => host.values.extend(values.as_slice()),
                    request => host.has_result |= matches!(request, Request::Finished(_)),
                }
                Some(Reply::Accepted)
            });
            host.replies.extend(reply.unwrap_or_default());
        }
        Ok(bytes.len())
    }

    async fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

#[test]
fn scans_follow_one_another() {
    let desk = Desk::new();
    desk.run(Host::Absent, || {
        let commands = &mut desk.commands.borrow_mut();
        if desk.has_results(1) && desk.readings.get() == 8 && commands.is_empty() {
            commands.push_back((8, Command::Restart));
        }
        desk.has_results(2)
    });
    desk.check_result();
    assert_eq!(desk.readings.get(), 16);
    assert!(desk.failures.borrow().is_empty() && desk.unsaved.get() == 0);
}

/// Readings after lost steps are never shown as a result, and nothing moves until a command.
#[test]
fn lost_steps_stop_the_scan() {
    let desk = Desk::new();
    desk.stall_after.set(Some(3));
    desk.resumes.set(true);
    desk.run(Host::Absent, || desk.has_results(1));
    assert_eq!((desk.failures.borrow().len(), desk.readings.get()), (1, 16));
    desk.check_result();
}

#[test]
fn nothing_moves_after_a_stop() {
    let desk = Desk::new();
    desk.commands.borrow_mut().push_back((2, Command::Stop));
    let stopped = Cell::new(None);
    desk.run(Host::Absent, || {
        let is_stopped = !desk.failures.borrow().is_empty();
        match stopped.get() {
            None if is_stopped => stopped.set(Some((desk.machine.positions(), Instant::now()))),
            Some((positions, since)) => {
                assert_eq!(desk.machine.positions(), positions);
                if since.elapsed() > Duration::from_secs(60) {
                    desk.commands.borrow_mut().push_back((0, Command::Resume));
                    desk.failures.borrow_mut().clear();
                    stopped.set(None);
                }
            }
            None => {}
        }
        desk.has_results(1)
    });
    desk.check_result();
}

/// A reset loses the readings that no homing has confirmed.
#[test]
fn scans_survive_resets() {
    let desk = Desk::new();
    for readings in [3, 5, 20] {
        let until = || desk.readings.get() >= readings || desk.has_results(1);
        desk.run(Host::Absent, until);
    }
    assert!(desk.has_results(1));
    desk.check_result();
}

#[test]
fn a_host_may_listen() {
    let desk = Desk::new();
    desk.run(Host::Listens, || desk.host.borrow().has_result);
    desk.check_result();
    assert_eq!(desk.host.borrow().values, desk.results.borrow()[0]);
    desk.host.borrow_mut().is_unplugged = true;
    desk.run(Host::Listens, || desk.has_results(2));
    desk.check_result();
}

/// A flash that fails during a scan stops it before its result, because the saved readings cannot be confirmed.
#[test]
fn readings_that_cannot_be_saved_are_shown() {
    let desk = Desk::new();
    // The store writes when it begins, and then fails.
    desk.flash.borrow_mut().cut = Some((6, Effect::Low(0)));
    desk.run(Host::Absent, || !desk.failures.borrow().is_empty());
    let code = desk.failures.borrow()[0].code;
    assert!(code == ErrorCode::Storage && desk.unsaved.get() > 0 && desk.has_results(0));
}
