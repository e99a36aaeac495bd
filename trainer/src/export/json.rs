//! A recipe as JSON: complete enough to redo the fit elsewhere.

use glimpse_core::recipe::Recipe;
use serde_json::{Value, json};

/// Model, n, inner steps, pattern (rows of theta_h, theta_d, phi_d in radians), initial
/// parameters and step sizes in the model's order, expected loss, and provenance.
#[must_use]
pub fn to_json(recipe: &Recipe<'_>) -> Value {
    let pattern: Vec<[f32; 3]> = recipe
        .pattern()
        .map(|angles| [angles.theta_h, angles.theta_d, angles.phi_d])
        .collect();
    let initial: Vec<f32> = recipe.initial().iter().collect();
    let step_sizes: Vec<f32> = recipe.step_sizes().iter().collect();
    let provenance = recipe.provenance();
    json!({
        "model": recipe.model().name(),
        "samples": recipe.samples(),
        "inner_steps": recipe.inner_steps(),
        "pattern": pattern,
        "initial": initial,
        "step_sizes": step_sizes,
        "expected_loss": recipe.expected_loss(),
        "checksum": format!("{:08x}", recipe.checksum()),
        "provenance": {
            "trainer": provenance.trainer,
            "data": provenance.data,
            "materials": provenance.materials,
            "schedule": provenance.schedule,
            "seed": provenance.seed,
        },
    })
}
