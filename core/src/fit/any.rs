//! Whichever model the recipe names.

use super::descent::Workspace;
use super::fitter::{Fitter, FitterError};
use super::{Learner, Linear};
use crate::geometry::HalfDifference;
use crate::model::linear::Basis;
use crate::model::{CookTorrance, ModelKind, Neural, Phong, Sample};

/// Whichever model the recipe names, so that one firmware takes recipes of all four at run time; for
/// Linear with room for `WORDS` numbers ([`linear_words`](super::linear_words); 0 if there will be
/// none).
///
/// It has the code of all models, and a workspace for each, 8.9 kB and 4 bytes a word: a firmware
/// that will only ever have one names that one.
///
/// ```
/// use glimpse_core::fit::{AnyModel, linear_words};
/// use glimpse_core::recipe::Recipe;
/// use glimpse_core::scan::{Memory, Scan};
///
/// // Up to 8 samples; for Linear 5 components.
/// let mut memory = Memory::<AnyModel<{ linear_words(8, 5) }>, 8>::new();
/// let recipes: [&[u8]; 2] = [
///     include_bytes!("../../examples/recipes/linear-n8.recipe"),
///     include_bytes!("../../examples/recipes/neural-n8.recipe"),
/// ];
/// for bytes in recipes {
///     let scan = Scan::new(Recipe::parse(bytes)?, &mut memory)?;
///     println!("{}", scan.recipe().model());
/// }
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct AnyModel<const WORDS: usize>;

/// A workspace for each model, one of which is in use.
#[derive(Clone, Debug)]
pub struct AnyWorkspace<const WORDS: usize> {
    phong: Workspace<Phong>,
    neural: Workspace<Neural>,
    cook_torrance: Workspace<CookTorrance>,
    linear: [f32; WORDS],
}

/// Calls a function of the recipe's model, with its workspace.
macro_rules! dispatch {
    ($learner:ident, $function:ident([$($mutable:tt)?] $workspace:ident, $($argument:expr),*)) => {
        match $learner.model() {
            ModelKind::Phong => Phong::$function(&$($mutable)? $workspace.phong, $($argument),*),
            ModelKind::Neural => Neural::$function(&$($mutable)? $workspace.neural, $($argument),*),
            ModelKind::CookTorrance => {
                CookTorrance::$function(&$($mutable)? $workspace.cook_torrance, $($argument),*)
            }
            ModelKind::Linear => {
                Linear::<WORDS>::$function(&$($mutable)? $workspace.linear, $($argument),*)
            }
        }
    };
}

impl<const WORDS: usize> Fitter for AnyModel<WORDS> {
    type Workspace = AnyWorkspace<WORDS>;
    const EMPTY: AnyWorkspace<WORDS> = AnyWorkspace {
        phong: Workspace::EMPTY,
        neural: Workspace::EMPTY,
        cook_torrance: Workspace::EMPTY,
        linear: [0.0; WORDS],
    };

    fn accept(learner: &Learner<'_>, samples: usize) -> Result<(), FitterError> {
        match learner.model() {
            ModelKind::Linear => Linear::<WORDS>::accept(learner, samples),
            _ => Ok(()),
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

    fn start(workspace: &mut AnyWorkspace<WORDS>, learner: &Learner<'_>) {
        dispatch!(learner, start([mut] workspace, learner));
    }

    fn advance(
        workspace: &mut AnyWorkspace<WORDS>,
        learner: &Learner<'_>,
        samples: &[Sample<f32>],
        done: u32,
        budget: u32,
    ) -> u32 {
        dispatch!(learner, advance([mut] workspace, learner, samples, done, budget))
    }

    fn values<'w>(
        workspace: &'w AnyWorkspace<WORDS>,
        learner: Learner<'w>,
    ) -> impl Iterator<Item = f32> + 'w {
        let model = learner.model();
        let phong = (model == ModelKind::Phong).then(|| Phong::values(&workspace.phong, learner));
        let neural =
            (model == ModelKind::Neural).then(|| Neural::values(&workspace.neural, learner));
        let cook_torrance = (model == ModelKind::CookTorrance)
            .then(|| CookTorrance::values(&workspace.cook_torrance, learner));
        let linear = (model == ModelKind::Linear)
            .then(|| Linear::<WORDS>::values(&workspace.linear, learner));
        let phong = phong.into_iter().flatten();
        let neural = neural.into_iter().flatten();
        let cook_torrance = cook_torrance.into_iter().flatten();
        let linear = linear.into_iter().flatten();
        phong.chain(neural).chain(cook_torrance).chain(linear)
    }

    fn is_finite(workspace: &AnyWorkspace<WORDS>, learner: &Learner<'_>) -> bool {
        dispatch!(learner, is_finite([] workspace, learner))
    }

    fn predicted_loss(workspace: &AnyWorkspace<WORDS>, learner: &Learner<'_>) -> Option<f32> {
        dispatch!(learner, predicted_loss([] workspace, learner))
    }

    fn at_sample(
        workspace: &AnyWorkspace<WORDS>,
        learner: &Learner<'_>,
        index: usize,
        at: &HalfDifference<f32>,
    ) -> [f32; 3] {
        dispatch!(learner, at_sample([] workspace, learner, index, at))
    }

    fn brdf(
        workspace: &AnyWorkspace<WORDS>,
        learner: &Learner<'_>,
        basis: Option<&Basis<'_>>,
        at: &HalfDifference<f32>,
    ) -> Option<[f32; 3]> {
        // `Model` has a function of this name too.
        match learner.model() {
            ModelKind::Phong => <Phong as Fitter>::brdf(&workspace.phong, learner, basis, at),
            ModelKind::Neural => <Neural as Fitter>::brdf(&workspace.neural, learner, basis, at),
            ModelKind::CookTorrance => {
                <CookTorrance as Fitter>::brdf(&workspace.cook_torrance, learner, basis, at)
            }
            ModelKind::Linear => Linear::<WORDS>::brdf(&workspace.linear, learner, basis, at),
        }
    }
}
