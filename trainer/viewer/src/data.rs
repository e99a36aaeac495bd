//! Data of a page as JSON: recipes, readings and a reference material.

use std::sync::Arc;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glimpse_core::fit::Estimator;
use glimpse_core::geometry::{Angles, Arms, HalfDifference};
use glimpse_core::model::linear::Basis;
use glimpse_core::recipe::Recipe;
use glimpse_fitting::linear::{CHANNEL_COEFFICIENTS, material_basis};
use glimpse_fitting::recipe::RecipeFile;
use glimpse_materials::Material;
use glimpse_materials::loss::{coarse_directions, loss_between};
use serde_json::{Value, json};

use crate::{View, WASM};

/// A recipe and its readings.
#[derive(Clone, Debug)]
pub struct RecipeScan {
    /// Name of the recipe.
    pub name: String,
    /// The recipe.
    pub recipe: Arc<RecipeFile>,
    /// Basis of Linear, which maps coefficients to a BRDF; None for other models.
    pub basis: Option<Vec<u8>>,
    /// Readings at the recipe's samples: the BRDF in linear RGB, sr^-1, not times the cosine. None is a missing
    /// reading.
    pub readings: Vec<Option<[f32; 3]>>,
    /// Direction to read next, if there is one.
    pub next: Option<Angles<f32>>,
}

/// A reference material for the fits.
#[derive(Clone, Debug)]
pub struct Reference {
    name: String,
    table: Vec<u8>,
    /// Loss of the displayed table against the material.
    pub table_loss: f64,
    /// Angles and BRDF values, little-endian.
    reference_values: Vec<u8>,
}

impl Reference {
    /// Tabulates a material in 302 kB for display, and samples its BRDF at about 10,000 directions for the loss.
    #[must_use]
    pub fn new(material: &dyn Material) -> Self {
        let table = material_basis(material);
        let parsed = Basis::parse(&table).ok();
        let tabulated = |at: &HalfDifference<f32>| {
            let basis = parsed.as_ref();
            basis
                .and_then(|basis| basis.brdf(CHANNEL_COEFFICIENTS, at))
                .unwrap_or([f32::NAN; 3])
        };
        let table_loss = loss_between(&tabulated, material);
        let mut reference_values = Vec::new();
        for angles in coarse_directions() {
            let numbers = [angles.to_array(), material.at_angles(angles)];
            reference_values.extend(numbers.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
        }
        Self {
            name: material.name().to_owned(),
            table,
            table_loss,
            reference_values,
        }
    }

    fn to_json(&self) -> Value {
        json!({
            "name": self.name,
            "table": STANDARD.encode(&self.table),
            "table_loss": self.table_loss,
            "judge": STANDARD.encode(&self.reference_values),
        })
    }
}

impl RecipeScan {
    fn to_json(&self) -> Value {
        let recipe = self.recipe.recipe();
        let training = self.recipe.metadata().training.as_ref();
        let samples = recipe
            .pattern()
            .zip(&self.readings)
            .map(|(angles, reading)| {
                let mut sample = arms_in_degrees(angles);
                sample["brdf"] = json!(reading);
                sample
            });
        let samples: Vec<Value> = samples.collect();
        json!({
            "name": self.name,
            "model": recipe.model().name(),
            "how": method_summary(&recipe),
            "takes_missing": recipe.tolerates_missing(),
            "expected_loss": recipe.expected_loss(),
            "trained_on": training.map(|training| &training.data),
            "recipe": STANDARD.encode(self.recipe.bytes()),
            "basis": self.basis.as_ref().map(|basis| STANDARD.encode(basis)),
            "samples": samples,
            "next": self.next.map(arms_in_degrees),
        })
    }
}

/// Returns the polar angles of light and sensor, and the azimuth of the sensor from that of the light.
fn arms_in_degrees(angles: Angles<f32>) -> Value {
    let directions = HalfDifference::from_angles(angles).directions();
    let arms = Arms::from_directions(&directions);
    let phi = arms.phi_o - arms.phi_i;
    let [theta_i, theta_o, phi] = [arms.theta_i, arms.theta_o, phi].map(f32::to_degrees);
    json!({ "theta_i": theta_i, "theta_o": theta_o, "phi": phi })
}

/// Returns a short description of a recipe's fit method.
fn method_summary(recipe: &Recipe<'_>) -> String {
    let estimator = recipe.estimator();
    match estimator {
        Estimator::Sgd(sgd) => format!("{} steps of SGD", sgd.steps),
        Estimator::Ridge { .. } if estimator.net().is_some() => "completed readings".to_owned(),
        Estimator::Ridge { coefficients, .. } => {
            format!("{} components, solved", coefficients.components())
        }
    }
}

impl View {
    /// Returns the JSON for the page's scripts, with `<` escaped so that it cannot contain markup.
    pub(crate) fn to_json(&self) -> String {
        let scans: Vec<Value> = self.scans.iter().map(RecipeScan::to_json).collect();
        let data = json!({
            "title": self.title,
            "wasm": STANDARD.encode(WASM),
            "reference": self.reference.as_ref().map(Reference::to_json),
            "shown": scans,
        });
        data.to_string().replace('<', "\\u003c")
    }
}
