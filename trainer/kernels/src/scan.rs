//! A scan on the host: core's own, by any recipe.

use glimpse_core::fit::{Fitter, FitterError, Linear, linear_words};
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::Basis;
use glimpse_core::model::{CookTorrance, ModelKind, Neural, Phong, Sample};
use glimpse_core::recipe::{Learner, MAX_COMPONENTS, MAX_SAMPLES, Recipe};
use glimpse_core::scan::{
    FinishError, FitError, Memory, Reading, ReadingError, Residual, Scan, ScanError,
};

/// Why a scan has no result: where a device would give up.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum HostScanError {
    /// A recipe cannot be scanned by.
    #[error(transparent)]
    Scan(#[from] ScanError),
    /// A material's value cannot be a reading.
    #[error("the material cannot be read: {0}")]
    Reading(#[from] ReadingError),
    /// A material's values cannot be fitted.
    #[error("the material cannot be fitted: {0}")]
    Fit(#[from] FitError),
    /// A material's fit has no result.
    #[error("the material cannot be fitted: {0}")]
    Finish(#[from] FinishError),
}

/// What a scan has found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// A model's parameters in its order, or Linear's coefficients, m for red, m for green, m for
    /// blue.
    pub values: Vec<f32>,
    /// How well they explain the readings.
    pub residual: Residual,
}

/// Reads where the recipe says, angles in radians, and fits, as the device does: `read` gives the
/// BRDF in linear RGB, sr^-1, not times the cosine.
///
/// # Errors
/// Where a device would give up.
pub fn scan(
    recipe: &Recipe<'_>,
    read: &mut dyn FnMut(Angles<f32>) -> [f32; 3],
) -> Result<Found, HostScanError> {
    let mut memory = Box::new(Memory::<AnyModel, MAX_SAMPLES>::new());
    let mut scan = Scan::new(*recipe, &mut *memory)?;
    for (index, angles) in (0..).zip(recipe.pattern()) {
        scan.record(index, Reading::new(read(angles)))?;
    }
    let mut fit = scan.fit()?;
    while !fit.advance(u32::MAX).is_complete() {}
    let fitted = fit.finish()?;
    Ok(Found {
        values: fitted.values().collect(),
        residual: fitted.residual(),
    })
}

/// Whichever model the recipe names, as core's own of this name, but that Linear's memory, 2.4 MB
/// for the largest recipe, is not there until it is needed.
struct AnyModel;

/// Room for the largest ridge solve.
const WORDS: usize = linear_words(MAX_SAMPLES, MAX_COMPONENTS);

struct Workspace {
    phong: <Phong as Fitter>::Workspace,
    neural: <Neural as Fitter>::Workspace,
    cook_torrance: <CookTorrance as Fitter>::Workspace,
    linear: Vec<f32>,
}

impl Workspace {
    /// Linear's memory; None before the fit has begun.
    fn words(&self) -> Option<&[f32; WORDS]> {
        self.linear.as_slice().try_into().ok()
    }
}

/// Calls a function of the recipe's model, with its workspace; `$other` before Linear's fit.
macro_rules! of_model {
    ($function:ident(&mut $workspace:ident, $learner:expr $(, $argument:expr)*) or $other:expr) => {
        match $learner.model() {
            ModelKind::Phong => Phong::$function(&mut $workspace.phong, $learner $(, $argument)*),
            ModelKind::Neural => Neural::$function(&mut $workspace.neural, $learner $(, $argument)*),
            ModelKind::CookTorrance => {
                CookTorrance::$function(&mut $workspace.cook_torrance, $learner $(, $argument)*)
            }
            ModelKind::Linear => match $workspace.linear.as_mut_slice().try_into() {
                Ok(words) => Linear::<WORDS>::$function(words, $learner $(, $argument)*),
                Err(_) => $other,
            },
        }
    };
    ($function:ident(&$workspace:ident, $learner:expr $(, $argument:expr)*) or $other:expr) => {
        match $learner.model() {
            ModelKind::Phong => {
                <Phong as Fitter>::$function(&$workspace.phong, $learner $(, $argument)*)
            }
            ModelKind::Neural => {
                <Neural as Fitter>::$function(&$workspace.neural, $learner $(, $argument)*)
            }
            ModelKind::CookTorrance => {
                <CookTorrance as Fitter>::$function(&$workspace.cook_torrance, $learner $(, $argument)*)
            }
            ModelKind::Linear => match $workspace.words() {
                Some(words) => Linear::<WORDS>::$function(words, $learner $(, $argument)*),
                None => $other,
            },
        }
    };
}

impl Fitter for AnyModel {
    type Workspace = Workspace;
    const EMPTY: Workspace = Workspace {
        phong: Phong::EMPTY,
        neural: Neural::EMPTY,
        cook_torrance: CookTorrance::EMPTY,
        linear: Vec::new(),
    };

    fn accept(learner: &Learner<'_>, samples: usize) -> Result<(), FitterError> {
        match learner {
            Learner::Descent(_) => Ok(()),
            Learner::Ridge(_) => Linear::<WORDS>::accept(learner, samples),
        }
    }

    fn total(learner: &Learner<'_>, samples: usize) -> u32 {
        match learner.model() {
            ModelKind::Phong => Phong::total(learner, samples),
            ModelKind::Neural => Neural::total(learner, samples),
            ModelKind::CookTorrance => CookTorrance::total(learner, samples),
            ModelKind::Linear => Linear::<WORDS>::total(learner, samples),
        }
    }

    fn start(workspace: &mut Workspace, learner: &Learner<'_>) {
        if learner.model() == ModelKind::Linear {
            workspace.linear.resize(WORDS, 0.0);
        }
        of_model!(start(&mut workspace, learner) or ());
    }

    fn advance(
        workspace: &mut Workspace,
        learner: &Learner<'_>,
        samples: &[Sample<f32>],
        done: u32,
        budget: u32,
    ) -> u32 {
        of_model!(advance(&mut workspace, learner, samples, done, budget) or done)
    }

    fn values<'w>(
        workspace: &'w Workspace,
        learner: Learner<'w>,
    ) -> impl Iterator<Item = f32> + 'w {
        let values: Vec<f32> = match learner.model() {
            ModelKind::Phong => Phong::values(&workspace.phong, learner).collect(),
            ModelKind::Neural => Neural::values(&workspace.neural, learner).collect(),
            ModelKind::CookTorrance => {
                CookTorrance::values(&workspace.cook_torrance, learner).collect()
            }
            ModelKind::Linear => {
                let words = workspace.words().into_iter();
                words
                    .flat_map(|words| Linear::<WORDS>::values(words, learner))
                    .collect()
            }
        };
        values.into_iter()
    }

    fn is_finite(workspace: &Workspace, learner: &Learner<'_>) -> bool {
        of_model!(is_finite(&workspace, learner) or false)
    }

    fn at_sample(
        workspace: &Workspace,
        learner: &Learner<'_>,
        index: usize,
        at: &HalfDifference<f32>,
    ) -> [f32; 3] {
        of_model!(at_sample(&workspace, learner, index, at) or [0.0; 3])
    }

    fn brdf(
        workspace: &Workspace,
        learner: &Learner<'_>,
        basis: Option<&Basis<'_>>,
        at: &HalfDifference<f32>,
    ) -> Option<[f32; 3]> {
        of_model!(brdf(&workspace, learner, basis, at) or None)
    }
}
