//! What every model that can be fitted keeps.

use serde::{Deserialize, Serialize};

use super::FitMethod;
use crate::geometry::HalfDifference;
use crate::model::linear::{Basis, EPSILON};
use crate::model::{ModelKind, Sample};

/// How far a fit is, in its own units of work: gradients of one sample, rows and channels of a
/// ridge solve, or what a completion makes of one reading or for one channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Progress {
    /// Units done.
    pub done: u32,
    /// Units that the whole fit takes.
    pub total: u32,
}

impl Progress {
    /// True if nothing is left to do.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.done >= self.total
    }
}

/// Why a firmware cannot fit by a recipe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FitterError {
    /// The recipe is for another model than this firmware's.
    Model {
        /// The firmware's model.
        firmware: ModelKind,
        /// The recipe's model.
        recipe: ModelKind,
    },
    /// The recipe's fit takes more memory than this firmware gives it.
    Words {
        /// Numbers that it takes.
        needed: usize,
        /// Numbers that there is room for.
        found: usize,
    },
}

/// How readings become values: one model, or whichever the recipe names.
///
/// [`Scan`](crate::scan::Scan) calls it; firmware only names one, and its functions may change in
/// any version. Values are a model's parameters in
/// its order, or Linear's coefficients: m for red, m for green, m for blue.
pub trait Fitter {
    /// What a fit works in, besides the readings.
    type Workspace;
    /// All zeros, as a constant: a static that begins with it costs no flash.
    const EMPTY: Self::Workspace;

    /// Whether it can fit by this recipe's method, with a pattern of so many samples.
    ///
    /// # Errors
    /// [`FitterError`]. After `Ok` the other functions cannot fail.
    fn accept(method: &FitMethod<'_>, samples: usize) -> Result<(), FitterError>;

    /// The units of work of the whole fit.
    fn total(method: &FitMethod<'_>, samples: usize) -> u32;

    /// Puts a workspace to where a fit begins.
    fn start(workspace: &mut Self::Workspace, method: &FitMethod<'_>);

    /// Does at most `budget` units of work, `done` of them being done; returns how many are done
    /// then. The result does not depend on the budgets.
    fn advance(
        workspace: &mut Self::Workspace,
        method: &FitMethod<'_>,
        samples: &[Sample<f32>],
        done: u32,
        budget: u32,
    ) -> u32;

    /// The values as they are now.
    fn values<'w>(
        workspace: &'w Self::Workspace,
        method: FitMethod<'w>,
    ) -> impl Iterator<Item = f32> + 'w;

    /// Whether all values are finite.
    fn is_finite(workspace: &Self::Workspace, method: &FitMethod<'_>) -> bool;

    /// The loss that the complete fit is likely to have, by its readings; None where the recipe
    /// predicts none.
    fn predicted_loss(workspace: &Self::Workspace, method: &FitMethod<'_>) -> Option<f32>;

    /// The modelled BRDF (linear RGB, sr^-1, not times the cosine) at the pattern's sample with this
    /// index.
    fn at_sample(
        workspace: &Self::Workspace,
        method: &FitMethod<'_>,
        index: usize,
        at: &HalfDifference<f32>,
    ) -> [f32; 3];

    /// The modelled BRDF (linear RGB, sr^-1, not times the cosine) anywhere above the horizon. None
    /// for Linear without a basis.
    fn brdf(
        workspace: &Self::Workspace,
        method: &FitMethod<'_>,
        basis: Option<&Basis<'_>>,
        at: &HalfDifference<f32>,
    ) -> Option<[f32; 3]>;
}

impl FitMethod<'_> {
    /// The least BRDF (sr^-1) that the loss or the mapping can take at the pattern's sample with
    /// this index: a dark-subtracted reading may be below 0, but 1 + y cos(theta_i), or Linear's
    /// y w + e, has to stay positive. Half of what is there at y = 0 is kept.
    #[must_use]
    pub fn min_reading(&self, index: usize, at: &HalfDifference<f32>) -> f32 {
        match self {
            Self::Descent(_) => -0.5 / at.cos_theta_i(),
            Self::Ridge(ridge) => {
                let weight = ridge.weight.iter().nth(index).unwrap_or(1.0);
                -0.5 * EPSILON as f32 / weight
            }
            // Both: a descent may follow.
            Self::Completed(_) => {
                let weight = at.cos_theta_i() * at.cos_theta_o();
                (-0.5 * EPSILON as f32 / weight).max(-0.5 / at.cos_theta_i())
            }
        }
    }
}

/// Whether all of a run of values are finite. Out of line: it is called for each run.
#[inline(never)]
pub(super) fn is_finite(run: &[f32]) -> bool {
    run.iter().all(|value| value.is_finite())
}
