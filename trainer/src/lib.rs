//! The host side of Glimpse: materials, meta-learning, evaluation, export.

pub mod dual;
pub mod lanes;
pub mod material;
pub mod meta;
pub mod sampling;
