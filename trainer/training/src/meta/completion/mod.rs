//! Schedule prior: networks that complete readings, trained jointly with the pattern.
//!
//! A [task](task::Task) is an augmented training material: filtered, mixed with another material, with a [wider or
//! narrower highlight](highlight_warp::HighlightWarp), and multiplied by a [smooth field](smooth_field). Its readings
//! are noisy, and some may be missing.
//!
//! The CoefficientNet maps the readings to coefficients of principal components. For the model Linear, the loss is that
//! of these coefficients. For models fitted by descent, a StartNet maps the coefficients to initial parameters, and the
//! loss is that of the parameters after the [descent](refinement).

pub mod any_directions;
pub mod correction;
pub mod dataset;
mod evidence;
mod held_out;
pub mod highlight_warp;
pub mod hyperparameters;
mod initial_weights;
pub mod loss_predictor;
mod meta_objective;
pub mod objective;
pub mod pool;
pub mod reading;
pub mod refinement;
pub mod sample_order;
pub mod smooth_field;
pub mod start_objective;
pub mod task;
pub mod task_material;
pub mod train;
pub mod virtual_readings;
mod weighted_loss;
