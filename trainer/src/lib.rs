//! The host side of Glimpse: materials, meta-learning, evaluation, export.

pub mod dual;
pub mod material;
