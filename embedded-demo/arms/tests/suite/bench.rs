//! A board on a bench: a button, a line with a host or with noise on it, and the simulated scanner.

use std::cell::Cell;
use std::collections::VecDeque;
use std::convert::Infallible;

use crate::support::{BUFFER_BYTES, Flash, SECTOR, mount_readings, mount_recipes};
use embedded_hal::digital::{ErrorType, OutputPin};
use glimpse_arms::scanner::{Command, End, News, Platform, Scanner, Seeds, Start};
use glimpse_arms::sensor::{Photometer, Sensor, White};
use glimpse_arms::simulated::{DirectionPin, StepPin, Switch, World};
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

/// Microseconds that each round takes.
pub(crate) const ROUND: u64 = 40;
pub(crate) const SECOND: u64 = 1_000_000;

/// A host's answer to a request; None: it is silent.
pub(crate) type Answer<'b> = Box<dyn FnMut(&Request) -> Option<Reply> + 'b>;

/// A host that answers requests, or is silent.
pub(crate) struct Host<'b> {
    pub(crate) answerer: Server,
    pub(crate) answer: Answer<'b>,
    pub(crate) requests: Vec<Request>,
}

impl<'b> Host<'b> {
    pub(crate) fn new(answer: impl FnMut(&Request) -> Option<Reply> + 'b) -> Self {
        Self {
            answerer: Server::new(),
            answer: Box::new(answer),
            requests: Vec::new(),
        }
    }

    pub(crate) fn count(&self, is_counted: impl Fn(&Request) -> bool) -> usize {
        let counted = self.requests.iter().filter(|request| is_counted(request));
        counted.count()
    }

    /// Takes a byte. Returns the bytes of the answer, if it ended a request.
    pub(crate) fn hear(&mut self, byte: u8) -> Vec<u8> {
        let reply = match self.answerer.receive(byte) {
            Some(Ok(Received::New(request))) => {
                self.requests.push(request.clone());
                (self.answer)(&request)
            }
            Some(Ok(Received::Duplicate(reply))) => Some(reply),
            _ => None,
        };
        let mut buffer = [0; FRAME_BYTES];
        let frame = reply.map(|reply| self.answerer.reply(reply, &mut buffer).unwrap().to_vec());
        frame.unwrap_or_default()
    }
}

/// The reply with the part of a recipe from there on.
pub(crate) fn part(recipe: &[u8], offset: u32) -> Reply {
    let bytes = RecipeBytes::take_from(recipe[offset as usize..].iter().copied());
    Reply::RecipePart { offset, bytes }
}

/// The reply of a host that listens and offers a recipe, or none.
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

/// The end of a bench.
pub(crate) struct Over;

/// A board on a bench.
pub(crate) struct Board<'b> {
    /// Microseconds since it was started.
    pub(crate) now: u64,
    /// The time at which the bench ends, if nothing ends it before.
    pub(crate) until: u64,
    /// Commands and their times.
    pub(crate) commands: VecDeque<(u64, Command)>,
    /// Bytes on the line that no host has sent, and their times.
    pub(crate) noise: VecDeque<(u64, u8)>,
    pub(crate) host: Option<Host<'b>>,
    pub(crate) replies: VecDeque<u8>,
    /// All bytes that the device has sent.
    pub(crate) sent: Vec<u8>,
    pub(crate) news: Vec<News>,
    /// Receives all news; true ends the bench.
    pub(crate) watch: Box<dyn FnMut(&News) -> bool + 'b>,
}

impl<'b> Board<'b> {
    pub(crate) fn new(until: u64, watch: impl FnMut(&News) -> bool + 'b) -> Self {
        Self {
            now: 0,
            until,
            commands: VecDeque::new(),
            noise: VecDeque::new(),
            host: None,
            replies: VecDeque::new(),
            sent: Vec::new(),
            news: Vec::new(),
            watch: Box::new(watch),
        }
    }

    /// Serves with the simulated scanner.
    pub(crate) fn serve(&mut self, world: &World, flash: &mut Flash) {
        let mut memory = [0.0; MEMORY_WORDS];
        serve::<_, _, Model>(world.station(), flash, &mut memory, self);
    }

    pub(crate) fn ends(&self) -> Vec<End> {
        let end = |news: &News| match news {
            News::End(end) => Some(*end),
            _ => None,
        };
        self.news.iter().filter_map(end).collect()
    }

