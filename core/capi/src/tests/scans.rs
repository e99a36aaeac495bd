//! Differential test: the same calls of a scan in C and in Rust have the same results, bit by bit.

use core::mem::zeroed;
use std::vec;
use std::vec::Vec;

use glimpse_core::geometry::Directions;
use glimpse_core::gonio::Reading;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Fitted, Scan};

use super::{AlignedMemory, MASKED, RECIPES, Random, UNLIKE, WORDS, begin, reading};
use crate::fit::*;
use crate::handle::{ScanModel, glimpse_scan};
use crate::machine::glimpse_directions_of;
use crate::scan::*;
use crate::status::glimpse_status as Status;
use crate::types::*;

/// The status of core's result.
fn status<T, E: Into<Status>>(result: Result<T, E>) -> Status {
    result.map_or_else(Into::into, |_| Status::Ok)
}

/// Asserts that the fitted material equals core's, or that neither scan has one.
pub(super) fn assert_fitted(scan: *const glimpse_scan, expected: Option<Fitted<'_, ScanModel>>) {
    let at = |z: f32| Directions {
        incoming: [0.6, 0.0, 0.8],
        outgoing: [-0.6, 0.0, z],
    };
    let [mirror, below] = [0.8, -0.8].map(|z| glimpse_directions::from(at(z)));
    let (mut brdf, mut count, mut values) = ([f32::NAN; 3], 0, vec![f32::NAN; 700]);
    let mut fitted: glimpse_fitted = unsafe { zeroed() };
    let described = unsafe { glimpse_fitted_describe(scan, &raw mut fitted) };
    let evaluated = unsafe { glimpse_fitted_brdf(scan, &raw const mirror, &raw mut brdf) };
    let mut get = |capacity| unsafe {
        let status = glimpse_fitted_values(scan, values.as_mut_ptr(), capacity, &raw mut count);
        let bits: Vec<u32> = values.iter().map(|value| value.to_bits()).collect();
        (status, count, bits)
    };
    let Some(expected) = expected else {
        assert_eq!([described, evaluated, get(0).0], [Status::NotFitted; 3]);
        return;
    };
    assert_eq!(described, Status::Ok);
    assert_eq!(fitted.residual, expected.residual().into());
    let bits = |value: Option<f32>| value.unwrap_or(f32::NAN).to_bits();
    assert_eq!(
        fitted.predicted_loss.to_bits(),
        bits(expected.predicted_loss())
    );
    assert_eq!(fitted.loss_bound.to_bits(), bits(expected.loss_bound()));
    let answer = match expected.is_unlike_training() {
        Some(false) => glimpse_answer::No,
        Some(true) => glimpse_answer::Yes,
        None => glimpse_answer::Unknown,
    };
    assert_eq!(fitted.unlike_training, answer);
    match expected.brdf(&at(0.8)) {
        Some(expected) => assert_eq!((evaluated, brdf), (Status::Ok, expected)),
        None => assert!(matches!(evaluated, Status::NoBasis | Status::Diverged)),
    }
    let status = unsafe { glimpse_fitted_brdf(scan, &raw const below, &raw mut brdf) };
    assert_eq!(status, Status::Directions);
    let mut expected: Vec<u32> = expected.values().map(f32::to_bits).collect();
    let total = expected.len();
    assert_eq!(
        get(total - 1),
        (Status::BufferTooSmall, total, vec![f32::NAN.to_bits(); 700])
    );
    expected.resize(700, f32::NAN.to_bits());
    assert_eq!(get(total), (Status::Ok, total, expected));
}

/// A scan in C and the same one in Rust.
struct Pair<'a> {
    c: *mut glimpse_scan,
    core: Scan<'a, ScanModel>,
}

