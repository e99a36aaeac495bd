//! Random histories of a device, its host, its flash and its firmware, against a reference model.
//!
//! A history interleaves replies, silence, refusals, and restarts of the host with readings, skips, faults,
//! commands and resets of the firmware; `store.rs` cuts the power in each write. [`Reference`] states what must hold after
//! each event. At the end, host and firmware behave well, and the scan must finish with the bits of a separate
//! fit of its readings.

use std::collections::{BTreeMap, BTreeSet};

use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::gonio::{Limits, Machine, Reading};
use glimpse_core::link::{FRAME_BYTES, HostEnd, PROTOCOL, Purpose, Received, Reply, Request};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Scan;
use glimpse_core::store::{Layout, Store};

use super::bench::{AnyDriver, fitted_bits};
use crate::documents::recovery::common::flash::Flash;
use crate::random::Random;
use crate::recipes::{Contents, tolerant};
use crate::scanning::{Any, fit, new_scan, recipe_for};

/// Number of histories.
const HISTORIES: u64 = 3_000;
/// Number of events of a history.
const EVENTS: usize = 300;
/// Number of polls within which a scan must finish at the end.
const MAX_POLLS: usize = 20_000;

type Readings = BTreeMap<u16, Reading>;

/// A valid reading. Some are below the smallest value that a fit accepts, some are saturated.
fn valid_reading(random: &mut Random) -> Reading {
    let base = match random.bits() % 8 {
        0 => -0.9,
        _ => 0.2,
    };
    Reading {
        brdf: [base, 0.3, 0.4].map(|channel| channel + 0.1 * random.number()),
        saturated: random.bits().is_multiple_of(10),
    }
}

fn invalid_reading(random: &mut Random) -> Reading {
    let value = [f32::NAN, f32::INFINITY, -2.0][(random.bits() % 3) as usize];
    Reading::new([0.1, value, 0.1])
}

/// The next behavior of the host.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Mood {
    #[default]
    Good,
    Silent,
    Refuses(ErrorCode),
    OtherProtocol,
    /// Replies `Skip`, or `FinishEarly` for sample 0.
    Skips,
    InvalidReadings,
}

/// A host with its memory of the readings that it gave.
#[derive(Default)]
struct Computer {
    end: HostEnd,
    /// The last request.
    request: Option<Request>,
    mood: Mood,
    given: Readings,
    /// All readings that it ever sent.
    sent: Vec<(u16, Reading)>,
    /// Samples that it skipped, could not reach, or read wrongly, since the last hello.
    skips: BTreeSet<u16>,
    finishes_early: bool,
    refused_saved: bool,
    accepted_finish: bool,
    /// Number of `Measure` requests that it carried out.
    moves: usize,
}

impl Computer {
    /// Replies to the last request, if it is not silent.
    fn reply(&mut self, random: &mut Random) -> Option<Reply> {
        let request = &self.request.clone()?;
        if let Request::Hello { .. } = request {
            self.skips.clear();
            self.finishes_early = false;
            self.refused_saved = false;
            self.accepted_finish = false;
        }
        match (self.mood, request) {
            (Mood::Silent, _) => return None,
            (Mood::Refuses(refusal), _) => {
                if let Request::Measure { index, .. } = request {
                    self.skips.insert(*index);
                }
                let is_saved = matches!(request, Request::Restored { .. });
                self.refused_saved |= is_saved && refusal == ErrorCode::RefusedRestored;
                return Some(Reply::Refused(refusal));
            }
            _ => {}
        }
        Some(match request {
            Request::Hello { .. } if self.mood == Mood::OtherProtocol => Reply::Welcome {
                protocol: PROTOCOL + 1,
            },
            Request::Hello { .. } => Reply::Welcome { protocol: PROTOCOL },
            Request::Measure { index: 0, .. } if self.mood == Mood::Skips => {
                self.finishes_early = true;
                Reply::FinishEarly
            }
            Request::Measure { index, .. } if self.mood == Mood::Skips => {
                self.skips.insert(*index);
                Reply::Skip { index: *index }
            }
            Request::Measure { index, .. } => {
                let index = *index;
                let reading = match self.mood {
                    Mood::InvalidReadings => invalid_reading(random),
                    _ => valid_reading(random),
                };
                match reading.check(index) {
                    Ok(()) => {
                        self.given.insert(index, reading);
                        self.sent.push((index, reading));
                    }
                    Err(_) => {
                        self.skips.insert(index);
                    }
                }
                Reply::Measured { index, reading }
            }
            Request::Restored { index, reading } if self.given.get(index) != Some(reading) => {
                self.refused_saved = true;
                Reply::Refused(ErrorCode::RefusedRestored)
            }
            Request::Finished(_) => {
                self.accepted_finish = true;
                Reply::Accepted
            }
            _ => Reply::Accepted,
        })
    }
}

