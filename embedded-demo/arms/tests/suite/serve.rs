//! The firmware as it runs on a board, scan after scan: a button, a line with a host or with noise
//! on it, and the simulated scanner.

use std::cell::Cell;
use std::collections::VecDeque;
use std::convert::Infallible;

use crate::support::{BUFFER_BYTES, Flash, mount_readings, mount_recipes};
use embedded_hal::digital::{ErrorType, OutputPin};
use glimpse_arms::Memory;
use glimpse_arms::scanner::{End, News, Platform, Scanner, ScannerError};
use glimpse_arms::sensor::{Photometer, Sensor, White};
use glimpse_arms::simulated::{DirectionPin, StepPin, Switch, World};
use glimpse_arms::station::{self, Station};
use glimpse_core::fit::Fitter;
use glimpse_core::geometry::Directions;
use glimpse_core::gonio::{Footprint, Limits, Machine, Speeds};
use glimpse_core::link::{
    BYTES_PER_FRAME, FRAME_BYTES, Failure, PROTOCOL, Received, Reply, Request, Server,
};
use glimpse_core::model::Phong;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{self, ReadingError, Residual};

static PHONG: &[u8] = include_bytes!("../../../../trainer/recipes/phong-n8.recipe");
static COOK_TORRANCE: &[u8] = include_bytes!("../../../../trainer/recipes/cook-torrance-n8.recipe");

/// Microseconds that each round takes.
const ROUND: u64 = 40;
const SECOND: u64 = 1_000_000;

/// A host's answer to a request; None: it is silent.
type Answer<'b> = Box<dyn FnMut(&Request) -> Option<Reply> + 'b>;

/// A host that answers requests, or is silent.
struct Host<'b> {
    answerer: Server,
    answer: Answer<'b>,
    requests: Vec<Request>,
}

impl<'b> Host<'b> {
    fn new(answer: impl FnMut(&Request) -> Option<Reply> + 'b) -> Self {
        Self {
            answerer: Server::new(),
            answer: Box::new(answer),
            requests: Vec::new(),
        }
    }

    fn count(&self, is_counted: impl Fn(&Request) -> bool) -> usize {
        let counted = self.requests.iter().filter(|request| is_counted(request));
        counted.count()
    }

    /// Takes a byte. Returns the bytes of the answer, if it ended a request.
    fn hear(&mut self, byte: u8) -> Vec<u8> {
        let reply = match self.answerer.receive(byte) {
            Some(Ok(Received::New(request))) => {
                self.requests.push(request.clone());
                (self.answer)(&request)
            }
            Some(Ok(Received::Duplicate(reply))) => Some(reply),
            _ => None,
        };
        let mut buffer = [0; FRAME_BYTES];
        let frame = reply.map(|reply| self.answerer.answer(reply, &mut buffer).unwrap().to_vec());
        frame.unwrap_or_default()
    }
}

/// The reply with the part of a recipe from there on.
fn part(recipe: &[u8], offset: u32) -> Reply {
    let part = recipe[offset as usize..].chunks(BYTES_PER_FRAME).next();
    let bytes = part.unwrap().iter().copied().collect();
    Reply::RecipePart { offset, bytes }
}

/// The reply of a host that listens and offers a recipe, or none.
fn answer(request: &Request, offered: Option<(&[u8], u32)>) -> Reply {
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

fn checksum_of(recipe: &[u8]) -> u32 {
    Recipe::parse(recipe).unwrap().checksum()
}

/// The end of a bench.
struct Over;

/// A board on a bench.
struct Board<'b> {
    /// Microseconds since it was started.
    now: u64,
    /// The time at which the bench ends, if nothing ends it before.
    until: u64,
    /// Times at which the button is pressed.
    presses: VecDeque<u64>,
    /// Bytes on the line that no host has sent, and their times.
    noise: VecDeque<(u64, u8)>,
    host: Option<Host<'b>>,
    replies: VecDeque<u8>,
    news: Vec<News>,
    /// Receives all news; true ends the bench.
    watch: Box<dyn FnMut(&News) -> bool + 'b>,
}

impl<'b> Board<'b> {
    fn new(until: u64, watch: impl FnMut(&News) -> bool + 'b) -> Self {
        Self {
            now: 0,
            until,
            presses: VecDeque::new(),
            noise: VecDeque::new(),
            host: None,
            replies: VecDeque::new(),
            news: Vec::new(),
            watch: Box::new(watch),
        }
    }

    /// Serves with the simulated scanner.
    fn serve(&mut self, world: &World, flash: &mut Flash) {
        serve(world.station(), flash, &mut Memory::new(), self);
    }

    fn ends(&self) -> Vec<End> {
        let end = |news: &News| match news {
            News::End(end) => Some(*end),
            _ => None,
        };
        self.news.iter().filter_map(end).collect()
    }

