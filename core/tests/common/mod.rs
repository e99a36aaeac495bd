//! Small recipes for tests, with every ingredient in the open.

use glimpse_core::model::{Model, ModelKind, Neural};
use glimpse_core::recipe::{
    Expectation, Ingredients, PackedDescent, PackedLearner, PackedRidge, Provenance, Recipe,
    RecipeError,
};

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
    write_with(
        &numbers.pattern,
        PackedLearner::Descent(PackedDescent {
            model: numbers.model,
            inner_steps: numbers.inner_steps,
            initial: &bytes(&numbers.initial),
            step_sizes: &bytes(&numbers.step_sizes),
        }),
        numbers.expected_loss,
    )
}

fn write_with(
    pattern: &[f32],
    learner: PackedLearner<'_>,
    expected_loss: f32,
) -> Result<Vec<u8>, RecipeError> {
    let pattern = bytes(pattern);
    let ingredients = Ingredients {
        expectation: Some(Expectation {
            loss: expected_loss,
            standard_error: Some(0.001),
            materials: 10,
            on: "nothing",
        }),
        provenance: Some(Provenance {
            trainer: "test",
            data: "none",
            materials: 0,
            schedule: "none",
            seed: 0,
            options: "none",
        }),
        ..Ingredients::new(&pattern, learner)
    };
    let mut buffer = vec![0; 64 * 1024];
    Recipe::write(&ingredients, &mut buffer).map(<[u8]>::to_vec)
}

/// What goes into a recipe of the model Linear, as numbers.
#[derive(Clone, Debug)]
pub(crate) struct RidgeNumbers {
    /// (theta_h, theta_d, phi_d) in radians, one after the other.
    pub(crate) pattern: Vec<f32>,
    /// m.
    pub(crate) components: u16,
    /// n rows of m.
    pub(crate) basis: Vec<f32>,
    /// n.
    pub(crate) mean: Vec<f32>,
    /// n, BRDF.
    pub(crate) median: Vec<f32>,
    /// n.
    pub(crate) weight: Vec<f32>,
    /// m.
    pub(crate) precision: Vec<f32>,
    /// The CRC-32 of the whole basis.
    pub(crate) basis_checksum: u32,
    /// The loss to expect.
    pub(crate) expected_loss: f32,
}

/// A valid Linear recipe: the same eight samples, five components.
pub(crate) fn linear() -> RidgeNumbers {
    let Numbers {
        pattern,
        expected_loss,
        ..
    } = neural();
    let spread = |index: usize| (index as f32 * 0.618_034).fract() - 0.5;
    RidgeNumbers {
        pattern,
        components: 5,
        basis: (1..=40).map(|k| 12.0 * spread(k)).collect(),
        mean: (0..8).map(|k| 0.1 * spread(k)).collect(),
        median: (0..8).map(|k| 0.1 * k as f32).collect(),
        weight: (0..8).map(|k| 0.9 - 0.1 * k as f32).collect(),
        precision: vec![40.0; 5],
        basis_checksum: 0xfeed_beef,
        expected_loss,
    }
}

/// Writes them as a recipe.
pub(crate) fn write_linear(numbers: &RidgeNumbers) -> Result<Vec<u8>, RecipeError> {
    write_with(
        &numbers.pattern,
        PackedLearner::Ridge(PackedRidge {
            components: numbers.components,
            basis: &bytes(&numbers.basis),
            mean: &bytes(&numbers.mean),
            median: &bytes(&numbers.median),
            weight: &bytes(&numbers.weight),
            precision: &bytes(&numbers.precision),
            basis_checksum: numbers.basis_checksum,
        }),
        numbers.expected_loss,
    )
}
