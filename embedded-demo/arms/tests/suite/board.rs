//! A board with a button, a serial line with a host or noise, and the simulated scanner.

use std::cell::Cell;
use std::collections::VecDeque;
use std::convert::Infallible;

use crate::support::{BUFFER_BYTES, Flash, SECTOR_BYTES, mount_readings, mount_recipes};
use embedded_hal::digital::{ErrorType, OutputPin};
use glimpse_arms::scanner::{Command, Event, Outcome, Platform, Scanner, Seeds, StartMode};
use glimpse_arms::sensor::{Photometer, Sensor, WhiteTile};
use glimpse_arms::simulated::{DirectionPin, SimulatedScanner, StepPin, Switch};
use glimpse_arms::station::{self, Station};
use glimpse_arms::store::readings::Readings;
use glimpse_arms::store::recipes::Recipes;
use glimpse_arms::{MEMORY_WORDS, Model};
use glimpse_core::driver;
use glimpse_core::fit::Fitter;
use glimpse_core::geometry::Directions;
use glimpse_core::gonio::{Footprint, Limits, Machine, Speeds};
use glimpse_core::link::{FRAME_BYTES, PROTOCOL, Received, RecipeBytes, Reply, Request, Server};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Residual;

pub(crate) static PHONG: &[u8] = include_bytes!("../../../../trainer/recipes/phong-n8.recipe");
pub(crate) static COOK_TORRANCE: &[u8] =
    include_bytes!("../../../../trainer/recipes/cook-torrance-n8.recipe");

/// A recipe of 16 samples that tolerates missing readings.
pub(crate) static MASKED: &[u8] =
    include_bytes!("../../../../trainer/recipes/masked/phong-n16.recipe");

/// Duration of an iteration of the main loop, us.
pub(crate) const ROUND: u64 = 40;
pub(crate) const SECOND: u64 = 1_000_000;

/// Reply of a host to a request. None: the host is silent.
pub(crate) type Answer<'b> = Box<dyn FnMut(&Request) -> Option<Reply> + 'b>;

/// A host that replies to requests, or is silent.
pub(crate) struct Host<'b> {
    pub(crate) server: Server,
    pub(crate) answer: Answer<'b>,
    pub(crate) requests: Vec<Request>,
}

impl<'b> Host<'b> {
    pub(crate) fn new(answer: impl FnMut(&Request) -> Option<Reply> + 'b) -> Self {
        Self {
            server: Server::new(),
            answer: Box::new(answer),
            requests: Vec::new(),
        }
    }

    pub(crate) fn count(&self, is_counted: impl Fn(&Request) -> bool) -> usize {
        let counted = self.requests.iter().filter(|request| is_counted(request));
        counted.count()
    }

    /// Receives a byte. Returns the bytes of the reply, if it completed a request.
    pub(crate) fn receive(&mut self, byte: u8) -> Vec<u8> {
        let reply = match self.server.receive(byte) {
            Some(Ok(Received::New(request))) => {
                self.requests.push(request.clone());
                (self.answer)(&request)
            }
            Some(Ok(Received::Duplicate(reply))) => Some(reply),
            _ => None,
        };
        let mut buffer = [0; FRAME_BYTES];
        let frame = reply.map(|reply| self.server.reply(reply, &mut buffer).unwrap().to_vec());
        frame.unwrap_or_default()
    }
}

/// Returns the part of a recipe from `offset` on.
pub(crate) fn part(recipe: &[u8], offset: u32) -> Reply {
    let bytes = RecipeBytes::take_from(recipe[offset as usize..].iter().copied());
    Reply::RecipePart { offset, bytes }
}

/// Returns the reply of a host that listens and offers a recipe, or none.
pub(crate) fn answer(request: &Request, offered: Option<(&[u8], u32)>) -> Reply {
    match (request, offered) {
        (Request::Hello { .. }, _) => Reply::Welcome { protocol: PROTOCOL },
        (Request::Update, Some((recipe, checksum))) => Reply::Recipe {
            bytes: recipe.len() as u32,
            checksum,
        },
        (Request::RecipePart { offset }, Some((recipe, _))) => part(recipe, *offset),
        _ => Reply::Accepted,
    }
}

pub(crate) fn checksum_of(recipe: &[u8]) -> u32 {
    Recipe::parse(recipe).unwrap().checksum()
}

