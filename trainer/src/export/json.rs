//! Export of a recipe as JSON, complete enough to reimplement the fit.

use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::fit::component_rows::ComponentRows;
use glimpse_core::fit::{InitNet, Target};
use glimpse_core::geometry::ArmAngles;
use glimpse_core::recipe::{Completed, Descent, FitMethod, Floats, Recipe, Ridge};
use glimpse_materials::Identity;
use glimpse_training::recipe::{Metadata, MetadataError, Training};
use serde_json::{Value, json};

/// Converts a recipe to JSON.
///
/// All recipes have `model`, `samples` (n), `pattern` (rows of theta_h, theta_d, phi_d in radians), `arms` (the same
/// directions as rows of theta_i, phi_i, theta_o, phi_o in radians), `memory_words`, `expected_loss` and `checksum`.
///
/// The recipe's metadata are null if the recipe does not state them: `limits` (radians), `noise` (sr⁻¹), `scan_time`
/// (speeds of the four axes in degrees per second, and seconds), `expectation` (of the loss), `training` (with a
/// hexadecimal digest) and `materials` (names and hexadecimal digests).
///
/// The other keys depend on the fit method. m is the number of coefficients per channel.
/// - Descent: `inner_steps`, and `initial` parameters and `step_sizes` in the model's order.
/// - Ridge solve: `basis` (n rows of m), `mean`, `median` BRDF and `weight` (n each), and `basis_checksum` of the whole
///   basis (null if there is none). The precisions are `eta` if all are equal, and `precision` (m) otherwise.
/// - Completion: `prediction`, `uncertainty`, `partial` and `completion`. Linear adds `basis` (n rows of m) and
///   `basis_checksum`. The other models add the keys of a descent, or `initial` and `gauss_newton`, and `start`.
///   `correction` has the `precision` (m) of a correction by the readings.
///
/// `prediction` has a bias and m weights (null if there are none). They map the mean coefficients of the three channels
/// to the logarithm of the expected loss. `uncertainty` has `innovation`, `residual`, `bound` and `max_innovation`, and
/// `partial` has `loss` and `bound` for 1 to n readings. Both are null if the recipe has none.
///
/// `completion` has these keys; h is the number of hidden units:
/// - `components`: m.
/// - `takes_missing`: true if readings may be missing.
/// - `gain`: true if the remaining readings are multiplied by a factor when others are missing.
/// - `centre` (n) and `scale`: the center and the factor of the inputs.
/// - `readings`: for each sample, the weights `own`, `mean` and `missing` (m + h each).
/// - `bias` (m + h).
/// - `output` (m rows of h).
///
/// `start` has `hidden` (g rows of 3 m, where g is the number of hidden units), `bias` (g) and `output` (one row of g
/// per parameter).
///
/// # Errors
/// If the recipe's metadata are invalid.
pub fn to_json(recipe: &Recipe<'_>) -> Result<Value, MetadataError> {
    let metadata = Metadata::of(recipe)?;
    let pattern: Vec<[f32; 3]> = recipe
        .pattern()
        .map(|angles| [angles.theta_h, angles.theta_d, angles.phi_d])
        .collect();
    let arms: Vec<[f32; 4]> = recipe
        .directions()
        .map(|(_, directions)| {
            let ArmAngles { incoming, outgoing } = ArmAngles::from_directions(&directions);
            [incoming.theta, incoming.phi, outgoing.theta, outgoing.phi]
        })
        .collect();
    let mut value = json!({
        "model": recipe.model().name(),
        "samples": recipe.samples(),
        "pattern": pattern,
        "arms": arms,
        "memory_words": recipe.memory_words(),
        "expected_loss": recipe.expected_loss(),
        "checksum": format!("{:08x}", recipe.checksum()),
        "limits": metadata.limits,
        "noise": metadata.noise,
        "scan_time": metadata.scan_budget,
        "expectation": expectation(&metadata),
        "training": metadata.training.as_ref().map(training),
        "materials": materials(&metadata.materials),
    });
    match recipe.method() {
        FitMethod::Descent(descent) => add_descent(&mut value, &descent),
        FitMethod::Ridge(ridge) => add_ridge(&mut value, &ridge),
        FitMethod::Completed(completed) => add_completed(&mut value, &completed),
    }
    Ok(value)
}

/// Returns the expected loss and the materials that it was measured on; None if the recipe does not state them.
#[must_use]
pub fn expectation(metadata: &Metadata) -> Option<Value> {
    let expected = metadata.expected_loss?;
    Some(json!({
        "loss": expected.estimate.loss,
        "standard_error": expected.estimate.standard_error,
        "materials": expected.estimate.materials,
        "split": expected.split,
        "on": metadata.validation_materials(),
    }))
}

fn training(training: &Training) -> Value {
    let mut value = json!(training);
    value["digest"] = json!(format!("{:016x}", training.digest));
    value
}

fn materials(list: &[Identity]) -> Option<Vec<Value>> {
    let list: Vec<Value> = list
        .iter()
        .map(|each| json!({ "name": each.name, "digest": format!("{:08x}", each.digest) }))
        .collect();
    Some(list).filter(|list| !list.is_empty())
}

fn add_descent(value: &mut Value, descent: &Descent<'_>) {
    value["inner_steps"] = json!(descent.inner_steps());
    value["initial"] = list(descent.initial());
    value["step_sizes"] = list(descent.step_sizes());
}

