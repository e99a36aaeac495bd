//! The host side of Glimpse: materials, meta-learning, evaluation, export.

pub mod dual;
pub mod files;
pub mod material;
pub mod metrics;
pub mod render;
pub mod report;
