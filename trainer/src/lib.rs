//! The host side of Glimpse: materials, meta-learning, evaluation, export.

pub mod benchmark;
pub mod dual;
pub mod evaluation;
pub mod export;
pub mod files;
pub mod lanes;
pub mod linear;
pub mod material;
pub mod meta;
pub mod metrics;
pub mod render;
pub mod report;
pub mod sampling;
pub mod scanner;

/// Runs `$body` with `$M` standing for the model of a [`ModelKind`](glimpse_core::model::ModelKind),
/// or `$other` for Linear, which is not a [`Model`](glimpse_core::model::Model) that descends.
#[macro_export]
macro_rules! with_model {
    ($kind:expr, $M:ident => $body:expr, _ => $other:expr $(,)?) => {
        match $kind {
            glimpse_core::model::ModelKind::Phong => {
                type $M = glimpse_core::model::Phong;
                $body
            }
            glimpse_core::model::ModelKind::Neural => {
                type $M = glimpse_core::model::Neural;
                $body
            }
            glimpse_core::model::ModelKind::CookTorrance => {
                type $M = glimpse_core::model::CookTorrance;
                $body
            }
            glimpse_core::model::ModelKind::Linear => $other,
        }
    };
}
