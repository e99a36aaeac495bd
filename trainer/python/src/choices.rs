//! Arguments that are chosen by name: models, schedules, quantities and others.

use glimpse_core::gonio::{Footprint, Limits, Quantity};
use glimpse_core::model::ModelKind;
use glimpse_training::meta::plan::{Effort, Schedule};
use glimpse_training::route::Order;
use pyo3::prelude::*;

use crate::error::reject;

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

/// Returns the choice with a name. For an unknown name, the error names `argument` and all choices.
pub(crate) fn choose<T: Copy>(argument: &str, name: &str, choices: &[(&str, T)]) -> PyResult<T> {
    if let Some((_, choice)) = choices.iter().find(|(each, _)| *each == name) {
        return Ok(*choice);
    }
    let names: Vec<&str> = choices.iter().map(|(each, _)| *each).collect();
    reject(format!(
        "{argument} is `{name}`, and must be one of {}",
        names.join(", ")
    ))
}

/// Returns limits from arguments in degrees, with `default` for those that are None. The caller validates them.
pub(crate) fn limits(
    default: Limits,
    max_theta_i: Option<f64>,
    max_theta_o: Option<f64>,
    min_separation: Option<f64>,
) -> Limits {
    let polar = |degrees: f64| match degrees == 90.0 {
        // Exactly pi/2: the conversion below could round it up.
        true => Limits::NONE.max_theta_i,
        false => (degrees as f32).to_radians(),
    };
    Limits {
        max_theta_i: max_theta_i.map_or(default.max_theta_i, polar),
        max_theta_o: max_theta_o.map_or(default.max_theta_o, polar),
        min_separation: min_separation.map_or(default.min_separation, |degrees| {
            (degrees as f32).to_radians()
        }),
        ..default
    }
}