/// The state that the driver must have.
#[derive(Default)]
struct Reference {
    /// All readings of the scan.
    readings: Readings,
    skipped: BTreeSet<u16>,
    /// Number of invalid readings of each sample since its last valid one.
    invalid: BTreeMap<u16, u8>,
    /// True from a failure until the firmware calls `resume` or `restart`.
    is_halted: bool,
    is_finished: bool,
    /// The readings and skips in the flash.
    saved: BTreeMap<u16, Option<Reading>>,
    /// The failure that the driver has not shown yet, if it is known.
    failure: Option<Error>,
    /// Number of the host's moves when the failure occurred.
    moves_at_failure: usize,
}

struct World {
    random: Random,
    recipe: Recipe<'static>,
    config: Config,
    driver: Option<AnyDriver>,
    host: Computer,
    now: u64,
    store: Store<Flash>,
    reference: Reference,
    out_of_reach: BTreeSet<u16>,
    /// Purpose and index of the requested reading.
    asked: Option<(Purpose, u16)>,
    counts: BTreeMap<&'static str, u64>,
}

fn readings_of(scan: &Scan<'_, Any>) -> Readings {
    let samples = scan.recipe().samples() as u16;
    let reading = |index| Some((index, scan.reading(index)?));
    (0..samples).filter_map(reading).collect()
}

/// The bits of readings, which distinguish NaNs.
fn bits(readings: &Readings) -> Vec<(u16, [u32; 3], bool)> {
    let bits = |(index, reading): (&u16, &Reading)| {
        (*index, reading.brdf.map(f32::to_bits), reading.saturated)
    };
    readings.iter().map(bits).collect()
}

/// All readings and skips.
fn saved_of(scan: &Scan<'_, Any>) -> BTreeMap<u16, Option<Reading>> {
    let pending: BTreeSet<u16> = scan.pending().map(|(index, _)| index).collect();
    let all = 0..scan.recipe().samples() as u16;
    let done = all.filter(|index| !pending.contains(index));
    done.map(|index| (index, scan.reading(index))).collect()
}

fn mount(flash: Flash, recipe: &Recipe<'static>) -> Store<Flash> {
    let layout = Layout {
        start: 0,
        area_bytes: 1024,
    };
    Store::mount(flash, layout, recipe).unwrap()
}

impl World {
    fn new(seed: u64, recipes: &[Recipe<'static>]) -> Self {
        let mut random = Random(seed);
        let mut below = |bound: usize| (random.bits() % bound as u64) as usize;
        let recipe = recipes[below(recipes.len())];
        let mut config = Config::new([Host::Measures, Host::Listens, Host::Absent][below(3)]);
        config.attempts = below(4) as u8;
        config.steps_per_poll = [1, 8, 1_000][below(3)];
        config.target_loss = [None, Some(0.05), Some(1e9)][below(3)];
        if below(4) == 0 {
            config.machine = Some(Machine::new(Limits {
                max_theta_o: 0.9,
                ..Limits::NONE
            }));
        }
        let machine = config.machine;
        let is_out = |at| machine.is_some_and(|machine: Machine| machine.check(&at).is_err());
        let out_of_reach = recipe.directions().filter(|(_, at)| is_out(*at));
        Self {
            recipe,
            driver: Some(Driver::new(new_scan(recipe), config)),
            host: Computer::default(),
            now: 0,
            store: mount(Flash::new(4), &recipe),
            reference: Reference::default(),
            out_of_reach: out_of_reach.map(|(index, _)| index).collect(),
            asked: None,
            counts: BTreeMap::new(),
            random,
            config,
        }
    }

    fn below(&mut self, bound: u64) -> u64 {
        self.random.bits() % bound
    }

    fn count(&mut self, event: &'static str) {
        *self.counts.entry(event).or_default() += 1;
    }

    fn driver(&mut self) -> &mut AnyDriver {
        self.driver.as_mut().unwrap()
    }

    fn scan(&self) -> &Scan<'static, Any> {
        self.driver.as_ref().unwrap().scan()
    }

