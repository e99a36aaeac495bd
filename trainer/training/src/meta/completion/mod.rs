//! Schedule prior: what completes readings, trained together with where they are taken.
//!
//! A [task](draw::Task) is a material that is like one that was measured: filtered, mixed with another,
//! its highlight [wider or narrower](warp::Warp), times a [smooth factor](field), read with some noise,
//! some of it not at all. Completed coefficients are judged as the model Linear, and where a descent
//! [starts from them](refinement), by what it comes to.

pub mod dataset;
pub mod draw;
pub mod field;
mod first_weights;
mod judged;
pub mod order;
pub mod pool;
pub mod prediction;
pub mod reading;
pub mod refinement;
pub mod train;
pub mod trainee;
pub mod warp;
