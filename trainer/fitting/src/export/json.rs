//! Export of a recipe as JSON, complete enough to reimplement the fit.

use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::fit::{Coefficients, Estimator, Net, Prediction, Refinement, Sgd};
use glimpse_core::geometry::Arms;
use glimpse_core::numeric::{ComponentRows, Floats, Rows};
use glimpse_core::recipe::Recipe;
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
/// The other keys are the stages of the fit, as `core/docs/recipe.md` describes them.
/// - SGD: `inner_steps`, and `initial` parameters and `step_sizes` in the model's order.
/// - The ridge stage: `basis` (n rows of K), `centre` (n), and `basis_checksum` of the whole basis (null if there is
///   none). The precisions are `eta` if all are equal, and `precision` (K) otherwise. `difference_precision` (K) is null
///   if it is the same.
/// - `completion`: the net before it, if there is one.
/// - `initial`, `gauss_newton` and `start`: the stages after it, except for Linear.
/// - `prediction` has a bias and m weights, `uncertainty` has `innovation`, `residual`, `bound` and `max_innovation`, and
///   `partial` has `loss` and `bound` for 1 to n readings. They are null if the recipe has none.
///
/// `completion` has these keys; m is the number of its coefficients, and h that of hidden units:
/// - `components`: m.
/// - `takes_missing`: true if readings may be missing; the remaining ones are then multiplied by a factor.
/// - `scale`: the factor of the centered inputs.
/// - `readings`: for each sample, the weights `own`, `mean` and `missing` (m + h each).
/// - `bias` (m + h).
/// - `output` (m rows of h).
///
/// `start` has `hidden` (g rows of 3 K, where g is the number of hidden units), `bias` (g) and `output` (one row of g
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
        .map(|(_, directions)| Arms::from_directions(&directions).to_array())
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
    match recipe.estimator() {
        Estimator::Sgd(sgd) => add_sgd(&mut value, sgd),
        Estimator::Ridge {
            coefficients,
            refinement,
            prediction,
        } => {
            add_ridge(&mut value, coefficients);
            if let Some(net) = &coefficients.net {
                value["completion"] = completion(net);
            }
            if let Some(refinement) = refinement {
                add_refinement(&mut value, refinement, coefficients.components());
            }
            add_prediction(&mut value, prediction.as_ref());
        }
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

/// Returns the training of a recipe, with a hexadecimal digest.
#[must_use]
pub fn training(training: &Training) -> Value {
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

fn add_sgd(value: &mut Value, sgd: &Sgd<'_>) {
    value["inner_steps"] = json!(sgd.steps);
    value["initial"] = list(sgd.initial);
    value["step_sizes"] = list(sgd.step_sizes);
}

fn add_ridge(value: &mut Value, coefficients: &Coefficients<'_>) {
    let ridge = &coefficients.ridge;
    let (samples, components) = (ridge.center.len(), coefficients.components());
    value["basis"] = component_rows(coefficients.rows(), [samples, components]);
    value["centre"] = list(ridge.center);
    value["precision"] = list(ridge.precision);
    value["difference_precision"] = optional(ridge.difference_precision);
    let checksum = Some(ridge.basis_checksum).filter(|checksum| *checksum != 0);
    value["basis_checksum"] = json!(checksum.map(|checksum| format!("{checksum:08x}")));
}

fn completion(net: &Net<'_>) -> Value {
    let weights = net.weights();
    let rows = weights.rows();
    let scales = floats(weights.scales);
    let readings = scaled_weights(weights.readings, &|index| scales[index % rows]);
    let columns: Vec<&[f32]> = readings.chunks(rows).collect();
    let samples: Vec<Value> = columns
        .chunks(3)
        .map(|columns| json!({ "own": columns[0], "mean": columns[1], "missing": columns[2] }))
        .collect();
    let hidden = weights.hidden().max(1);
    let scales = floats(weights.output_scales);
    let output = scaled_weights(weights.output, &|index| scales[index / hidden]);
    json!({
        "components": weights.components,
        "takes_missing": net.missing() != MissingPolicy::AllRequired,
        "scale": net.scale,
        "readings": samples,
        "bias": floats(weights.bias),
        "output": output.chunks(hidden).collect::<Vec<_>>(),
    })
}

fn add_refinement(value: &mut Value, refinement: &Refinement<'_>, components: usize) {
    let steps = &refinement.steps;
    value["initial"] = list(steps.initial);
    value["gauss_newton"] = json!({
        "steps": steps.steps,
        "precision": list(steps.precision),
        "reading_weight": steps.reading_weight,
        "error_scale": steps.error_scale,
        "directions": steps.directions.triples().collect::<Vec<_>>(),
        "center": list(steps.center),
        "rows": component_rows(steps.rows.of(components), [steps.virtual_readings(), components]),
    });
    let start = refinement.start.weights();
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

fn add_prediction(value: &mut Value, prediction: Option<&Prediction<'_>>) {
    value["prediction"] = json!(prediction.map(|each| list(each.weights)));
    value["uncertainty"] = json!(prediction.map(|each| json!({
        "innovation": each.innovation,
        "residual": each.residual,
        "bound": each.bound,
        "max_innovation": each.max_innovation,
    })));
    let partial = prediction.filter(|each| !each.partial_bound.is_empty());
    value["partial"] = json!(partial.map(|each| {
        json!({ "loss": list(each.partial_loss), "bound": list(each.partial_bound) })
    }));
}

/// Returns the components at each of some directions, as in the fit.
fn component_rows(components: ComponentRows<'_>, [rows, columns]: [usize; 2]) -> Value {
    let row = |row| {
        (0..columns)
            .map(|column| components.entry(row, column))
            .collect()
    };
    let rows: Vec<Vec<f32>> = (0..rows).map(row).collect();
    json!(rows)
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

/// Returns a list, or null if it is empty.
fn optional(floats: Floats<'_>) -> Value {
    json!(Some(floats).filter(|floats| !floats.is_empty()).map(list))
}

fn list(floats: Floats<'_>) -> Value {
    json!(floats.iter().collect::<Vec<f32>>())
}
