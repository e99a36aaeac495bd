//! How readings become a material: by descent, or by a ridge solve.
//!
//! Every model keeps one trait, [`Fitter`]: [`Phong`](crate::model::Phong),
//! [`CookTorrance`](crate::model::CookTorrance) and [`Neural`](crate::model::Neural) descend,
//! [`Linear`] solves, and [`AnyModel`] does what the recipe says. A [`Scan`](crate::scan::Scan) is
//! what calls it.

mod any;
pub mod coefficient_net;
mod completed;
mod descent;
mod fitter;
mod learned;
mod linear;
mod method;
pub mod ridge;

pub use any::AnyModel;
pub use completed::{Completed, Components, InitNet, MAX_ROWS, MAX_UNITS, Target};
pub use descent::brdf;
pub(crate) use descent::descent_words;
pub(crate) use fitter::is_finite;
pub use fitter::{Channels, Fitter, ModelMismatch, Progress};
pub use learned::{Descent, Ridge};
pub use linear::Linear;
pub(crate) use linear::linear_words;
pub use method::FitMethod;
