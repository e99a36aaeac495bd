//! The one conversion of what was learned to the bytes of a recipe.

use glimpse_core::geometry::Angles;
use glimpse_core::recipe::{
    Field, PackedCoefficientNet, PackedDescent, PackedInitNet, PackedMethod, PackedRidge,
    RecipeError,
};
use glimpse_kernels::completion::split_lists;

use super::quantize::quantized;
use crate::linear::ReducedBasis;
use crate::meta::learned::{CompletionTarget, LearnedCompletion, LearnedDescent, LearnedFit};

/// Packs a learned fit, and passes it to `write`.
///
/// # Errors
/// If a count is more than the format holds, and those of `write`.
pub fn packed_fit<T>(
    fit: &LearnedFit,
    write: impl FnOnce(PackedMethod<'_>) -> Result<T, RecipeError>,
) -> Result<T, RecipeError> {
    match fit {
        LearnedFit::Descent(learned) => {
            packed_descent(learned, |descent| write(PackedMethod::Descent(descent)))
        }
        LearnedFit::Ridge(reduced) => {
            packed_ridge(reduced, |ridge| write(PackedMethod::Ridge(ridge)))
        }
        LearnedFit::Completed(completion, target) => packed_completion(completion, target, write),
    }
}

/// Packs a pattern.
#[must_use]
pub fn packed_pattern(pattern: &[Angles<f32>]) -> Vec<u8> {
    let coordinates = pattern
        .iter()
        .flat_map(|angles| [angles.theta_h, angles.theta_d, angles.phi_d]);
    coordinates.flat_map(f32::to_le_bytes).collect()
}

pub(super) fn packed(values: &[f32]) -> Vec<u8> {
    values.iter().copied().flat_map(f32::to_le_bytes).collect()
}

fn packed_descent<T>(
    learned: &LearnedDescent,
    write: impl FnOnce(PackedDescent<'_>) -> Result<T, RecipeError>,
) -> Result<T, RecipeError> {
    write(PackedDescent {
        model: learned.model,
        inner_steps: u16::try_from(learned.inner_steps)
            .map_err(|_| RecipeError::Count(Field::InnerSteps))?,
        initial: &packed(&learned.initial),
        step_sizes: &packed(&learned.step_sizes),
    })
}

fn packed_ridge<T>(
    reduced: &ReducedBasis,
    write: impl FnOnce(PackedRidge<'_>) -> Result<T, RecipeError>,
) -> Result<T, RecipeError> {
    write(PackedRidge {
        components: u16::try_from(reduced.precision.len())
            .map_err(|_| RecipeError::Count(Field::Components))?,
        basis: &packed(&reduced.basis),
        mean: &packed(&reduced.mean),
        median: &packed(&reduced.median),
        weight: &packed(&reduced.weight),
        precision: &packed(&reduced.precision),
        basis_checksum: reduced.basis_checksum,
    })
}

fn packed_completion<T>(
    learned: &LearnedCompletion,
    target: &CompletionTarget,
    write: impl FnOnce(PackedMethod<'_>) -> Result<T, RecipeError>,
) -> Result<T, RecipeError> {
    let shape = learned.shape;
    let (rows, components) = (shape.rows(), shape.components);
    let [readings, bias, output] = split_lists(&learned.weights, shape.completion_lengths());
    let (readings, reading_scales) = quantized(readings, rows, |index| index % rows);
    let hidden = shape.hidden.max(1);
    let (output, output_scales) = quantized(output, components, |index| index / hidden);
    let [center, reading_scales, bias, output_scales] =
        [&learned.center[..], &reading_scales, bias, &output_scales].map(packed);
    let completion = PackedCoefficientNet {
        components: u16::try_from(components).map_err(|_| RecipeError::Count(Field::Components))?,
        missing: learned.missing as u8,
        center: &center,
        scale: learned.scale,
        readings: &readings,
        reading_scales: &reading_scales,
        bias: &bias,
        output: &output,
        output_scales: &output_scales,
        rows: &[],
        row_scales: &[],
        basis_checksum: 0,
    };
    match target {
        CompletionTarget::Linear {
            rows,
            basis_checksum,
        } => {
            let (rows, scales) = quantized(rows, components, |index| index % components);
            let completion = PackedCoefficientNet {
                rows: &rows,
                row_scales: &packed(&scales),
                basis_checksum: *basis_checksum,
                ..completion
            };
            write(PackedMethod::Completed(completion, None))
        }
        CompletionTarget::Descent(descent, start) => {
            let [hidden, bias, output] = split_lists(start, shape.start_lengths());
            let inputs = 3 * components;
            let (hidden, hidden_scales) = quantized(hidden, shape.units, |index| index / inputs);
            let units = shape.units;
            let (output, output_scales) =
                quantized(output, shape.parameters, |index| index / units);
            let [hidden_scales, bias, output_scales] =
                [&hidden_scales[..], bias, &output_scales].map(packed);
            let start = PackedInitNet {
                hidden: &hidden,
                hidden_scales: &hidden_scales,
                bias: &bias,
                output: &output,
                output_scales: &output_scales,
            };
            packed_descent(descent, |descent| {
                write(PackedMethod::Completed(completion, Some((descent, start))))
            })
        }
    }
}
