//! Scans in memory: a recipe for each model, synthetic readings, and the outcome of a fit.

use glimpse_core::error::ErrorCode;
use glimpse_core::fit::{AnyModel, ScanModel};
use glimpse_core::geometry::{Directions, HalfDifference};
use glimpse_core::gonio::Reading;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Residual, Scan};

pub(crate) use crate::recipes::MODELS;
use crate::recipes::{linear, parsed, sgd};

/// The number of samples, n, of all these recipes.
pub(crate) const SAMPLES: usize = 8;
pub(crate) type Any = AnyModel;

/// The bytes of a valid recipe with 20 steps of SGD, or with five components.
pub(crate) fn encoded_recipe(model: ModelKind) -> Vec<u8> {
    match model {
        ModelKind::Linear => linear().write(),
        _ => sgd(model).write(),
    }
}

pub(crate) fn recipe_for(model: ModelKind) -> Recipe<'static> {
    parsed(encoded_recipe(model))
}

/// An empty scan, whose memory is leaked.
pub(crate) fn new_scan(recipe: Recipe<'static>) -> Scan<'static, Any> {
    let memory = vec![0.0; recipe.memory_words()].leak();
    Scan::new(recipe, memory).unwrap()
}

/// An empty scan of each model.
pub(crate) fn empty_scans() -> [Scan<'static, Any>; 4] {
    MODELS.map(|model| new_scan(recipe_for(model)))
}

/// The reading of a sample of a synthetic material.
pub(crate) fn synthetic_reading(index: u16) -> Reading {
    let k = f32::from(index);
    Reading {
        brdf: [0.2 + 0.1 * k, 0.3, 0.05 * k],
        saturated: index == 3,
    }
}

/// Records the readings of some samples.
pub(crate) fn record<K: ScanModel>(
    scan: &mut Scan<'_, K>,
    samples: impl IntoIterator<Item = u16>,
    reading: impl Fn(u16) -> Reading,
) {
    for index in samples {
        scan.record(index, reading(index)).unwrap();
    }
}

/// The outcome of a fit.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Outcome {
    /// The bits of all values, and of the residual's mean and worst error.
    Fitted(Vec<u32>, Residual),
    TooLarge,
    Diverged,
}

impl Outcome {
    /// The bits of a fitted material.
    #[track_caller]
    pub(crate) fn bits(&self) -> &[u32] {
        match self {
            Self::Fitted(bits, _) => bits,
            _ => panic!("{self:?}"),
        }
    }

    /// The values of a fitted material.
    #[track_caller]
    pub(crate) fn values(&self) -> Vec<f32> {
        let [values @ .., _, _] = self.bits() else {
            panic!("{self:?}")
        };
        values.iter().copied().map(f32::from_bits).collect()
    }

    #[track_caller]
    pub(crate) fn residual(&self) -> Residual {
        match self {
            Self::Fitted(_, residual) => *residual,
            _ => panic!("{self:?}"),
        }
    }
}

/// Fits in slices of these budgets, in turn, and resumes the fit from the scan for each slice. Checks that a fitted
/// material is finite: all its values, and its BRDF at all readings. Linear has no BRDF without its basis, and no model
/// has one for directions at or below the horizon, or of other lengths than 1.
pub(crate) fn fit<K: ScanModel>(scan: &mut Scan<'_, K>, budgets: &[u32]) -> Outcome {
    let pattern: Vec<_> = scan.recipe().pattern().collect();
    let mut progress = match scan.fit() {
        Ok(fit) => fit.progress(),
        Err(error) if error.code == ErrorCode::ReadingsTooLarge => return Outcome::TooLarge,
        Err(error) => panic!("{error}"),
    };
    assert_eq!(progress.done, 0);
    for budget in budgets.iter().cycle() {
        let next = scan.fit_under_way().unwrap().advance(*budget);
        let is_valid = next.done - progress.done <= *budget;
        assert!(is_valid, "the slice was too long");
        progress = next;
        if progress.is_complete() {
            break;
        }
    }
    let implausible = match scan.fit_under_way().unwrap().finish() {
        Ok(_) => None,
        // A synthetic material may be implausible.
        Err(error) if error.is_implausible() => Some(error.code),
        Err(error) if error.code == ErrorCode::Diverged => return Outcome::Diverged,
        Err(error) => panic!("{error}"),
    };
    // The fit is available in both cases, and contains the same reason.
    let fitted = scan.fitted().unwrap();
    assert_eq!(fitted.residual().implausible, implausible);
    assert!(fitted.values().all(f32::is_finite));
    let has_brdf = scan.recipe().model() != ModelKind::Linear;
    for angles in pattern {
        let at = HalfDifference::from_angles(angles);
        let brdf = fitted.brdf(&at.directions());
        assert_eq!(brdf.is_some(), has_brdf);
        let is_valid = |value: &f32| value.is_finite() && *value >= 0.0;
        assert!(brdf.iter().flatten().all(is_valid), "{brdf:?}");
    }
    let long = [0.66, 0.0, 0.88];
    for invalid in [[0.6, 0.0, -0.8], [1.0, 0.0, 0.0], long, [f32::NAN; 3]] {
        for valid in [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]] {
            for (incoming, outgoing) in [(valid, invalid), (invalid, valid)] {
                assert_eq!(fitted.brdf(&Directions { incoming, outgoing }), None);
            }
        }
    }
    let residual = fitted.residual();
    let numbers = [residual.mean, residual.worst];
    assert!(numbers.iter().all(|number| number.is_finite()));
    let bits = fitted.values().chain(numbers).map(f32::to_bits).collect();
    Outcome::Fitted(bits, residual)
}

/// A full scan in its own memory, in the recipe's order.
pub(crate) fn full_scan(recipe: Recipe<'_>, reading: impl Fn(u16) -> Reading) -> Outcome {
    let mut memory = vec![0.0; recipe.memory_words()];
    let mut scan = Scan::<Any>::new(recipe, &mut memory).unwrap();
    record(&mut scan, 0..recipe.samples() as u16, reading);
    fit(&mut scan, &[u32::MAX])
}
