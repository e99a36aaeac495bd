//! Schedule prior: a CoefficientNet maps readings to coefficients of principal components, and is trained jointly with the
//! pattern.
//!
//! For the model Linear, the loss is that of the coefficients. For other models, a StartNet maps the coefficients to
//! initial parameters, and the loss is that of the parameters after the [refinement]. Without a pattern, the coefficients
//! are those of a ridge fit at [any directions](any_directions).

mod any_directions;
mod completed_tasks;
pub mod dataset;
mod folds;
mod gradient_sum;
mod held_out;
mod hyperparameters;
mod initial_weights;
pub mod loss_predictor;
pub mod objective;
pub mod phases;
pub mod refinement;
mod sample_order;
mod start_objective;
mod train;
mod virtual_readings;

pub(super) use any_directions::train as train_at_any_directions;
pub(super) use train::train;