impl Pair<'_> {
    fn record(&mut self, index: u16, reading: Reading) -> Status {
        let mut recorded: glimpse_recorded = unsafe { zeroed() };
        let (c, expected) = (reading.into(), self.core.record(index, reading));
        let found = unsafe { glimpse_scan_record(self.c, index, &raw const c, &raw mut recorded) };
        assert_eq!(found, status(expected));
        let flags = expected.unwrap_or_default();
        assert_eq!(recorded.replaced != 0, flags.replaced);
        assert_eq!(recorded.clamped != 0, flags.clamped);
        found
    }

    /// Asserts that the next pending sample and the reading of a sample are equal.
    fn assert_sample(&self, index: u16) {
        let mut sample: glimpse_sample = unsafe { zeroed() };
        let found = unsafe { glimpse_scan_next(self.c, index, &raw mut sample) };
        let mut pending = self.core.pending().skip_while(|(other, _)| *other < index);
        if let Some((next, directions)) = pending.next() {
            assert_eq!((found, sample.index), (Status::Ok, next));
            assert_eq!(sample.directions, directions.into());
            let angles = self.core.recipe().pattern().nth(next.into()).unwrap();
            let found = (sample.theta_h, sample.theta_d, sample.phi_d);
            assert_eq!(found, (angles.theta_h, angles.theta_d, angles.phi_d));
            let again = glimpse_directions_of(sample.arms);
            let again = [again.incoming, again.outgoing].into_iter().flatten();
            let expected = [directions.incoming, directions.outgoing];
            let mut pairs = again.zip(expected.into_iter().flatten());
            assert!(pairs.all(|(a, b)| (a - b).abs() < 1e-6));
        } else {
            assert_eq!(found, Status::NonePending);
        }
        let mut reading = glimpse_reading::default();
        let found = unsafe { glimpse_scan_reading(self.c, index, &raw mut reading) };
        match self.core.reading(index) {
            Some(expected) => assert_eq!((found, reading), (Status::Ok, expected.into())),
            None => assert_eq!(found, Status::NotRead),
        }
    }

    fn begin_fit(&mut self) -> Status {
        let found = unsafe { glimpse_fit_begin(self.c) };
        assert_eq!(found, status(self.core.fit().map(|_| ())));
        found
    }

    /// Advances the fit. Returns true if it is under way and not complete.
    fn advance(&mut self, budget: u32) -> bool {
        let mut found: glimpse_progress = unsafe { zeroed() };
        let status = unsafe { glimpse_fit_advance(self.c, budget, &raw mut found) };
        let Some(mut fit) = self.core.fit_under_way() else {
            assert_eq!(status, Status::NoFit);
            return false;
        };
        let expected = fit.advance(budget);
        assert_eq!(status, Status::Ok);
        assert_eq!((found.done, found.total), (expected.done, expected.total));
        !expected.is_complete()
    }

    fn finish(&mut self) -> Status {
        let fit = self.core.fit_under_way();
        let expected = fit.map_or(Status::NoFit, |fit| status(fit.finish()));
        assert_eq!(unsafe { glimpse_fit_finish(self.c) }, expected);
        assert_fitted(self.c, self.core.fitted());
        expected
    }

    /// Makes a random call for a sample. Returns its status.
    fn call(&mut self, index: u16, random: &mut Random) -> Status {
        let (found, expected) = match random.below(40) {
            0 => {
                self.core.restart();
                (unsafe { glimpse_scan_restart(self.c) }, Status::Ok)
            }
            1 => {
                let found = unsafe { glimpse_scan_skip(self.c, index) };
                (found, status(self.core.skip(index)))
            }
            2 => {
                let found = unsafe { glimpse_scan_finish_early(self.c) };
                (found, status(self.core.finish_early()))
            }
            3..6 => return self.begin_fit(),
            6..9 => return self.finish(),
            9..15 => {
                self.advance(random.below(40) as u32);
                return Status::Ok;
            }
            _ => return self.record(index, random.reading(index)),
        };
        assert_eq!(found, expected);
        found
    }

    /// Reads all samples, and fits them. Returns the status of the fit.
    fn scan(&mut self, sensor: fn(u16) -> [f32; 3]) -> Status {
        for index in 0..self.core.recipe().samples() as u16 {
            assert_eq!(self.record(index, Reading::new(sensor(index))), Status::Ok);
        }
        let begun = self.begin_fit();
        while self.advance(3) {}
        match (begun, self.finish()) {
            (Status::Ok, finished) => finished,
            (begun, finished) => {
                assert_eq!(finished, Status::NoFit);
                begun
            }
        }
    }
}