    /// Compares the scan with the reference.
    fn check(&self) {
        let (scan, reference) = (self.scan(), &self.reference);
        assert_eq!(bits(&readings_of(scan)), bits(&reference.readings));
        let pending: BTreeSet<u16> = scan.pending().map(|(index, _)| index).collect();
        let done = |index: &u16| {
            reference.readings.contains_key(index) || reference.skipped.contains(index)
        };
        let expected = (0..self.recipe.samples() as u16).filter(|index| !done(index));
        assert_eq!(pending, expected.collect());
        if reference.is_halted {
            assert_eq!(
                self.host.moves, reference.moves_at_failure,
                "a move after a failure"
            );
        }
    }

    fn halt(&mut self, failure: Option<Error>) {
        self.asked = None;
        self.reference.failure = failure;
        self.reference.is_halted = true;
        self.reference.moves_at_failure = self.host.moves;
    }

    /// Forgets the readings of the scan, but not those in the flash.
    fn clear(&mut self) {
        self.asked = None;
        self.reference.readings.clear();
        self.reference.skipped.clear();
        self.reference.invalid.clear();
        self.reference.is_finished = false;
    }

    fn event(&mut self) {
        match self.below(200) {
            0..160 => self.poll(),
            160..167 => {
                let index = self.below(3 + self.recipe.samples() as u64) as u16;
                self.record(index);
            }
            167..169 => self.skip(),
            169 => self.finish_early(),
            170 => self.fail(Error::new(ErrorCode::Machine)),
            171..177 => self.resume(),
            177 => self.restart(),
            178 => self.reset(),
            179..184 => self.now += [10, 300, 3_000, 70_000, 4_000_000][self.below(5) as usize],
            184..188 => {
                let refusals = [
                    ErrorCode::RefusedNoScan,
                    ErrorCode::RefusedDirections,
                    ErrorCode::RefusedRestored,
                    ErrorCode::RefusedModel,
                ];
                self.host.mood = match self.below(6) {
                    0 => Mood::Silent,
                    1 => Mood::Refuses(refusals[self.below(4) as usize]),
                    2 => Mood::OtherProtocol,
                    3 => Mood::Skips,
                    4 => Mood::InvalidReadings,
                    _ => Mood::Good,
                };
            }
            188..194 => self.host.mood = Mood::Good,
            194 => {
                self.host.given.clear();
                self.host.end = HostEnd::default();
            }
            _ => {}
        }
        self.check();
    }

