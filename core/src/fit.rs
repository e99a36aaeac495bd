//! The estimator: from a few readings to a fitted BRDF, in optional stages.
//!
//! ```text
//! readings -> coefficients -------------> parameters -> steps -> fitted BRDF
//!             1 net    2 ridge            3 start       4 SGD or Gauss-Newton
//! ```
//!
//! | recipe | net | ridge | start | steps |
//! |---|---|---|---|---|
//! | Linear of the paper | | 5 components, all precisions 40 | | |
//! | Phong, Cook-Torrance, Neural of the paper | | | constant | SGD |
//! | `--schedule prior`, Linear | yes | yes | | |
//! | `--schedule prior`, the others | yes | yes | from the coefficients | Gauss-Newton |
//!
//! The formula of each stage is in one file, beside the fields of its section in a recipe: 1 in `coefficient_net.rs`,
//! 2 in `ridge.rs`, 3 in `coefficient_net/start_net.rs`, and 4 in `sgd.rs` and `gauss_newton.rs`. `coefficients.rs` and
//! `start.rs` compute the stages in slices of work, and `prediction.rs` has the predicted loss.
//!
//! [`Phong`](crate::model::Phong), [`CookTorrance`](crate::model::CookTorrance), [`Neural`](crate::model::Neural) or
//! [`Linear`] is the type parameter of a [`Scan`](crate::scan::Scan). [`AnyModel`] takes the model from the recipe.

mod channels;
internal! { mod coefficient_net }
internal! { mod coefficients }
mod estimator;
internal! { mod gauss_newton }
internal! { mod ldl }
mod model;
internal! { mod prediction }
internal! { mod ridge }
mod sgd;
mod start;
mod work;

pub use model::{AnyModel, Linear, ScanModel};

pub(crate) use estimator::is_finite;
pub(crate) use model::{RIDGE, SGD};
pub(crate) use prediction::PredictedLoss;

internal! { channels::Channels }
internal! { coefficients::{Coefficients, Net, Noise, Ridge} }
internal! { estimator::Estimator }
internal! { model::Functions }
internal! { gauss_newton::GaussNewton }
internal! { prediction::Prediction }
internal! { sgd::Sgd }
internal! { start::{Refinement, Start} }

use serde::{Deserialize, Serialize};

/// The progress of a fit, in units of work, which differ in cost: the gradient of a sample, a row of a system, or the
/// addition of a reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Progress {
    /// Number of completed units.
    pub done: u32,
    /// Number of units of the whole fit.
    pub total: u32,
}

impl Progress {
    /// Returns true if all units are completed.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.done >= self.total
    }
}
