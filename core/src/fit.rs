//! How readings become a material: by descent, or by a ridge solve.
//!
//! Every model keeps one trait, [`Fitter`]: [`Phong`](crate::model::Phong),
//! [`CookTorrance`](crate::model::CookTorrance) and [`Neural`](crate::model::Neural) descend,
//! [`Linear`] solves, and [`AnyModel`] does what the recipe says. A [`Scan`](crate::scan::Scan) is
//! what calls it.

mod any;
mod completed;
pub mod completion;
mod descent;
mod fitter;
mod learned;
mod learner;
mod linear;
pub mod ridge;

pub use any::{AnyModel, AnyWorkspace};
pub use completed::{Completed, Components, MAX_ROWS, MAX_UNITS, Start, Target};
pub use descent::{Workspace, brdf};
pub use fitter::{Fitter, FitterError, Progress};
pub use learned::{Descent, Ridge};
pub use learner::Learner;
pub use linear::{Linear, linear_words};
