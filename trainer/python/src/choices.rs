//! What Python says in words: models, schedules, quantities.

use glimpse_core::gonio::{Footprint, Limits, Quantity};
use glimpse_core::model::ModelKind;
use glimpse_materials::Format;
use glimpse_trainer::route::Order;
use glimpse_training::meta::plan::{Effort, Schedule};
use pyo3::prelude::*;

use crate::error::refused;

pub(crate) const MODELS: [(&str, ModelKind); 4] = [
    ("phong", ModelKind::Phong),
    ("cook-torrance", ModelKind::CookTorrance),
    ("linear", ModelKind::Linear),
    ("neural", ModelKind::Neural),
];
pub(crate) const SCHEDULES: [(&str, Schedule); 3] = [
    ("prior", Schedule::Prior),
    ("joint", Schedule::Joint),
    ("paper", Schedule::Paper),
];
pub(crate) const EFFORTS: [(&str, Effort); 4] = [
    ("brief", Effort::Brief),
    ("quick", Effort::Quick),
    ("standard", Effort::Standard),
    ("long", Effort::Long),
];
pub(crate) const ORDERS: [(&str, Order); 2] = [
    ("travel", Order::Travel),
    ("progressive", Order::Progressive),
];
pub(crate) const FORMATS: [(&str, Format); 4] = [
    ("merl", Format::Merl),
    ("rgl", Format::Rgl),
    ("nbrdf", Format::Nbrdf),
    ("pab", Format::Pab),
];
pub(crate) const QUANTITIES: [(&str, Quantity); 4] = [
    ("brdf", Quantity::Brdf),
    ("brdf-cos-i", Quantity::BrdfTimesCosThetaI),
    ("brdf-cos-o", Quantity::BrdfTimesCosThetaO),
    ("reflectance-factor", Quantity::ReflectanceFactor),
];
pub(crate) const FOOTPRINTS: [(&str, Footprint); 2] = [
    ("light", Footprint::LightLarger),
    ("sensor", Footprint::SensorLarger),
];

/// What a word stands for; `what` it is, and which there are, is said of others.
pub(crate) fn choose<T: Copy>(what: &str, word: &str, choices: &[(&str, T)]) -> PyResult<T> {
    if let Some((_, choice)) = choices.iter().find(|(name, _)| *name == word) {
        return Ok(*choice);
    }
    let names: Vec<&str> = choices.iter().map(|(name, _)| *name).collect();
    refused(format!(
        "{what} is `{word}`, and should be one of {}",
        names.join(", ")
    ))
}

/// Limits in degrees: what was given, and `stated` where nothing was. (What is no limit is refused by whoever
/// takes them.)
pub(crate) fn limits(
    stated: Limits,
    max_theta_i: Option<f64>,
    max_theta_o: Option<f64>,
    min_separation: Option<f64>,
) -> Limits {
    let polar = |degrees: f64| match degrees == 90.0 {
        // Not a rounding more.
        true => Limits::NONE.max_theta_i,
        false => (degrees as f32).to_radians(),
    };
    Limits {
        max_theta_i: max_theta_i.map_or(stated.max_theta_i, polar),
        max_theta_o: max_theta_o.map_or(stated.max_theta_o, polar),
        min_separation: min_separation.map_or(stated.min_separation, |degrees| {
            (degrees as f32).to_radians()
        }),
        ..stated
    }
}