    /// Polls once, carries out the action, and passes bytes on the line.
    fn poll(&mut self) {
        let before = readings_of(self.scan());
        let now = self.now;
        let action = self.driver().poll(now);
        self.follow(&before, &action);
        match action {
            Action::Measure {
                purpose,
                index,
                directions,
            } => {
                let reference = &self.reference;
                assert!(!reference.is_halted && !reference.is_finished);
                let is_pending = |each| each == (index, directions);
                match purpose {
                    Purpose::Sample => assert!(self.scan().pending().any(is_pending)),
                    _ => assert!(self.scan().recipe().directions().any(is_pending)),
                }
                assert!(!self.out_of_reach.contains(&index));
                self.asked = Some((purpose, index));
                if self.below(2) == 0 {
                    self.record(index);
                }
            }
            Action::Save { index, reading } => {
                assert_eq!(self.scan().reading(index), reading);
                self.store.save(index, reading, true).unwrap();
                self.reference.saved.insert(index, reading);
            }
            Action::Forget => {
                assert!(!self.reference.saved.is_empty(), "nothing was saved");
                self.count("forget");
                self.store.clear().unwrap();
                self.reference.saved.clear();
            }
            Action::Finished(residual) => {
                assert!(!self.reference.is_halted && !self.reference.is_finished);
                assert!(self.scan().next_pending().is_none());
                self.reference.is_finished = true;
                assert_eq!(self.scan().fitted().unwrap().residual(), residual);
                self.count("finished");
            }
            Action::Failed(failure) => {
                let expected = self.reference.failure.take();
                assert_eq!(failure, expected.unwrap_or(failure));
                self.halt(None);
                self.count("failed");
            }
            Action::Wait => {
                let delay = self.driver.as_ref().unwrap().poll_delay(now);
                let delay = delay.unwrap_or(0).min(100_000);
                self.now += self.below(2) * u64::from(delay);
            }
            _ => {}
        }
        self.exchange();
    }

    /// Updates the reference after a poll: the driver may have handled a reply of the host.
    fn follow(&mut self, before: &Readings, action: &Action) {
        let after = readings_of(self.scan());
        let has_lost = !before.is_empty() || !self.reference.skipped.is_empty();
        let is_cleared = has_lost && self.scan().pending().count() == self.recipe.samples();
        if is_cleared {
            let host = &self.host;
            let is_measuring = self.config.host == Host::Measures;
            let may_clear = is_measuring && (host.refused_saved || host.accepted_finish);
            assert!(may_clear, "readings were forgotten: {before:?}, {action:?}");
            self.clear();
            return;
        }
        for (index, reading) in &after {
            if before.get(index) != Some(reading) {
                let sent = (*index, *reading);
                assert!(self.host.sent.contains(&sent), "not given by the host");
                assert!(!self.reference.is_halted);
                self.reference.readings.insert(*index, *reading);
                self.reference.skipped.remove(index);
                self.reference.invalid.remove(index);
            }
        }
        self.follow_skips();
    }

    /// Adds samples that the driver has skipped to the reference. Each needs a reason.
    fn follow_skips(&mut self) {
        let pending: BTreeSet<u16> = self.scan().pending().map(|(index, _)| index).collect();
        let samples = self.recipe.samples() as u16;
        let reference = &self.reference;
        let skipped: Vec<u16> = (0..samples)
            .filter(|index| !pending.contains(index))
            .filter(|index| !reference.readings.contains_key(index))
            .filter(|index| !reference.skipped.contains(index))
            .collect();
        // A target may end a scan whose readings are the first ones, unsaturated, and none of which is skipped.
        let count = reference.readings.len() as u16;
        let is_prefix = reference.skipped.is_empty()
            && reference.readings.keys().copied().eq(0..count)
            && reference
                .readings
                .values()
                .all(|reading| !reading.saturated);
        let is_target = self.config.target_loss.is_some()
            && is_prefix
            && skipped.iter().copied().eq(count..samples);
        for index in skipped {
            let has_reason = self.out_of_reach.contains(&index)
                || self.host.skips.contains(&index)
                || self.host.finishes_early
                || is_target;
            assert!(has_reason, "sample {index} was skipped without a reason");
            self.reference.skipped.insert(index);
            self.reference.invalid.remove(&index);
        }
    }

