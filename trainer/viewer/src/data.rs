//! What a page is given: recipes, readings, a material, as JSON.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glimpse_core::geometry::{ArmAngles, HalfDifference};
use glimpse_core::model::linear::Basis;
use glimpse_core::recipe::{FitMethod, Recipe, RecipeError};
use glimpse_materials::Material;
use glimpse_materials::loss::{fewer_directions, loss_between};
use glimpse_training::linear::{CHANNELS, SINGLE_NODES, single_material};
use serde_json::{Value, json};

use crate::{View, WASM};

/// A recipe, and what was read by it.
#[derive(Clone, Debug)]
pub struct Shown {
    /// What it is called.
    pub name: String,
    /// The recipe's bytes.
    pub recipe: Vec<u8>,
    /// Of Linear the compact basis that makes a BRDF of coefficients.
    pub basis: Option<Vec<u8>>,
    /// What was read at each of its samples, the BRDF in linear RGB and sr^-1, not times the cosine; None
    /// where a reading is missing.
    pub readings: Vec<Option<[f32; 3]>>,
}

/// A material that fits are compared with.
#[derive(Clone, Debug)]
pub struct Reference {
    name: String,
    table: Vec<u8>,
    table_loss: f64,
    judge: Vec<f32>,
}

impl Reference {
    /// Of a material: a table of 302 kB to look at, and the BRDF at some 10,000 directions to judge by.
    #[must_use]
    pub fn new(material: &dyn Material) -> Self {
        let table = single_material(material, SINGLE_NODES);
        let parsed = Basis::parse(&table).ok();
        let tabulated = |at: &HalfDifference<f32>| {
            let basis = parsed.as_ref();
            basis
                .and_then(|basis| basis.brdf(CHANNELS, at))
                .unwrap_or_default()
        };
        let table_loss = loss_between(&tabulated, material);
        let mut judge = Vec::new();
        for angles in fewer_directions() {
            judge.extend([angles.theta_h, angles.theta_d, angles.phi_d]);
            judge.extend(material.brdf(angles));
        }
        Self {
            name: material.name().to_owned(),
            table,
            table_loss,
            judge,
        }
    }

    /// The loss of the table against the material: how far what is looked at is from what is judged by.
    #[must_use]
    pub fn table_loss(&self) -> f64 {
        self.table_loss
    }

    fn to_json(&self) -> Value {
        let judge: Vec<u8> = self
            .judge
            .iter()
            .flat_map(|number| number.to_le_bytes())
            .collect();
        json!({
            "name": self.name,
            "table": STANDARD.encode(&self.table),
            "table_loss": self.table_loss,
            "judge": STANDARD.encode(judge),
        })
    }
}

impl Shown {
    fn to_json(&self) -> Result<Value, RecipeError> {
        let recipe = Recipe::parse(&self.recipe)?;
        let samples = recipe.pattern().zip(&self.readings).map(|(angles, reading)| {
            let directions = HalfDifference::from_angles(angles).directions();
            let ArmAngles { incoming, outgoing } = ArmAngles::from_directions(&directions);
            let phi = outgoing.phi - incoming.phi;
            let degrees = [incoming.theta, outgoing.theta, phi].map(f32::to_degrees);
            json!({ "theta_i": degrees[0], "theta_o": degrees[1], "phi": degrees[2], "brdf": reading })
        });
        let samples: Vec<Value> = samples.collect();
        Ok(json!({
            "name": self.name,
            "model": recipe.model().name(),
            "how": how(&recipe),
            "takes_missing": recipe.tolerates_missing(),
            "expected_loss": recipe.expected_loss(),
            "trained_on": recipe.metadata()?.provenance.map(|provenance| provenance.data),
            "recipe": STANDARD.encode(&self.recipe),
            "basis": self.basis.as_ref().map(|basis| STANDARD.encode(basis)),
            "samples": samples,
        }))
    }
}

/// How a recipe fits, in a few words.
fn how(recipe: &Recipe<'_>) -> String {
    match recipe.method() {
        FitMethod::Descent(descent) => format!("{} steps of SGD", descent.inner_steps()),
        FitMethod::Ridge(ridge) => format!("{} components, solved", ridge.components()),
        FitMethod::Completed(_) => "completed readings".to_owned(),
    }
}

impl View {
    /// What the page's scripts read; no markup can come of it.
    pub(crate) fn to_json(&self) -> String {
        // Recipes were parsed by whoever made this; one that is none is not shown.
        let shown: Vec<Value> = self
            .shown
            .iter()
            .filter_map(|shown| shown.to_json().ok())
            .collect();
        let data = json!({
            "title": self.title,
            "wasm": STANDARD.encode(WASM),
            "reference": self.reference.as_ref().map(Reference::to_json),
            "shown": shown,
        });
        data.to_string().replace('<', "\\u003c")
    }
}
