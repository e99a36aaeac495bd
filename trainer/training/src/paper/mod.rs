//! Schedule paper: initial parameters and step sizes of SGD steps on random samples, then the pattern alone. For the
//! model Linear, the pattern of a ridge stage.

pub mod descent;
pub mod objective;
mod phases;
pub mod ridge;
mod train;

pub use train::INNER_STEPS;
pub(crate) use train::train;
