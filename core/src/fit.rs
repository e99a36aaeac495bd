//! How readings become a material: by descent, or by a ridge solve.

mod descent;
mod learner;
pub mod ridge;

pub use descent::{Fit, Progress, Workspace, brdf, residuals};
pub use learner::{Descent, Learner, Ridge};