    /// Passes some bytes to the host, and its replies back.
    fn exchange(&mut self) {
        let outgoing = self.driver().outgoing().to_vec();
        let count = match self.below(4) {
            0 => self.below(1 + outgoing.len() as u64) as usize,
            _ => outgoing.len(),
        };
        self.driver().sent(count);
        for byte in &outgoing[..count] {
            let reply = match self.host.end.receive(*byte) {
                Some(Ok(Received::New(request))) => {
                    self.host.moves += usize::from(matches!(request, Request::Measure { .. }));
                    self.host.request = Some(request);
                    self.host.reply(&mut self.random)
                }
                // The host was silent before.
                Some(Ok(Received::Pending)) => self.host.reply(&mut self.random),
                Some(Ok(Received::Duplicate(reply))) => Some(reply),
                _ => None,
            };
            if let Some(reply) = reply {
                let mut buffer = [0; FRAME_BYTES];
                let frame = self.host.end.reply(reply, &mut buffer).unwrap().to_vec();
                // One frame in ten is lost.
                if self.below(10) > 0 {
                    for byte in frame {
                        self.driver().receive(byte);
                    }
                }
            }
        }
    }

    /// Records a reading of the device's own sensor, if it has one. The pattern may have no such sample.
    fn record(&mut self, index: u16) {
        let samples = self.recipe.samples() as u16;
        if self.config.host == Host::Measures {
            return;
        }
        let reading = match self.below(4) {
            0 => invalid_reading(&mut self.random),
            _ => valid_reading(&mut self.random),
        };
        let result = self.driver().record(index, reading);
        let reference = &mut self.reference;
        if reference.is_halted || reference.is_finished {
            assert_eq!(result, Err(Error::new(ErrorCode::NotScanning)));
            return;
        }
        if index >= samples {
            let error = Error::with(ErrorCode::ReadingIndex, [index.into(), samples.into()]);
            assert_eq!(result, Err(error));
            return;
        }
        let is_check = |(purpose, asked)| purpose != Purpose::Sample && asked == index;
        let is_check = self.asked.is_some_and(is_check);
        let Err(error) = reading.check(index) else {
            assert_eq!(result, Ok(()));
            self.asked = None;
            if is_check {
                self.count("check");
                return;
            }
            reference.readings.insert(index, reading);
            reference.skipped.remove(&index);
            reference.invalid.remove(&index);
            return;
        };
        assert_eq!(result, Err(error));
        let count = reference.invalid.entry(index).or_default();
        *count += 1;
        if *count < self.config.attempts.max(1) {
            return;
        }
        reference.invalid.remove(&index);
        self.asked = None;
        if is_check || reference.readings.contains_key(&index) {
            return;
        }
        match self.recipe.tolerates_missing() {
            true => {
                reference.skipped.insert(index);
            }
            false => self.halt(Some(error)),
        }
        self.count("attempts");
    }

    fn skip(&mut self) {
        let index = self.below(self.recipe.samples() as u64) as u16;
        let is_check = |(purpose, asked)| purpose != Purpose::Sample && asked == index;
        let is_check = self.asked.is_some_and(is_check);
        if self.driver().skip(index).is_ok() {
            assert!(!self.reference.is_halted && !self.reference.is_finished);
            self.asked = None;
            // The world does not see what a host was asked for.
            let scan = self.scan();
            let is_skipped = scan.reading(index).is_none()
                && scan.pending().all(|(pending, _)| pending != index);
            assert!(is_skipped != is_check || self.config.host == Host::Measures);
            if is_skipped {
                self.reference.readings.remove(&index);
                self.reference.invalid.remove(&index);
                self.reference.skipped.insert(index);
            }
        }
    }

    fn finish_early(&mut self) {
        if self.driver().finish_early().is_ok() {
            self.asked = None;
            assert!(!self.reference.is_halted && !self.reference.is_finished);
            let samples = 0..self.recipe.samples() as u16;
            let reference = &mut self.reference;
            let unread = samples.filter(|index| !reference.readings.contains_key(index));
            reference.skipped.extend(unread);
        }
    }

    fn fail(&mut self, failure: Error) {
        self.driver().fail(failure);
        self.halt(Some(failure));
    }

    fn resume(&mut self) {
        self.driver().resume();
        self.reference.is_halted = false;
        self.reference.failure = None;
    }

    fn restart(&mut self) {
        self.driver().restart();
        self.reference.is_halted = false;
        self.reference.failure = None;
        self.clear();
    }

