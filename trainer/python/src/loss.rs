//! The loss between two BRDFs, at the trainer's directions.

use glimpse_core::geometry::HalfDifference;
use glimpse_materials::loss::mean_log_error_of_values;
use glimpse_materials::loss::{directions as loss_angles, loss_directions};
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::arrays::{Array, colors};
use crate::error::{Result, reject};
use crate::interruptible::run_detached;
use crate::material::{BATCH, PyMaterial};

/// Returns the 40,503 directions at which every loss is computed: unit vectors, incoming and outgoing, float64 of
/// shape (40503, 2, 3).
///
/// They are uniform in the Rusinkiewicz angles (theta_h, theta_d, phi_d) over the region where both directions are
/// above the horizon. They are not uniform over the hemisphere. Every call returns the same directions.
#[pyfunction]
pub(crate) fn directions() -> Array<f64> {
    Array::directions(loss_angles())
}

/// Returns the loss between a reference and a fitted BRDF: the mean over `directions()` and channels of
/// abs(ln(1 + y cos) - ln(1 + f cos)). y is the reference and f the fitted BRDF in linear RGB, sr^-1. cos is the cosine
/// of the incoming direction's polar angle. `evaluate` reports the same loss.
///
/// Each argument is a Material, or an array (40503, 3) of a BRDF at `directions()`, finite and nonnegative.
#[pyfunction]
pub(crate) fn loss(
    py: Python<'_>,
    reference: &Bound<'_, PyAny>,
    fitted: &Bound<'_, PyAny>,
) -> Result<f64> {
    let directions = loss_directions();
    let reference = values(py, reference, "reference", &directions)?;
    let fitted = values(py, fitted, "fitted", &directions)?;
    run_detached(py, || {
        mean_log_error_of_values(&fitted, &directions, &reference)
    })
}

/// Returns the values of a material at directions, or those of an array.
fn values(
    py: Python<'_>,
    argument: &Bound<'_, PyAny>,
    name: &str,
    directions: &[HalfDifference<f32>],
) -> Result<Vec<[f32; 3]>> {
    if let Ok(material) = argument.cast::<PyMaterial>() {
        let material = material.get().complete()?;
        let batches = directions.par_chunks(BATCH);
        return run_detached(py, || {
            let values = batches.flat_map_iter(|directions| material.values_at(directions));
            values.collect()
        });
    }
    let values = colors(argument, name, Some(directions.len()))?;
    for (row, rgb) in values.iter().enumerate() {
        let is_invalid = |value: &&f32| !(value.is_finite() && **value >= 0.0);
        if let Some(value) = rgb.iter().find(is_invalid) {
            return reject(format!(
                "{name}: row {row} holds {value}; a BRDF must be finite and nonnegative: correct the value"
            ));
        }
    }
    Ok(values)
}