/// Panic payload that ends a test run.
pub(crate) struct TestEnd;

/// A board.
pub(crate) struct TestBoard<'b> {
    /// Time since the start, us.
    pub(crate) now: u64,
    /// Time at which the run ends at the latest, us.
    pub(crate) until: u64,
    /// Commands and their times, us.
    pub(crate) commands: VecDeque<(u64, Command)>,
    /// Noise bytes on the line and their times, us.
    pub(crate) noise: VecDeque<(u64, u8)>,
    pub(crate) host: Option<Host<'b>>,
    pub(crate) replies: VecDeque<u8>,
    /// All bytes that the device has sent.
    pub(crate) sent: Vec<u8>,
    pub(crate) events: Vec<Event>,
    /// Receives all events; true ends the run.
    pub(crate) watch: Box<dyn FnMut(&Event) -> bool + 'b>,
}

impl<'b> TestBoard<'b> {
    pub(crate) fn new(until: u64, watch: impl FnMut(&Event) -> bool + 'b) -> Self {
        Self {
            now: 0,
            until,
            commands: VecDeque::new(),
            noise: VecDeque::new(),
            host: None,
            replies: VecDeque::new(),
            sent: Vec::new(),
            events: Vec::new(),
            watch: Box::new(watch),
        }
    }

    /// Runs the firmware with the simulated scanner.
    pub(crate) fn serve(&mut self, simulated: &SimulatedScanner, flash: &mut Flash) {
        let mut memory = [0.0; MEMORY_WORDS];
        serve::<_, _, Model>(simulated.station(), flash, &mut memory, self);
    }

    pub(crate) fn outcomes(&self) -> Vec<Outcome> {
        let outcome = |event: &Event| match event {
            Event::Ended(outcome) => Some(*outcome),
            _ => None,
        };
        self.events.iter().filter_map(outcome).collect()
    }

    /// Returns the number of readings that were taken and saved.
    pub(crate) fn reads(&self) -> usize {
        let is_read = |event: &&Event| matches!(event, Event::Read { .. });
        self.events.iter().filter(is_read).count()
    }
}

impl Platform for TestBoard<'_> {
    fn elapsed_us(&mut self) -> u32 {
        self.now += ROUND;
        if self.now >= self.until {
            std::panic::resume_unwind(Box::new(TestEnd));
        }
        ROUND as u32
    }

    fn receive(&mut self) -> Option<u8> {
        match self.noise.front() {
            Some((at, _)) if *at <= self.now => self.noise.pop_front().map(|(_, byte)| byte),
            _ => self.replies.pop_front(),
        }
    }

    fn send(&mut self, byte: u8) -> bool {
        self.sent.push(byte);
        if let Some(host) = &mut self.host {
            self.replies.extend(host.receive(byte));
        }
        true
    }

    fn command(&mut self) -> Option<Command> {
        let (at, command) = self.commands.front().copied()?;
        (at <= self.now).then(|| self.commands.pop_front())?;
        Some(command)
    }

    fn save_positions(&mut self, _: Option<[i32; 4]>) {}

    fn report(&mut self, event: Event) {
        self.events.push(event);
        if (self.watch)(&event) {
            std::panic::resume_unwind(Box::new(TestEnd));
        }
    }

    fn report_fit(&mut self, _: Residual, _: &mut dyn Iterator<Item = f32>) {}
}

/// Counts of [`ScriptedSensor`] in the dark, and those of the white tile above them.
pub(crate) const DARK: u16 = 1000;
pub(crate) const WHITE: u16 = 100;
/// Counts of a lit sample: a dark gray one, and one far below 0.
pub(crate) const GRAY: u16 = DARK + 30;
pub(crate) const NEGATIVE: u16 = 0;

/// A sensor whose counts a test chooses while the lamp is on. None: the converter fails.
pub(crate) struct ScriptedSensor<'c> {
    pub(crate) is_lit: &'c Cell<bool>,
    pub(crate) lit: &'c mut dyn FnMut() -> Option<u16>,
}

/// Error: the converter has failed.
pub(crate) struct ConverterFailed;

impl Sensor for ScriptedSensor<'_> {
    type Error = ConverterFailed;

    fn read(&mut self) -> Result<[u16; 3], ConverterFailed> {
        let count = if self.is_lit.get() {
            (self.lit)().ok_or(ConverterFailed)?
        } else {
            DARK
        };
        Ok([count; 3])
    }
}