/// Returns a plausible BRDF value that differs between samples, sr^-1.
fn level(index: u16) -> f32 {
    0.25 + 0.005 * f32::from(index)
}

/// A sensor and the status of a fit of its readings.
type Sensor = (fn(u16) -> [f32; 3], Status);

/// Scans with each recipe after random calls, one after the other in the same memory, also with broken sensors.
#[test]
fn scans_match_core() {
    let sensors: [Sensor; 7] = [
        (|index| [-0.01 * f32::from(index + 1); 3], Status::Dark),
        (|_| [0.2; 3], Status::Repeated),
        (|index| [0.0, level(index), level(index)], Status::DeadRed),
        (|index| [level(index), level(index), 0.0], Status::DeadBlue),
        (|index| [9.0 * level(index) / 0.3; 3], Status::Albedo),
        (
            |index| [1000.0 + f32::from(index); 3],
            Status::ReadingsTooLarge,
        ),
        (|index| reading(index).brdf, Status::Ok),
    ];
    let (mut memory, mut random) = (AlignedMemory::for_scan(), Random(5));
    let (mut statuses, mut answers, mut models) = (Vec::new(), Vec::new(), Vec::new());
    for bytes in RECIPES.into_iter().chain([MASKED, UNLIKE]) {
        let (begun, c) = begin(&mut memory, bytes);
        let mut described: glimpse_recipe = unsafe { zeroed() };
        let status =
            unsafe { glimpse_recipe_describe(bytes.as_ptr(), bytes.len(), &raw mut described) };
        assert_eq!([begun, status], [Status::Ok; 2]);
        let recipe = Recipe::parse(bytes).unwrap();
        let samples = recipe.samples() as u16;
        models.push(described.model);
        assert_eq!(
            (described.model, described.samples),
            (recipe.model() as i32, samples)
        );
        assert_eq!(usize::from(described.values), recipe.values());
        assert_eq!(described.checksum, recipe.checksum());
        let loss = recipe.expected_loss().unwrap_or(f32::NAN);
        assert_eq!(described.expected_loss.to_bits(), loss.to_bits());
        let mut words = vec![0.0; WORDS];
        let core = Scan::new(recipe, &mut words).unwrap();
        let mut pair = Pair { c, core };
        for _ in 0..600 {
            let index = random.below(u64::from(samples) + 1) as u16;
            statuses.push(pair.call(index, &mut random));
            pair.assert_sample(index);
        }
        for (sensor, expected) in sensors {
            let found = pair.scan(sensor);
            assert!(found == expected || bytes != RECIPES[0] && expected != Status::Ok);
        }
        answers.push(pair.core.fitted().unwrap().is_unlike_training());
    }
    use glimpse_model::{CookTorrance, Linear, Neural, Phong};
    let expected = [Phong, CookTorrance, Neural, Linear].map(|model| model as i32);
    assert_eq!(models[..4], expected);
    // The random calls have these results, among others.
    for status in [
        Status::NoFit,
        Status::Unfinished,
        Status::Incomplete,
        Status::ReadingNonFinite,
        Status::ReadingNegative,
        Status::ReadingIndex,
        Status::ReadingRequired,
    ] {
        assert!(statuses.contains(&status), "{status:?}");
    }
    assert!(
        [None, Some(true), Some(false)]
            .iter()
            .all(|answer| answers.contains(answer))
    );
}
