//! The firmware as it runs on a board, scan after scan: a button, a line with a host or with noise
//! on it, and the simulated scanner.

#[allow(dead_code)] // here no power goes
mod support;

use std::cell::Cell;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::ops::Range;

use embedded_hal::digital::{ErrorType, OutputPin};
use glimpse_arms::Memory;
use glimpse_arms::scanner::{End, News, Platform, Scanner, ScannerError};
use glimpse_arms::sensor::{Photometer, Sensor, White};
use glimpse_arms::simulated::{DirectionPin, StepPin, Switch, World};
use glimpse_arms::station::{self, Station};
use glimpse_arms::store::readings::Readings;
use glimpse_arms::store::recipes::Recipes;
use glimpse_core::fit::Fitter;
use glimpse_core::geometry::Directions;
use glimpse_core::gonio::{Footprint, Limits, Machine, Speeds};
use glimpse_core::link::{
    Answerer, BYTES_PER_FRAME, FRAME_BYTES, Failure, PROTOCOL, Received, Reply, Request,
};
use glimpse_core::model::Phong;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{self, ReadingError, Residual};
use support::{Flash, SECTOR};

static PHONG: &[u8] = include_bytes!("../../../trainer/recipes/phong-n8.recipe");
static COOK_TORRANCE: &[u8] = include_bytes!("../../../trainer/recipes/cook-torrance-n8.recipe");

/// Microseconds that each round takes.
const ROUND: u64 = 40;
const SECOND: u64 = 1_000_000;
const BUFFER_BYTES: usize = 2 * SECTOR;

const fn sectors(range: Range<u32>) -> Range<u32> {
    range.start * SECTOR as u32..range.end * SECTOR as u32
}

fn mount_readings(flash: &mut Flash) -> Readings {
    Readings::mount(flash, [sectors(0..1), sectors(1..2)]).unwrap()
}

fn mount_recipes(flash: &mut Flash) -> Recipes {
    let mut buffer = [0; BUFFER_BYTES];
    Recipes::mount(flash, [sectors(2..4), sectors(4..6)], &mut buffer).unwrap()
}

/// A host that answers what it is asked, or says nothing.
struct Host<'h> {
    answerer: Answerer,
    answer: &'h mut dyn FnMut(&Request) -> Option<Reply>,
    requests: Vec<Request>,
}

impl<'h> Host<'h> {
    fn new(answer: &'h mut dyn FnMut(&Request) -> Option<Reply>) -> Self {
        Self {
            answerer: Answerer::new(),
            answer,
            requests: Vec::new(),
        }
    }

    /// Takes a byte; the bytes of the answer, if it ended a request.
    fn hear(&mut self, byte: u8) -> Vec<u8> {
        let reply = match self.answerer.receive(byte) {
            Some(Ok(Received::New(request))) => {
                self.requests.push(request.clone());
                (self.answer)(&request)
            }
            Some(Ok(Received::Again(reply))) => Some(reply),
            _ => None,
        };
        let mut buffer = [0; FRAME_BYTES];
        let frame = reply.map(|reply| self.answerer.answer(reply, &mut buffer).unwrap().to_vec());
        frame.unwrap_or_default()
    }
}

/// What a host answers that listens, and has this recipe if it has one.
fn answer(request: &Request, recipe: Option<&[u8]>) -> Reply {
    match (request, recipe) {
        (Request::Hello { .. }, _) => Reply::Welcome { protocol: PROTOCOL },
        (Request::Update, Some(recipe)) => Reply::Recipe {
            bytes: recipe.len() as u32,
            checksum: Recipe::parse(recipe).unwrap().checksum(),
        },
        (Request::RecipePart { offset }, Some(recipe)) => {
            let part = recipe[*offset as usize..].chunks(BYTES_PER_FRAME).next();
            Reply::RecipePart {
                offset: *offset,
                bytes: part.unwrap().iter().copied().collect(),
            }
        }
        _ => Reply::Accepted,
    }
}

