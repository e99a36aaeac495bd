//! Materials as tables, for display.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glimpse_core::geometry::{Arms, HalfDifference};
use glimpse_core::model::linear::Basis;
use glimpse_fitting::linear::{CHANNEL_COEFFICIENTS, material_basis};
use glimpse_fitting::measurement::{FitReport, MaterialFit};
use glimpse_materials::loss::loss_between;
use glimpse_materials::{Brdf, Material, Viewing, angles_of, luminance};
use serde_json::{Value, json};

/// Step of polar angles in the band of a fit, degrees, and the largest angle.
const STEP: u8 = 3;
const MAX_THETA: i8 = 87;
/// BRDF in sr^-1 below which deviations do not decrease with the BRDF: e of Linear's mapping.
const FLOOR: f32 = 1e-3;

/// Tabulates a material in 302 kB, and returns the table and its loss against the material.
pub(crate) fn tabulate(material: &dyn Material) -> (Vec<u8>, f64) {
    let table = material_basis(material);
    let parsed = Basis::parse(&table).ok();
    let tabulated = |at: &HalfDifference<f32>| {
        let basis = parsed.as_ref();
        basis
            .and_then(|basis| basis.brdf(CHANNEL_COEFFICIENTS, at))
            .unwrap_or([f32::NAN; 3])
    };
    let loss = loss_between(&tabulated, material);
    (table, loss)
}

/// Returns a fit for display: its table, its report, and the band of one standard deviation of its luminance in the plane
/// of incidence.
///
/// The band has a row for each polar angle of the light, from 0, and a column for each outgoing angle, between the horizons.
/// Numbers are divided by the luminance plus a floor, so that they are smooth even in a highlight.
pub(crate) fn fit_to_json(fit: &MaterialFit) -> Value {
    let steps = |first: i8| {
        let steps = (first..=MAX_THETA).step_by(STEP.into());
        steps.map(|degrees| f32::from(degrees).to_radians())
    };
    let at = steps(0).flat_map(|theta_i| {
        // Directions above the horizon are not opposite.
        steps(-MAX_THETA).filter_map(move |theta_o| {
            let arms = Arms::from_array([-theta_i, 0.0, theta_o, 0.0]);
            HalfDifference::from_directions(&arms.directions())
        })
    });
    let (at, posterior) = (at.collect::<Vec<_>>(), &fit.selection.posterior);
    let angles = at.iter().map(angles_of).collect();
    let deviations = posterior.deviations(fit.material.fitted(), angles);
    let band = fit.material.values_at(&at).into_iter().zip(deviations);
    let band = band.flat_map(|(brdf, deviation)| {
        (luminance(deviation) / (luminance(brdf).max(0.0) + FLOOR)).to_le_bytes()
    });
    let band = STANDARD.encode(band.collect::<Vec<u8>>());
    let (table, table_loss) = tabulate(&fit.material);
    let report = FitReport::new(fit, Viewing::default());
    json!({
        "table": STANDARD.encode(table),
        "table_loss": table_loss,
        "band": { "step": STEP, "max": MAX_THETA, "floor": FLOOR, "values": band },
        "expected_loss": report.expected_loss,
        "residual": report.residual.mean,
    })
}
