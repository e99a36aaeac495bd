//! Schedule prior: a CoefficientNet maps readings to coefficients of principal components, and is trained jointly with the
//! pattern.
//!
//! For the model Linear, the loss is that of the coefficients. For other models, a StartNet maps the coefficients to
//! initial parameters, and the loss is that of the parameters after the [refinement]. Without a pattern, the coefficients
//! are those of a ridge fit at any directions.

mod any_directions;
mod completed_tasks;
mod cross_validation;
pub mod dataset;
mod hyperparameters;
mod initial_weights;
pub mod objective;
pub mod refinement;
mod sample_order;
mod steps;
pub mod train;

pub(crate) use any_directions::train_any;
pub(crate) use train::train;
