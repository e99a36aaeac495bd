//! Fits of a material to readings, by descent, a ridge solve or a learned map.
//!
//! [`Phong`](crate::model::Phong), [`CookTorrance`](crate::model::CookTorrance) and [`Neural`](crate::model::Neural)
//! are fitted by descent, and [`Linear`] by a ridge solve or a learned map. [`AnyModel`] takes the model from the
//! recipe. One of them is the type parameter of a [`Scan`](crate::scan::Scan).

mod algorithm;
mod any;
internal! { mod coefficient_net }
mod completed;
internal! { mod component_rows }
internal! { mod correction }
mod descent;
mod fitter;
internal! { mod gauss_newton }
mod learned;
mod linear;
mod loss_estimate;
mod method;
mod refined;
internal! { mod ridge }
mod start;

pub use any::AnyModel;
pub use fitter::{Fitter, Progress};
pub use linear::Linear;

pub(crate) use algorithm::is_finite;
pub(crate) use correction::correction_words;
pub(crate) use descent::descent_words;
pub(crate) use linear::linear_words;
pub(crate) use refined::refined_words;

internal! { algorithm::{Algorithm, Channels} }
internal! { completed::{Completed, Components, InitNet, MAX_ROWS, MAX_UNITS, Target} }
internal! { learned::{Descent, Ridge} }
internal! { loss_estimate::{PartialLoss, Uncertainty} }
pub(crate) use method::{COMPLETION, RIDGE};

internal! { method::FitMethod }
