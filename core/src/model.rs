//! The reflectance models Phong, Cook-Torrance and Neural, and the basis of the model Linear.
//!
//! Firmware selects a model as the type parameter of a [`Scan`](crate::scan::Scan). The values of a fit are the model's
//! parameters, in the order that its page lists.

mod cook_torrance;
mod kernel;
mod kind;
pub mod linear;
internal! { mod loss }
mod neural;
mod parameters;
mod phong;
mod samples;

pub use cook_torrance::CookTorrance;
pub use kind::ModelKind;
pub use neural::Neural;
pub use phong::Phong;
pub(crate) use samples::{COUNTED, unpack};

internal! { cook_torrance::CookTorranceParameters }
internal! { kernel::{Active, Evaluation, Model, Objective, ParameterSet, SampleGradient} }
internal! { neural::NeuralParameters }
internal! { phong::PhongParameters }
internal! { samples::{SLOT_WORDS, Sample, Samples, Slot, slot_of} }

use kernel::sigmoids;