/// The lamp of [`ScriptedSensor`].
pub(crate) struct TestLamp<'c>(pub(crate) &'c Cell<bool>);

impl ErrorType for TestLamp<'_> {
    type Error = Infallible;
}

impl OutputPin for TestLamp<'_> {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.set(false);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.set(true);
        Ok(())
    }
}

/// Returns a station of the simulated arms and a [`ScriptedSensor`], which is read once for each reading.
pub(crate) fn scripted_station<'c>(
    simulated: &'c SimulatedScanner,
    is_lit: &'c Cell<bool>,
    lit: &'c mut dyn FnMut() -> Option<u16>,
) -> Station<StepPin<'c>, DirectionPin<'c>, Switch<'c>, ScriptedSensor<'c>, TestLamp<'c>> {
    let normal = [0.0, 0.0, 1.0];
    let white = WhiteTile {
        counts: [WHITE.into(); 3],
        reflectance: [1.0; 3],
        directions: Directions {
            incoming: normal,
            outgoing: normal,
        },
        footprint: Footprint::LightLarger,
        full_scale: u16::MAX,
    };
    let settings = station::Settings {
        machine: Machine {
            speeds: Speeds {
                theta_i: 2.0,
                phi_i: 2.0,
                theta_o: 2.0,
                phi_o: 2.0,
            },
            limits: Limits::NONE,
            isotropic: true,
            through_normal: false,
        },
        arm_settling_us: 20_000,
        lamp_settling_us: 5_000,
    };
    let photometer = Photometer::new(ScriptedSensor { is_lit, lit }, TestLamp(is_lit), white, 1);
    Station::new(simulated.goniometer(), photometer, settings)
}

/// Boots the firmware with the recipe [`PHONG`], and runs it until the test run ends.
pub(crate) fn serve<A: Sensor, L: OutputPin, K: Fitter>(
    station: Station<StepPin<'_>, DirectionPin<'_>, Switch<'_>, A, L>,
    flash: &mut Flash,
    memory: &mut [f32],
    board: &mut TestBoard<'_>,
) {
    let mut readings = mount_readings(flash);
    let boots = readings.count_boot(flash).unwrap();
    let recipes = mount_recipes(flash);
    let mut scanner = Scanner {
        station,
        flash: flash.clone(),
        readings,
        recipes,
        seeds: Seeds::new(boots),
    };
    let run = std::panic::AssertUnwindSafe(|| {
        let mut buffer = [0; BUFFER_BYTES];
        scanner.serve::<K>(PHONG, &mut buffer, memory, board)
    });
    match std::panic::catch_unwind(run) {
        Err(payload) if payload.is::<TestEnd>() => {}
        Err(panic) => std::panic::resume_unwind(panic),
    }
    *flash = scanner.flash;
}

/// Scans one material by any recipe, without a host, and started immediately. The flash is new and has room for 100
/// samples.
pub(crate) fn scan_once<A: Sensor, L: OutputPin>(
    station: Station<StepPin<'_>, DirectionPin<'_>, Switch<'_>, A, L>,
    recipe: &[u8],
    board: &mut TestBoard<'_>,
) -> Outcome {
    let bytes = SECTOR_BYTES as u32;
    let mut flash: Flash = Flash::new(24);
    let readings = Readings::mount(&mut flash, [0..8 * bytes, 8 * bytes..16 * bytes]).unwrap();
    let slots = [16 * bytes..20 * bytes, 20 * bytes..24 * bytes];
    let recipes = Recipes::mount(&mut flash, slots, &mut [0; BUFFER_BYTES]).unwrap();
    let mut scanner = Scanner {
        station,
        flash,
        readings,
        recipes,
        seeds: Seeds::new(1),
    };
    let mut memory = [0.0; MEMORY_WORDS];
    scanner.scan::<Model>(
        recipe,
        &mut memory,
        driver::Host::Absent,
        StartMode::Immediate,
        board,
    )
}

pub(crate) fn is_finished(event: &Event) -> bool {
    matches!(event, Event::Ended(Outcome::Finished))
}

/// Initial positions of the arms.
pub(crate) const POSITIONS: [i32; 4] = [300, 500, 40, 700];

pub(crate) fn simulated() -> SimulatedScanner {
    SimulatedScanner::new(POSITIONS)
}