    /// The number of readings that were taken and kept.
    pub(crate) fn reads(&self) -> usize {
        let is_read = |news: &&News| matches!(news, News::Read { .. });
        self.news.iter().filter(is_read).count()
    }
}

impl Platform for Board<'_> {
    fn elapsed(&mut self) -> u32 {
        self.now += ROUND;
        if self.now >= self.until {
            std::panic::resume_unwind(Box::new(Over));
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
            self.replies.extend(host.hear(byte));
        }
        true
    }

    fn command(&mut self) -> Option<Command> {
        let (at, command) = self.commands.front().copied()?;
        (at <= self.now).then(|| self.commands.pop_front())?;
        Some(command)
    }

    fn remember(&mut self, _: Option<[i32; 4]>) {}

    fn tell(&mut self, news: News) {
        self.news.push(news);
        if (self.watch)(&news) {
            std::panic::resume_unwind(Box::new(Over));
        }
    }

    fn finished(&mut self, _: Residual, _: &mut dyn Iterator<Item = f32>) {}
}

/// Counts of [`Counter`] in the dark, and those above them of the white tile.
pub(crate) const DARK: u16 = 1000;
pub(crate) const WHITE: u16 = 100;
/// A count of a lit sample that is dark gray, and one that is less than nothing.
pub(crate) const GRAY: u16 = DARK + 30;
pub(crate) const BAD: u16 = 0;

/// A sensor whose counts a test chooses while the lamp is on; None: the converter fails.
pub(crate) struct Counter<'c> {
    pub(crate) is_lit: &'c Cell<bool>,
    pub(crate) lit: &'c mut dyn FnMut() -> Option<u16>,
}

/// The converter has failed.
pub(crate) struct ConverterFailed;

impl Sensor for Counter<'_> {
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

/// Its lamp.
pub(crate) struct Bulb<'c>(pub(crate) &'c Cell<bool>);

impl ErrorType for Bulb<'_> {
    type Error = Infallible;
}

impl OutputPin for Bulb<'_> {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.set(false);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.set(true);
        Ok(())
    }
}

/// The simulated arms with another sensor, read once for each reading.
pub(crate) fn counting<'c>(
    world: &'c World,
    is_lit: &'c Cell<bool>,
    lit: &'c mut dyn FnMut() -> Option<u16>,
) -> Station<StepPin<'c>, DirectionPin<'c>, Switch<'c>, Counter<'c>, Bulb<'c>> {
    let normal = [0.0, 0.0, 1.0];
    let white = White {
        counts: [WHITE.into(); 3],
        reflectance: [1.0; 3],
        at: Directions {
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
        arms_settle: 20_000,
        lamp_settles: 5_000,
    };
    let photometer = Photometer::new(Counter { is_lit, lit }, Bulb(is_lit), white, 1);
    Station::new(world.goniometer(), photometer, settings)
}

/// Boots the firmware, which serves by [`PHONG`] until the bench ends.
pub(crate) fn serve<A: Sensor, L: OutputPin, K: Fitter>(
    station: Station<StepPin<'_>, DirectionPin<'_>, Switch<'_>, A, L>,
    flash: &mut Flash,
    memory: &mut [f32],
    board: &mut Board<'_>,
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
        Err(over) if over.is::<Over>() => {}
        Err(panic) => std::panic::resume_unwind(panic),
    }
    *flash = scanner.flash;
}

/// Scans one material by any recipe, without a host, from a command on. The flash is new and has room for 100 samples.
pub(crate) fn scan_once<A: Sensor, L: OutputPin>(
    station: Station<StepPin<'_>, DirectionPin<'_>, Switch<'_>, A, L>,
    recipe: &[u8],
    board: &mut Board<'_>,
) -> End {
    let bytes = SECTOR as u32;
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
    scanner.scan::<Model>(recipe, &mut memory, driver::Host::Absent, Start::Now, board)
}

pub(crate) fn is_finished(news: &News) -> bool {
    matches!(news, News::End(End::Finished))
}

/// The first positions of the arms.
pub(crate) const POSITIONS: [i32; 4] = [300, 500, 40, 700];

pub(crate) fn world() -> World {
    World::new(POSITIONS)
}