/// The bench has seen enough.
struct Over;

/// A board on a bench.
struct Board<'b, 'h> {
    /// Microseconds since it was started.
    now: u64,
    /// When the bench ends, if nothing ends it before.
    until: u64,
    /// When the button is pressed.
    presses: VecDeque<u64>,
    /// Bytes on the line that no host has sent, and when.
    noise: VecDeque<(u64, u8)>,
    host: Option<Host<'h>>,
    replies: VecDeque<u8>,
    news: Vec<News>,
    /// Is told everything; true ends the bench.
    watch: &'b mut dyn FnMut(&News) -> bool,
}

impl<'b, 'h> Board<'b, 'h> {
    fn new(until: u64, watch: &'b mut dyn FnMut(&News) -> bool) -> Self {
        Self {
            now: 0,
            until,
            presses: VecDeque::new(),
            noise: VecDeque::new(),
            host: None,
            replies: VecDeque::new(),
            news: Vec::new(),
            watch,
        }
    }

    fn ends(&self) -> Vec<End> {
        let end = |news: &News| match news {
            News::End(end) => Some(*end),
            _ => None,
        };
        self.news.iter().filter_map(end).collect()
    }

    /// How many readings were taken and kept.
    fn reads(&self) -> usize {
        let is_read = |news: &&News| matches!(news, News::Read { .. });
        self.news.iter().filter(is_read).count()
    }
}

impl Platform for Board<'_, '_> {
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
        if let Some(host) = &mut self.host {
            self.replies.extend(host.hear(byte));
        }
        true
    }

    fn is_started(&mut self) -> bool {
        let is_due = self.presses.front().is_some_and(|at| *at <= self.now);
        is_due && self.presses.pop_front().is_some()
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
const DARK: u16 = 1000;
const WHITE: u16 = 100;
/// A count of a lit sample that is dark grey, and one that is less than nothing.
const GREY: u16 = DARK + 30;
const BAD: u16 = 0;

/// A sensor that counts what a test likes while the lamp is on.
struct Counter<'c> {
    is_lit: &'c Cell<bool>,
    lit: &'c mut dyn FnMut() -> u16,
}

impl Sensor for Counter<'_> {
    type Error = Infallible;

    fn read(&mut self) -> Result<[u16; 3], Infallible> {
        Ok([if self.is_lit.get() {
            (self.lit)()
        } else {
            DARK
        }; 3])
    }
}

/// Its lamp.
struct Bulb<'c>(&'c Cell<bool>);

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
fn counting<'c>(
    world: &'c World,
    is_lit: &'c Cell<bool>,
    lit: &'c mut dyn FnMut() -> u16,
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

/// Boots the firmware, which serves by [`PHONG`] until the bench has seen enough.
fn serve<A: Sensor, L: OutputPin, K: Fitter, const CAPACITY: usize>(
    station: Station<StepPin<'_>, DirectionPin<'_>, Switch<'_>, A, L>,
    flash: &mut Flash,
    memory: &mut scan::Memory<K, CAPACITY>,
    board: &mut Board<'_, '_>,
) {
    let readings = mount_readings(flash);
    let recipes = mount_recipes(flash);
    let mut scanner = Scanner {
        station,
        flash: flash.clone(),
        readings,
        recipes,
    };
    let run = std::panic::AssertUnwindSafe(|| {
        let mut buffer = [0; BUFFER_BYTES];
        scanner.serve(PHONG, &mut buffer, memory, board)
    });
    match std::panic::catch_unwind(run) {
        Err(over) if over.is::<Over>() => {}
        Err(panic) => std::panic::resume_unwind(panic),
    }
    *flash = scanner.flash;
}

fn is_finished(news: &News) -> bool {
    matches!(news, News::End(End::Finished))
}

