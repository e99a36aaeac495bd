//! How readings become a material: by descent, or by a ridge solve.
//!
//! [`Phong`](crate::model::Phong), [`CookTorrance`](crate::model::CookTorrance) and
//! [`Neural`](crate::model::Neural) descend, [`Linear`] solves, and [`AnyModel`] does what the recipe says. A
//! [`Scan`](crate::scan::Scan) names one of them.

mod algorithm;
mod any;
internal! { mod coefficient_net }
mod completed;
mod descent;
mod fitter;
mod learned;
mod linear;
mod method;
internal! { mod ridge }

pub use any::AnyModel;
pub use fitter::{Fitter, Progress};
pub use linear::Linear;

pub(crate) use algorithm::is_finite;
pub(crate) use descent::descent_words;
pub(crate) use linear::linear_words;

internal! { algorithm::{Algorithm, Channels, ModelMismatch} }
internal! { completed::{Completed, Components, InitNet, MAX_ROWS, MAX_UNITS, Target} }
internal! { learned::{Descent, Ridge} }
pub(crate) use method::{COMPLETION, RIDGE};

internal! { method::FitMethod }