fn add_completed(value: &mut Value, completed: &Completed<'_>) {
    let prediction = Some(completed.prediction()).filter(|list| !list.is_empty());
    value["prediction"] = json!(prediction.map(list));
    value["uncertainty"] = json!(completed.uncertainty());
    value["partial"] = json!(completed.partial().map(|partial| {
        json!({ "loss": list(partial.loss()), "bound": list(partial.bound()) })
    }));
    let completion = completed.coefficient_net();
    let (rows, components) = (completion.rows(), completion.components);
    let scales = floats(completion.scales);
    let readings = scaled_weights(completion.readings, &|index| scales[index % rows]);
    let columns: Vec<&[f32]> = readings.chunks(rows).collect();
    let samples: Vec<Value> = columns
        .chunks(3)
        .map(|columns| json!({ "own": columns[0], "mean": columns[1], "missing": columns[2] }))
        .collect();
    let hidden = completion.hidden().max(1);
    let scales = floats(completion.output_scales);
    let output = scaled_weights(completion.output, &|index| scales[index / hidden]);
    value["completion"] = json!({
        "components": components,
        "takes_missing": completed.tolerates_missing(),
        "gain": completed.missing() == MissingPolicy::Scaled,
        "centre": list(completed.center()),
        "scale": completed.scale(),
        "readings": samples,
        "bias": floats(completion.bias),
        "output": output.chunks(hidden).collect::<Vec<_>>(),
    });
    if let Some(at_samples) = completed.at_samples() {
        value["basis"] = component_rows(at_samples);
    }
    if let Some(correction) = completed.correction() {
        value["correction"] = json!({ "precision": list(correction.precision()) });
    }
    match completed.target() {
        Target::Linear(linear) => {
            value["basis_checksum"] = checksum(linear.basis_checksum());
        }
        Target::Descent(descent, start) => {
            add_descent(value, descent);
            add_start(value, start, components);
        }
        Target::GaussNewton(steps, start) => {
            let readings = steps.virtual_readings();
            let directions: Vec<[f32; 3]> = readings
                .directions()
                .iter()
                .map(|packed| {
                    let words = packed.as_chunks().0;
                    [words[0], words[1], words[2]].map(f32::from_le_bytes)
                })
                .collect();
            value["initial"] = list(steps.initial());
            value["gauss_newton"] = json!({
                "steps": steps.steps(),
                "precision": list(steps.precision()),
                "reading_weight": steps.reading_weight(),
                "error_scale": steps.error_scale(),
                "directions": directions,
                "center": list(readings.center()),
                "rows": component_rows(readings.components()),
            });
            add_start(value, start, components);
        }
    }
}

fn add_start(value: &mut Value, start: &InitNet<'_>, components: usize) {
    let (inputs, units) = (3 * components, start.units());
    let scales = floats(start.hidden_scales);
    let hidden = scaled_weights(start.hidden, &|index| scales[index / inputs]);
    let scales = floats(start.output_scales);
    let output = scaled_weights(start.output, &|index| scales[index / units]);
    value["start"] = json!({
        "hidden": hidden.chunks(inputs).collect::<Vec<_>>(),
        "bias": floats(start.bias),
        "output": output.chunks(units).collect::<Vec<_>>(),
    });
}

/// Returns the components at each of some directions, as in the fit.
fn component_rows(components: ComponentRows<'_>) -> Value {
    let scales: Vec<f32> = components.scales().iter().collect();
    let rows = scaled_weights(components.rows(), &|index| scales[index % scales.len()]);
    json!(rows.chunks(scales.len()).collect::<Vec<_>>())
}

/// Returns weights times their scales, as in the fit.
fn scaled_weights(bytes: &[u8], scale: &dyn Fn(usize) -> f32) -> Vec<f32> {
    let bytes = bytes.iter().enumerate();
    bytes
        .map(|(index, byte)| f32::from(byte.cast_signed()) * scale(index))
        .collect()
}

fn floats(words: &[[u8; 4]]) -> Vec<f32> {
    words.iter().map(|word| f32::from_le_bytes(*word)).collect()
}

fn checksum(checksum: Option<u32>) -> Value {
    json!(checksum.map(|checksum| format!("{checksum:08x}")))
}

fn add_ridge(value: &mut Value, ridge: &Ridge<'_>) {
    let basis: Vec<f32> = ridge.basis().iter().collect();
    let rows: Vec<&[f32]> = basis.chunks(ridge.components()).collect();
    value["basis"] = json!(rows);
    value["mean"] = list(ridge.mean());
    value["median"] = list(ridge.median());
    value["weight"] = list(ridge.weight());
    match eta(ridge) {
        Some(eta) => value["eta"] = json!(eta),
        None => value["precision"] = list(ridge.precision()),
    }
    value["basis_checksum"] = checksum(ridge.basis_checksum());
}

fn list(floats: Floats<'_>) -> Value {
    json!(floats.iter().collect::<Vec<f32>>())
}

/// Returns the paper's eta: the precision that all coefficients share; None if their precisions differ.
#[must_use]
pub fn eta(ridge: &Ridge<'_>) -> Option<f32> {
    let mut precision = ridge.precision().iter();
    let first = precision.next()?;
    precision.all(|next| next == first).then_some(first)
}