/// The cable is pulled in the middle of a recipe, before anybody has pressed the button.
#[test]
fn a_host_that_falls_silent_moves_no_motor() {
    let positions = [300, 500, 40, 700];
    let world = World::new(positions);
    let mut parts = 0;
    let mut half = |request: &Request| {
        parts += u32::from(matches!(request, Request::RecipePart { .. }));
        (parts <= 2).then(|| answer(request, Some(COOK_TORRANCE)))
    };
    let mut watch = |_: &News| false;
    let mut board = Board::new(10 * SECOND, &mut watch);
    board.host = Some(Host::new(&mut half));
    let mut flash = Flash::new(6);
    serve(world.station(), &mut flash, &mut Memory::new(), &mut board);
    assert_eq!(world.positions(), positions, "{:?}", board.news);
    assert_eq!(board.ends().len(), 1, "it tells that the host fell silent");
}

/// The same in a scan that somebody has begun: it goes on alone.
#[test]
fn a_scan_under_way_goes_on_without_a_host_that_falls_silent() {
    let world = World::new([300, 500, 40, 700]);
    let mut greets_only = |request: &Request| match request {
        Request::Progress(_) => None,
        request => Some(answer(request, None)),
    };
    let mut watch = is_finished;
    let mut board = Board::new(600 * SECOND, &mut watch);
    board.host = Some(Host::new(&mut greets_only));
    board.presses.push_back(SECOND);
    let mut flash = Flash::new(6);
    serve(world.station(), &mut flash, &mut Memory::new(), &mut board);
    assert_eq!(board.ends().last(), Some(&End::Finished));
    assert_eq!(board.reads(), 8, "nothing is read twice");
}

/// One byte of noise, long before the press, is no host.
#[test]
fn noise_on_the_line_leaves_the_button_alone() {
    let world = World::new([300, 500, 40, 700]);
    let mut watch = is_finished;
    let mut board = Board::new(600 * SECOND, &mut watch);
    board.noise.push_back((SECOND, 0x55));
    board.presses.push_back(10 * SECOND);
    let mut flash = Flash::new(6);
    serve(world.station(), &mut flash, &mut Memory::new(), &mut board);
    assert_eq!(board.ends(), [End::Alone, End::Finished]);
}

/// The third reading is less than nothing: it is read again, and the scan goes on.
#[test]
fn a_reading_that_cannot_be_one_is_taken_again() {
    let world = World::new([300, 500, 40, 700]);
    let is_lit = Cell::new(false);
    let mut taken = 0;
    let mut third_is_bad = || {
        taken += 1;
        if taken == 3 { BAD } else { GREY }
    };
    let mut watch = |news: &News| matches!(news, News::End(End::Finished | End::Failed(_)));
    let mut board = Board::new(600 * SECOND, &mut watch);
    board.presses.push_back(0);
    let station = counting(&world, &is_lit, &mut third_is_bad);
    serve(station, &mut Flash::new(6), &mut Memory::new(), &mut board);
    assert_eq!(board.ends(), [End::Alone, End::Finished]);
    assert_eq!((board.reads(), taken), (8, 9));
}

/// After three attempts at the same sample the scan is given up, by the name of what was wrong.
#[test]
fn a_reading_that_never_can_be_one_ends_the_scan_after_three_attempts() {
    let world = World::new([300, 500, 40, 700]);
    let is_lit = Cell::new(false);
    let mut taken = 0;
    let mut all_bad_from_the_third = || {
        taken += 1;
        if taken < 3 { GREY } else { BAD }
    };
    let mut watch = |news: &News| matches!(news, News::End(End::Finished | End::Failed(_)));
    let mut board = Board::new(600 * SECOND, &mut watch);
    board.presses.push_back(0);
    let station = counting(&world, &is_lit, &mut all_bad_from_the_third);
    serve(station, &mut Flash::new(6), &mut Memory::new(), &mut board);
    let Some(End::Failed(ScannerError::Scan(Failure::Reading { error, .. }))) = board.ends().pop()
    else {
        panic!("{:?}", board.news);
    };
    assert_eq!(error, ReadingError::Negative(0));
    assert_eq!(taken, 2 + 3);
}

