//! A small recipe for tests, with every ingredient in the open.

use glimpse_core::model::{Model, ModelKind, Neural};
use glimpse_core::recipe::{Ingredients, Provenance, Recipe, RecipeError};

/// What goes into a recipe, as numbers.
#[derive(Clone, Debug)]
pub(crate) struct Numbers {
    /// The model.
    pub(crate) model: ModelKind,
    /// SGD steps.
    pub(crate) inner_steps: u16,
    /// (theta_h, theta_d, phi_d) in radians, one after the other.
    pub(crate) pattern: Vec<f32>,
    /// Initial parameters.
    pub(crate) initial: Vec<f32>,
    /// A step size for each.
    pub(crate) step_sizes: Vec<f32>,
    /// The loss to expect.
    pub(crate) expected_loss: f32,
}

/// A valid Neural recipe: eight samples, small weights, small steps.
pub(crate) fn neural() -> Numbers {
    // Low-discrepancy numbers: no two alike, no generator needed.
    let spread = |index: usize| (index as f32 * 0.618_034).fract() - 0.5;
    Numbers {
        model: ModelKind::Neural,
        inner_steps: 20,
        pattern: (0..8)
            .flat_map(|k| {
                let k = k as f32;
                [0.05 + 0.08 * k, 0.1 + 0.07 * k, 0.4 * k]
            })
            .collect(),
        initial: (0..Neural::PARAMETERS).map(|k| 0.4 * spread(k)).collect(),
        step_sizes: (0..Neural::PARAMETERS)
            .map(|k| 0.05 + 0.02 * spread(k))
            .collect(),
        expected_loss: 0.03,
    }
}

/// Numbers as a recipe packs them.
fn bytes(numbers: &[f32]) -> Vec<u8> {
    numbers
        .iter()
        .flat_map(|number| number.to_le_bytes())
        .collect()
}

/// Writes them as a recipe.
pub(crate) fn write(numbers: &Numbers) -> Result<Vec<u8>, RecipeError> {
    let ingredients = Ingredients {
        model: numbers.model,
        inner_steps: numbers.inner_steps,
        pattern: &bytes(&numbers.pattern),
        initial: &bytes(&numbers.initial),
        step_sizes: &bytes(&numbers.step_sizes),
        expected_loss: numbers.expected_loss,
        provenance: Provenance {
            trainer: "test",
            data: "none",
            materials: 0,
            schedule: "none",
            seed: 0,
        },
    };
    let mut buffer = vec![0; 64 * 1024];
    Recipe::write(&ingredients, &mut buffer).map(<[u8]>::to_vec)
}
