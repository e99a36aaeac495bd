//! Data of a page as JSON: recipes or fits, readings, and a reference material.

use std::sync::Arc;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glimpse_core::fit::Estimator;
use glimpse_core::geometry::Angles;
use glimpse_core::recipe::Recipe;
use glimpse_fitting::measurement::{MaterialFit, SampleReading};
use glimpse_fitting::recipe::RecipeFile;
use glimpse_fitting::route::relative_arms;
use glimpse_materials::Material;
use glimpse_materials::loss::coarse_directions;
use serde::Serialize;
use serde_json::{Value, json};

use crate::table::{fit_to_json, tabulate};
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
    /// The readings.
    pub samples: Vec<SampleReading>,
    /// Fit of the readings to display; None if the page fits those of the recipe's samples.
    pub fit: Option<MaterialFit>,
    /// Direction to read next, if there is one.
    pub next: Option<Angles<f32>>,
}

/// A reference material for the fits.
#[derive(Clone, Debug, Serialize)]
pub struct Reference {
    name: String,
    /// The displayed table, in base64.
    table: String,
    /// Loss of the displayed table against the material.
    pub table_loss: f64,
    /// Angles and BRDF values, little-endian, in base64.
    judge: String,
}

impl Reference {
    /// Tabulates a material for display, and samples its BRDF at about 10,000 directions for the loss.
    #[must_use]
    pub fn new(material: &dyn Material) -> Self {
        let (table, table_loss) = tabulate(material);
        let mut reference_values = Vec::new();
        for angles in coarse_directions() {
            let numbers = [angles.to_array(), material.at_angles(angles)];
            reference_values.extend(numbers.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
        }
        Self {
            name: material.name().to_owned(),
            table: STANDARD.encode(table),
            table_loss,
            judge: STANDARD.encode(reference_values),
        }
    }
}

impl RecipeScan {
    fn to_json(&self) -> Value {
        let recipe = self.recipe.recipe();
        let training = self.recipe.metadata().training.as_ref();
        let samples = self.samples.iter().map(|reading| {
            let mut sample = arms_in_degrees(reading.angles);
            sample["brdf"] = json!(reading.brdf.mean());
            sample["is_used"] = json!(reading.used().is_some());
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
            "recipe": self.fit.is_none().then(|| STANDARD.encode(self.recipe.bytes())),
            "basis": self.basis.as_ref().map(|basis| STANDARD.encode(basis)),
            "fit": self.fit.as_ref().map(fit_to_json),
            "samples": samples,
            "next": self.next.map(arms_in_degrees),
        })
    }
}

/// Returns the polar angles of light and sensor, and the azimuth of the sensor from that of the light.
fn arms_in_degrees(angles: Angles<f32>) -> Value {
    let arms = relative_arms(angles);
    json!({ "theta_i": arms.theta_i, "theta_o": arms.theta_o, "phi": arms.phi_o })
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
            "reference": self.reference,
            "shown": scans,
        });
        data.to_string().replace('<', "\\u003c")
    }
}