/// Attempts count for one sample, though the driver hears of good readings only once the arms are
/// home.
#[test]
fn attempts_at_one_sample_do_not_count_for_the_next() {
    let world = World::new([300, 500, 40, 700]);
    let is_lit = Cell::new(false);
    let mut taken = 0;
    let mut twice_and_once = || {
        taken += 1;
        if [2, 3, 5].contains(&taken) {
            BAD
        } else {
            GREY
        }
    };
    let mut watch = |news: &News| matches!(news, News::End(End::Finished | End::Failed(_)));
    let mut board = Board::new(600 * SECOND, &mut watch);
    board.presses.push_back(0);
    let station = counting(&world, &is_lit, &mut twice_and_once);
    serve(station, &mut Flash::new(6), &mut Memory::new(), &mut board);
    assert_eq!(board.ends(), [End::Alone, End::Finished]);
    assert_eq!(taken, 8 + 3);
}

/// Raw counts in place of a BRDF: the fit refuses them, and nobody fits them again.
#[test]
fn readings_that_cannot_be_fitted_are_forgotten() {
    let world = World::new([300, 500, 40, 700]);
    let is_lit = Cell::new(false);
    let mut taken = 0;
    let mut eight_too_large = || {
        taken += 1;
        if taken <= 8 { DARK + 110 * WHITE } else { GREY }
    };
    let mut ends = 0;
    let mut watch = |news: &News| {
        ends += u32::from(matches!(news, News::End(End::Failed(_) | End::Finished)));
        ends == 2
    };
    let mut board = Board::new(600 * SECOND, &mut watch);
    board.presses.extend([0, 300 * SECOND]);
    let station = counting(&world, &is_lit, &mut eight_too_large);
    let mut flash = Flash::new(6);
    serve(station, &mut flash, &mut Memory::new(), &mut board);
    let [
        End::Alone,
        End::Failed(ScannerError::Scan(Failure::Fit(_))),
        End::Alone,
        End::Finished,
    ] = board.ends()[..]
    else {
        panic!("{:?}", board.news);
    };
    assert_eq!(board.reads(), 16);
}

/// An arm hangs in the sixth reading of a scan, which is given up: its flash.
fn hang(world: &World) -> Flash {
    let mut count = 0;
    let mut watch = |news: &News| {
        count += u32::from(matches!(news, News::Read { .. }));
        if count == 6 {
            world.stall(2, u32::MAX);
        }
        matches!(news, News::End(End::Failed(_)))
    };
    let mut board = Board::new(600 * SECOND, &mut watch);
    board.presses.push_back(0);
    let mut flash = Flash::new(6);
    serve(world.station(), &mut flash, &mut Memory::new(), &mut board);
    let Some(End::Failed(ScannerError::Station(_) | ScannerError::LostSteps(_))) =
        board.ends().pop()
    else {
        panic!("{:?}", board.news);
    };
    world.place([300, 500, 40, 700]);
    flash
}

/// A scan that the machine has spoilt goes on after a reset, with what was read and confirmed.
#[test]
fn after_a_failure_of_the_machine_a_reset_goes_on() {
    let world = World::new([300, 500, 40, 700]);
    let mut flash = hang(&world);
    let mut watch = is_finished;
    let mut board = Board::new(600 * SECOND, &mut watch);
    serve(world.station(), &mut flash, &mut Memory::new(), &mut board);
    assert_eq!(board.ends().last(), Some(&End::Finished));
    assert_eq!(board.reads(), 4, "what the arm has spoilt, and no other");
}