    /// The number of readings that were taken and kept.
    fn reads(&self) -> usize {
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

/// A sensor whose counts a test chooses while the lamp is on.
struct Counter<'c> {
    is_lit: &'c Cell<bool>,
    lit: &'c mut dyn FnMut() -> u16,
}

impl Sensor for Counter<'_> {
    type Error = Infallible;

    fn read(&mut self) -> Result<[u16; 3], Infallible> {
        let count = if self.is_lit.get() {
            (self.lit)()
        } else {
            DARK
        };
        Ok([count; 3])
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

/// Boots the firmware, which serves by [`PHONG`] until the bench ends.
fn serve<A: Sensor, L: OutputPin, K: Fitter, const CAPACITY: usize>(
    station: Station<StepPin<'_>, DirectionPin<'_>, Switch<'_>, A, L>,
    flash: &mut Flash,
    memory: &mut scan::Memory<K, CAPACITY>,
    board: &mut Board<'_>,
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

/// The first positions of the arms.
const POSITIONS: [i32; 4] = [300, 500, 40, 700];

fn world() -> World {
    World::new(POSITIONS)
}

/// The cable is pulled in the middle of a recipe, before anybody has pressed the button.
#[test]
fn a_host_that_falls_silent_moves_no_motor() {
    let world = world();
    let mut parts = 0;
    let mut board = Board::new(10 * SECOND, |_| false);
    board.host = Some(Host::new(|request| {
        parts += u32::from(matches!(request, Request::RecipePart { .. }));
        let offered = (COOK_TORRANCE, checksum_of(COOK_TORRANCE));
        (parts <= 2).then(|| answer(request, Some(offered)))
    }));
    board.serve(&world, &mut Flash::new(6));
    assert_eq!(world.positions(), POSITIONS, "{:?}", board.news);
    assert_eq!(
        board.ends().len(),
        1,
        "it reports that the host fell silent"
    );
}

/// The same in a scan that somebody has begun: it goes on alone.
#[test]
fn a_scan_under_way_goes_on_without_a_host_that_falls_silent() {
    let mut board = Board::new(600 * SECOND, is_finished);
    board.host = Some(Host::new(|request| match request {
        Request::Progress(_) => None,
        request => Some(answer(request, None)),
    }));
    board.presses.push_back(SECOND);
    board.serve(&world(), &mut Flash::new(6));
    assert_eq!(board.ends().last(), Some(&End::Finished));
    assert_eq!(board.reads(), 8, "nothing is read twice");
}

/// One byte of noise, long before the press, is not a host.
#[test]
fn noise_on_the_line_leaves_the_button_alone() {
    let mut board = Board::new(600 * SECOND, is_finished);
    board.noise.push_back((SECOND, 0x55));
    board.presses.push_back(10 * SECOND);
    board.serve(&world(), &mut Flash::new(6));
    assert_eq!(board.ends(), [End::Alone, End::Finished]);
}

/// Serves a button that is pressed for each of some scans, with a sensor that counts `lit(n)` for the nth
/// reading. Returns the number of readings too.
fn scan_counting(scans: u64, lit: impl Fn(u32) -> u16) -> (Board<'static>, u32) {
    let mut ends = 0;
    let mut board = Board::new(600 * SECOND, move |news| {
        ends += u64::from(matches!(news, News::End(End::Failed(_) | End::Finished)));
        ends == scans
    });
    board.presses = (0..scans).map(|scan| 300 * scan * SECOND).collect();
    let (world, is_lit) = (world(), Cell::new(false));
    let mut taken = 0;
    let mut count = || {
        taken += 1;
        lit(taken)
    };
    let station = counting(&world, &is_lit, &mut count);
    serve(station, &mut Flash::new(6), &mut Memory::new(), &mut board);
    (board, taken)
}

/// A reading that is less than nothing is taken again, and the scan goes on. Attempts count for one
/// sample, though the driver receives good readings only once the arms are home.
#[test]
fn an_impossible_reading_is_taken_again() {
    for bad in [&[3][..], &[2, 3, 5]] {
        let (board, taken) =
            scan_counting(1, |taken| if bad.contains(&taken) { BAD } else { GREY });
        assert_eq!(board.ends(), [End::Alone, End::Finished]);
        assert_eq!((board.reads(), taken as usize), (8, 8 + bad.len()));
    }
}

/// After three attempts at the same sample the scan is given up, by the name of the fault.
#[test]
fn an_impossible_reading_ends_the_scan_after_three_attempts() {
    let (board, taken) = scan_counting(1, |taken| if taken < 3 { GREY } else { BAD });
    let Some(End::Failed(ScannerError::Scan(Failure::Reading { error, .. }))) = board.ends().pop()
    else {
        panic!("{:?}", board.news);
    };
    assert_eq!(error, ReadingError::Negative(0));
    assert_eq!(taken, 2 + 3);
}

/// Raw counts in place of a BRDF: the fit refuses them, and nobody fits them again.
#[test]
fn readings_that_cannot_be_fitted_are_forgotten() {
    let large = DARK + 110 * WHITE;
    let (board, _) = scan_counting(2, |taken| if taken <= 8 { large } else { GREY });
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

/// A board on which an arm hangs in the sixth reading of the first scan; after the scan's failure it is free.
/// The bench ends by `ends`.
fn hanging(world: &World, ends: fn(&News) -> bool) -> Board<'_> {
    let mut count = 0;
    let mut board = Board::new(600 * SECOND, move |news| {
        count += u32::from(matches!(news, News::Read { .. }));
        match news {
            News::Read { .. } if count == 6 => world.stall(2, u32::MAX),
            News::End(End::Failed(_)) => world.place(POSITIONS),
            _ => {}
        }
        ends(news)
    });
    board.presses.push_back(0);
    board
}

/// A scan that the machine has spoilt goes on after a reset, with the readings that were confirmed.
#[test]
fn after_a_failure_of_the_machine_a_reset_goes_on() {
    let (world, mut flash) = (world(), Flash::new(6));
    let mut board = hanging(&world, |news| matches!(news, News::End(End::Failed(_))));
    board.serve(&world, &mut flash);
    let failed = board.ends().pop();
    let Some(End::Failed(ScannerError::Station(_) | ScannerError::LostSteps(_))) = failed else {
        panic!("{:?}", board.news);
    };
    let mut board = Board::new(600 * SECOND, is_finished);
    board.serve(&world, &mut flash);
    assert_eq!(board.ends().last(), Some(&End::Finished));
    assert_eq!(
        board.reads(),
        4,
        "those that the arm has spoilt, and no other"
    );
}

/// But the button starts over: another material may lie there.
#[test]
fn the_button_starts_a_scan_over() {
    let world = world();
    let mut board = hanging(&world, is_finished);
    board.presses.push_back(300 * SECOND);
    board.serve(&world, &mut Flash::new(6));
    assert_eq!(board.ends().last(), Some(&End::Finished));
    let is_failed = |news: &News| matches!(news, News::End(End::Failed(_)));
    let mut scans = board.news.split(is_failed);
    let reads = |scan: &[News]| {
        let reads = scan.iter().filter(|news| matches!(news, News::Read { .. }));
        reads.count()
    };
    let (_, second) = (scans.next(), scans.next());
    assert_eq!(second.map(reads), Some(8));
    assert_eq!(scans.count(), 0, "no other failure");
}

/// Boots a firmware with a host that offers a recipe, for twenty seconds. Returns the host.
fn offer<K: Fitter, const CAPACITY: usize>(
    recipe: &[u8],
    checksum: u32,
    memory: &mut scan::Memory<K, CAPACITY>,
    flash: &mut Flash,
) -> Vec<Request> {
    let mut board = Board::new(20 * SECOND, |_| false);
    board.host = Some(Host::new(|request| {
        Some(answer(request, Some((recipe, checksum))))
    }));
    serve(world().station(), flash, memory, &mut board);
    let host = board.host.unwrap();
    let greetings = host.count(|request| matches!(request, Request::Hello { .. }));
    assert!(greetings > 3, "it greets again from time to time");
    host.requests
}

fn in_force(flash: &mut Flash) -> Option<Vec<u8>> {
    let recipes = mount_recipes(flash);
    let mut buffer = [0; BUFFER_BYTES];
    let found = recipes.load(flash, &mut buffer).unwrap();
    found.map(<[u8]>::to_vec)
}

/// A whole recipe, but of a model that the firmware lacks: it is fetched once, and the old one stays.
#[test]
fn a_recipe_that_cannot_be_used_is_fetched_once_and_not_put_in_force() {
    let mut flash = Flash::new(6);
    // Only for Phong, with eight samples at most.
    let mut memory = scan::Memory::<Phong, 8>::new();
    let checksum = checksum_of(COOK_TORRANCE);
    let requests = offer(COOK_TORRANCE, checksum, &mut memory, &mut flash);
    let is_part = |request: &&Request| matches!(request, Request::RecipePart { .. });
    let fetched: Vec<_> = requests
        .into_iter()
        .filter(|request| is_part(&request))
        .collect();
    let parts = (0..COOK_TORRANCE.len() as u32).step_by(BYTES_PER_FRAME);
    let once: Vec<_> = parts.map(|offset| Request::RecipePart { offset }).collect();
    assert_eq!(fetched, once);
    assert_eq!(in_force(&mut flash), None);
}

/// The bytes are damaged, or those of another recipe than was offered.
#[test]
fn a_damaged_recipe_is_fetched_once() {
    for at in [40, 8] {
        let mut damaged = PHONG.to_vec();
        damaged[at] ^= 1;
        let mut flash = Flash::new(6);
        let requests = offer(&damaged, 0x1234_5678, &mut Memory::new(), &mut flash);
        let first = Request::RecipePart { offset: 0 };
        let fetched = requests.iter().filter(|request| **request == first);
        assert_eq!(fetched.count(), 1);
        assert_eq!(in_force(&mut flash), None);
    }
}