    /// Resets the device. The firmware restores the saved readings.
    fn reset(&mut self) {
        let scan = self.driver.take().unwrap().into_scan();
        let memory = scan.into_memory();
        memory.fill(f32::NAN);
        let mut scan = Scan::new(self.recipe, memory).unwrap();
        self.asked = None;
        self.store = mount(self.store.flash().clone(), &self.recipe);
        self.store.restore(&mut scan).unwrap();
        let saved = std::mem::take(&mut self.reference.saved);
        assert_eq!(saved_of(&scan), saved);
        let skipped = saved.iter().filter(|(_, reading)| reading.is_none());
        self.reference = Reference {
            readings: readings_of(&scan),
            skipped: skipped.map(|(index, _)| *index).collect(),
            saved,
            ..Reference::default()
        };
        self.config.sequence_seed += 1;
        self.driver = Some(Driver::new(scan, self.config));
        self.count("reset");
    }

    /// Lets host and firmware behave well until the scan finishes. A host that listens may be silent.
    fn finish(&mut self) {
        self.host.mood = match self.config.host == Host::Listens && self.below(2) == 0 {
            true => Mood::Silent,
            false => Mood::Good,
        };
        match self.host.mood {
            Mood::Silent => self.driver().restart(), // a finished scan would wait for its host
            _ => self.driver().resume(),
        }
        for _ in 0..MAX_POLLS {
            let now = self.now;
            let action = self.driver().poll(now);
            match action {
                Action::Measure { index, .. } => {
                    let reading = valid_reading(&mut self.random);
                    self.driver().record(index, reading).unwrap();
                }
                Action::Finished(_) => {
                    self.check_result();
                    return;
                }
                // Readings that cannot be fitted, or too few of them.
                Action::Failed(error) => match error.code {
                    ErrorCode::Incomplete | ErrorCode::ReadingsTooLarge | ErrorCode::Diverged => {
                        self.driver().restart();
                    }
                    ErrorCode::OutOfReach => {
                        let count = error.details[1] as usize;
                        assert!((1..=self.out_of_reach.len()).contains(&count));
                        return;
                    }
                    _ => self.driver().resume(),
                },
                Action::Wait if !self.driver().outgoing().is_empty() => self.now += 10,
                Action::Wait => match self.driver().poll_delay(now) {
                    Some(delay) => self.now += u64::from(delay),
                    // The driver waits for the firmware: a command begins the next scan.
                    None => self.driver().restart(),
                },
                _ => {}
            }
            self.exchange();
        }
        panic!("the scan does not finish: {:?}", self.driver());
    }

    /// Compares the result with a separate fit of the same readings.
    fn check_result(&self) {
        let mut scan = new_scan(self.recipe);
        for (index, reading) in readings_of(self.scan()) {
            scan.record(index, reading).unwrap();
        }
        if self.recipe.tolerates_missing() {
            scan.finish_early().unwrap();
        }
        let expected = fit(&mut scan, &[u32::MAX]);
        let driver = self.driver.as_ref().unwrap();
        assert_eq!(fitted_bits(driver), expected.bits());
    }
}

#[test]
fn random_histories_keep_all_invariants() {
    let mut recipes: Vec<_> = tolerant().iter().map(Contents::recipe).collect();
    recipes.extend([ModelKind::Phong, ModelKind::Linear].map(recipe_for));
    let mut counts = BTreeMap::new();
    for seed in 0..HISTORIES {
        let mut world = World::new(seed, &recipes);
        let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            for _ in 0..EVENTS {
                world.event();
            }
            world.finish();
        }));
        if let Err(panic) = result {
            println!("history {seed}: {:?}", world.config);
            std::panic::resume_unwind(panic);
        }
        for (event, count) in world.counts {
            *counts.entry(event).or_insert(0) += count;
        }
    }
    // The histories contain all kinds of events often enough to mean something.
    for event in ["attempts", "failed", "finished", "forget", "reset"] {
        assert!(counts[event] >= HISTORIES / 20, "{event}: {counts:?}");
    }
}
