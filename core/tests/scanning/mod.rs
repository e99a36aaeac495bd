//! What tests of scan and driver share: a recipe for each model, a made-up material, whole scans.

use glimpse_core::fit::{Fitter, linear_words};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{FinishError, FitError, Memory, Reading, Residual, Scan};

use super::common::{linear, neural, write, write_linear};

/// n of all these recipes.
pub(crate) const SAMPLES: usize = 8;
/// Room for Linear's solve with m = 5.
pub(crate) const WORDS: usize = linear_words(SAMPLES, 5);

pub(crate) const MODELS: [ModelKind; 4] = [
    ModelKind::Phong,
    ModelKind::CookTorrance,
    ModelKind::Neural,
    ModelKind::Linear,
];

/// A valid recipe of 20 steps, or of five components.
pub(crate) fn recipe_of(model: ModelKind) -> Vec<u8> {
    let Some(parameters) = model.parameters() else {
        return write_linear(&linear()).unwrap();
    };
    let mut numbers = neural();
    numbers.model = model;
    numbers.initial.truncate(parameters);
    numbers.step_sizes.truncate(parameters);
    write(&numbers).unwrap()
}

/// Calls `check::<K>(recipe, ..)` for each model by type, and for each by the recipe.
macro_rules! every_fitter {
    ($check:ident $(, $argument:expr)*) => {{
        use glimpse_core::fit::{AnyModel, Linear};
        use glimpse_core::model::{CookTorrance, ModelKind, Neural, Phong};
        use glimpse_core::recipe::Recipe;
        use $crate::scanning::{MODELS, WORDS, recipe_of};

        let parse = |bytes: &'static [u8]| Recipe::parse(bytes).unwrap();
        let recipe = |model: ModelKind| parse(recipe_of(model).leak());
        $check::<Phong>(recipe(ModelKind::Phong) $(, $argument)*);
        $check::<CookTorrance>(recipe(ModelKind::CookTorrance) $(, $argument)*);
        $check::<Neural>(recipe(ModelKind::Neural) $(, $argument)*);
        $check::<Linear<WORDS>>(recipe(ModelKind::Linear) $(, $argument)*);
        for model in MODELS {
            $check::<AnyModel<WORDS>>(recipe(model) $(, $argument)*);
        }
    }};
}
pub(crate) use every_fitter;

/// What the sensor sees at a sample.
pub(crate) fn material(index: u16) -> Reading {
    let k = f32::from(index);
    Reading {
        brdf: [0.2 + 0.1 * k, 0.3, 0.05 * k],
        saturated: index == 3,
    }
}

/// What comes of a fit.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Outcome {
    /// The bits of all values, and of mean and worst of the residual.
    Fitted(Vec<u32>, Residual),
    Implausible,
    Diverged,
}

impl Outcome {
    /// The bits of what was fitted.
    pub(crate) fn bits(&self) -> &[u32] {
        match self {
            Self::Fitted(bits, _) => bits,
            _ => panic!("{self:?}"),
        }
    }
}

/// Fits in slices of these budgets, in turn. Whatever ends in a fitted material is finite: all
/// values, and the BRDF at all readings.
pub(crate) fn fit<K: Fitter, const CAPACITY: usize>(
    scan: &mut Scan<'_, '_, K, CAPACITY>,
    budgets: &[u32],
) -> Outcome {
    let pattern: Vec<_> = scan.recipe().pattern().collect();
    let mut fit = match scan.fit() {
        Ok(fit) => fit,
        Err(FitError::Implausible { .. }) => return Outcome::Implausible,
        Err(error) => panic!("{error}"),
    };
    let mut done = 0;
    for budget in budgets.iter().cycle() {
        let progress = fit.advance(*budget);
        assert!(progress.done - done <= *budget, "the slice was too long");
        done = progress.done;
        if progress.is_complete() {
            break;
        }
    }
    let fitted = match fit.finish() {
        Ok(fitted) => fitted,
        Err(FinishError::Diverged) => return Outcome::Diverged,
        Err(error) => panic!("{error}"),
    };
    assert!(fitted.values().all(f32::is_finite));
    for angles in pattern {
        let at = glimpse_core::geometry::HalfDifference::from_angles(angles);
        if let Some(brdf) = fitted.brdf(&at.directions()) {
            let sound = |value: &f32| value.is_finite() && *value >= 0.0;
            assert!(brdf.iter().all(sound), "{brdf:?}");
        }
    }
    let residual = fitted.residual();
    let numbers = [residual.mean, residual.worst];
    assert!(numbers.iter().all(|number| number.is_finite()));
    let bits = fitted.values().chain(numbers).map(f32::to_bits).collect();
    Outcome::Fitted(bits, residual)
}

/// A whole scan, in memory of its own, in the recipe's order.
pub(crate) fn whole<K: Fitter>(recipe: Recipe<'_>, material: impl Fn(u16) -> Reading) -> Outcome {
    let mut memory = Memory::<K, SAMPLES>::new();
    let mut scan = Scan::new(recipe, &mut memory).unwrap();
    for index in 0..SAMPLES as u16 {
        scan.record(index, material(index)).unwrap();
    }
    fit(&mut scan, &[u32::MAX])
}
