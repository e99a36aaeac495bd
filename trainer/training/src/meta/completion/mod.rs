//! Schedule prior: what completes readings, trained together with where they are taken.
//!
//! A [task](draw::Task) is a material that is like one that was measured: filtered, mixed with another,
//! its highlight [wider or narrower](highlight_warp::HighlightWarp), times a [smooth factor](field), read with some noise,
//! some of it not at all. Completed coefficients are judged as the model Linear, and where a descent
//! [starts from them](refinement), by what it comes to.

pub mod dataset;
pub mod draw;
pub mod field;
mod first_weights;
pub mod highlight_warp;
pub mod loss_predictor;
pub mod objective;
pub mod order;
pub mod pool;
pub mod reading;
pub mod refinement;
pub mod train;
mod weighted_loss;
