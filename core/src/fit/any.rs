//! Whichever model the recipe names.

use super::descent::Workspace;
use super::fitter::{Fitter, FitterError};
use super::{FitMethod, Linear};
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
    ($method:ident, $function:ident([$($mutable:tt)?] $workspace:ident, $($argument:expr),*)) => {
        match $method.model() {
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

    fn accept(method: &FitMethod<'_>, samples: usize) -> Result<(), FitterError> {
        match method.model() {
            ModelKind::Linear => Linear::<WORDS>::accept(method, samples),
            _ => Ok(()),
        }
    }

    fn total(method: &FitMethod<'_>, samples: usize) -> u32 {
        match method.model() {
            ModelKind::Phong => Phong::total(method, samples),
            ModelKind::Neural => Neural::total(method, samples),
            ModelKind::CookTorrance => CookTorrance::total(method, samples),
            ModelKind::Linear => Linear::<WORDS>::total(method, samples),
        }
    }

    fn start(workspace: &mut AnyWorkspace<WORDS>, method: &FitMethod<'_>) {
        dispatch!(method, start([mut] workspace, method));
    }

    fn advance(
        workspace: &mut AnyWorkspace<WORDS>,
        method: &FitMethod<'_>,
        samples: &[Sample<f32>],
        done: u32,
        budget: u32,
    ) -> u32 {
        dispatch!(method, advance([mut] workspace, method, samples, done, budget))
    }

    fn values<'w>(
        workspace: &'w AnyWorkspace<WORDS>,
        method: FitMethod<'w>,
    ) -> impl Iterator<Item = f32> + 'w {
        let model = method.model();
        let phong = (model == ModelKind::Phong).then(|| Phong::values(&workspace.phong, method));
        let neural =
            (model == ModelKind::Neural).then(|| Neural::values(&workspace.neural, method));
        let cook_torrance = (model == ModelKind::CookTorrance)
            .then(|| CookTorrance::values(&workspace.cook_torrance, method));
        let linear = (model == ModelKind::Linear)
            .then(|| Linear::<WORDS>::values(&workspace.linear, method));
        let phong = phong.into_iter().flatten();
        let neural = neural.into_iter().flatten();
        let cook_torrance = cook_torrance.into_iter().flatten();
        let linear = linear.into_iter().flatten();
        phong.chain(neural).chain(cook_torrance).chain(linear)
    }

    fn is_finite(workspace: &AnyWorkspace<WORDS>, method: &FitMethod<'_>) -> bool {
        dispatch!(method, is_finite([] workspace, method))
    }

    fn predicted_loss(workspace: &AnyWorkspace<WORDS>, method: &FitMethod<'_>) -> Option<f32> {
        dispatch!(method, predicted_loss([] workspace, method))
    }

    fn at_sample(
        workspace: &AnyWorkspace<WORDS>,
        method: &FitMethod<'_>,
        index: usize,
        at: &HalfDifference<f32>,
    ) -> [f32; 3] {
        dispatch!(method, at_sample([] workspace, method, index, at))
    }

    fn brdf(
        workspace: &AnyWorkspace<WORDS>,
        method: &FitMethod<'_>,
        basis: Option<&Basis<'_>>,
        at: &HalfDifference<f32>,
    ) -> Option<[f32; 3]> {
        // `Model` has a function of this name too.
        match method.model() {
            ModelKind::Phong => <Phong as Fitter>::brdf(&workspace.phong, method, basis, at),
            ModelKind::Neural => <Neural as Fitter>::brdf(&workspace.neural, method, basis, at),
            ModelKind::CookTorrance => {
                <CookTorrance as Fitter>::brdf(&workspace.cook_torrance, method, basis, at)
            }
            ModelKind::Linear => Linear::<WORDS>::brdf(&workspace.linear, method, basis, at),
        }
    }
}