/// But the button begins anew: another material may lie there.
#[test]
fn the_button_begins_a_scan_anew() {
    let world = World::new([300, 500, 40, 700]);
    let mut failures = 0;
    let (mut count, mut after) = (0, 0);
    let mut watch = |news: &News| {
        match news {
            News::Read { .. } if failures == 0 => count += 1,
            News::Read { .. } => after += 1,
            News::End(End::Failed(_)) => {
                failures += 1;
                world.place([300, 500, 40, 700]);
            }
            _ => {}
        }
        if count == 6 && failures == 0 {
            world.stall(2, u32::MAX);
        }
        is_finished(news)
    };
    let mut board = Board::new(600 * SECOND, &mut watch);
    board.presses.extend([0, 300 * SECOND]);
    let mut flash = Flash::new(6);
    serve(world.station(), &mut flash, &mut Memory::new(), &mut board);
    assert_eq!(board.ends().last(), Some(&End::Finished));
    assert_eq!((failures, after), (1, 8));
}

/// Boots a firmware that fits Phong's model with eight samples at most, by a host that has this
/// recipe, for twenty seconds: how often each of the recipe's parts was asked for.
fn offer(recipe: &[u8], flash: &mut Flash) -> Vec<usize> {
    let world = World::new([300, 500, 40, 700]);
    let mut all = |request: &Request| Some(answer(request, Some(recipe)));
    let mut watch = |_: &News| false;
    let mut board = Board::new(20 * SECOND, &mut watch);
    board.host = Some(Host::new(&mut all));
    let mut memory = scan::Memory::<Phong, 8>::new();
    serve(world.station(), flash, &mut memory, &mut board);
    let requests = board.host.unwrap().requests;
    let hellos = requests
        .iter()
        .filter(|request| matches!(request, Request::Hello { .. }));
    assert!(hellos.count() > 3, "it greets anew from time to time");
    let parts = (0..recipe.len()).step_by(BYTES_PER_FRAME);
    let asked = |at| Request::RecipePart { offset: at as u32 };
    parts
        .map(|at| {
            requests
                .iter()
                .filter(|request| **request == asked(at))
                .count()
        })
        .collect()
}

fn in_force(flash: &mut Flash) -> Option<Vec<u8>> {
    let recipes = mount_recipes(flash);
    let mut buffer = [0; BUFFER_BYTES];
    recipes
        .load(flash, &mut buffer)
        .unwrap()
        .map(<[u8]>::to_vec)
}

/// A whole recipe, but of a model that the firmware has not: it is fetched once, and the old one
/// stays.
#[test]
fn a_recipe_that_cannot_be_used_is_fetched_once_and_not_put_in_force() {
    let mut flash = Flash::new(6);
    let asked = offer(COOK_TORRANCE, &mut flash);
    assert!(asked.iter().all(|&times| times == 1), "{asked:?}");
    assert_eq!(in_force(&mut flash), None);
}

/// What comes is damaged, or is another recipe than was offered.
#[test]
fn a_damaged_recipe_is_fetched_once() {
    for at in [40, 8] {
        let mut damaged = PHONG.to_vec();
        damaged[at] ^= 1;
        let world = World::new([300, 500, 40, 700]);
        let mut all = |request: &Request| match (request, answer(request, Some(PHONG))) {
            (Request::Update, _) => Some(Reply::Recipe {
                bytes: damaged.len() as u32,
                checksum: 0x1234_5678,
            }),
            (Request::RecipePart { .. }, Reply::RecipePart { offset, .. }) => {
                let part = damaged[offset as usize..].chunks(BYTES_PER_FRAME).next();
                let bytes = part.unwrap().iter().copied().collect();
                Some(Reply::RecipePart { offset, bytes })
            }
            (_, reply) => Some(reply),
        };
        let mut watch = |_: &News| false;
        let mut board = Board::new(20 * SECOND, &mut watch);
        board.host = Some(Host::new(&mut all));
        let mut flash = Flash::new(6);
        serve(world.station(), &mut flash, &mut Memory::new(), &mut board);
        let first = Request::RecipePart { offset: 0 };
        let requests = &board.host.as_ref().unwrap().requests;
        let fetched = requests.iter().filter(|request| **request == first);
        assert_eq!(fetched.count(), 1);
        assert_eq!(in_force(&mut flash), None);
    }
}
