//! The conversion of a learned fit to the bytes of a recipe.

use glimpse_core::geometry::Angles;
use glimpse_core::recipe::{
    Field, PackedCoefficientNet, PackedCorrection, PackedDescent, PackedGaussNewton, PackedInitNet,
    PackedMethod, PackedRidge, PackedTarget, RecipeError,
};
use glimpse_kernels::completion::split_lists;

use super::quantize::quantize;
use crate::linear::RecipeBasis;
use crate::meta::learned::{
    CompletionTarget, LearnedCoefficientNet, LearnedCorrection, LearnedDescent, LearnedFit,
    LearnedRefinement, LearnedSteps,
};

/// Packs a learned fit and passes it to `write`.
///
/// # Errors
/// Fails if a count exceeds the format's limit, or if `write` fails.
pub fn pack_fit<T>(
    fit: &LearnedFit,
    write: impl FnOnce(PackedMethod<'_>) -> Result<T, RecipeError>,
) -> Result<T, RecipeError> {
    match fit {
        LearnedFit::Descent(learned) => {
            pack_descent(learned, |descent| write(PackedMethod::Descent(descent)))
        }
        LearnedFit::Ridge(basis) => pack_ridge(basis, |ridge| write(PackedMethod::Ridge(ridge))),
        LearnedFit::Completed(learned, correction, target) => {
            pack_completed(learned, correction, target, write)
        }
    }
}

/// Packs a pattern as little-endian bytes: theta_h, theta_d and phi_d of each sample, in radians.
#[must_use]
pub fn pack_pattern(pattern: &[Angles<f32>]) -> Vec<u8> {
    let coordinates = pattern
        .iter()
        .flat_map(|angles| [angles.theta_h, angles.theta_d, angles.phi_d]);
    coordinates.flat_map(f32::to_le_bytes).collect()
}

/// Packs numbers as little-endian bytes.
pub(super) fn pack_values(values: &[f32]) -> Vec<u8> {
    values.iter().copied().flat_map(f32::to_le_bytes).collect()
}

fn pack_descent<T>(
    learned: &LearnedDescent,
    write: impl FnOnce(PackedDescent<'_>) -> Result<T, RecipeError>,
) -> Result<T, RecipeError> {
    write(PackedDescent {
        model: learned.model,
        inner_steps: u16::try_from(learned.inner_steps)
            .map_err(|_| RecipeError::Count(Field::InnerSteps))?,
        initial: &pack_values(&learned.initial),
        step_sizes: &pack_values(&learned.step_sizes),
    })
}

fn pack_ridge<T>(
    basis: &RecipeBasis,
    write: impl FnOnce(PackedRidge<'_>) -> Result<T, RecipeError>,
) -> Result<T, RecipeError> {
    write(PackedRidge {
        components: u16::try_from(basis.precision.len())
            .map_err(|_| RecipeError::Count(Field::Components))?,
        basis: &pack_values(&basis.basis),
        mean: &pack_values(&basis.mean),
        median: &pack_values(&basis.median),
        weight: &pack_values(&basis.weight),
        precision: &pack_values(&basis.precision),
        basis_checksum: basis.basis_checksum,
    })
}

fn pack_completed<T>(
    learned: &LearnedCoefficientNet,
    learned_correction: &LearnedCorrection,
    target: &CompletionTarget,
    write: impl FnOnce(PackedMethod<'_>) -> Result<T, RecipeError>,
) -> Result<T, RecipeError> {
    let shape = learned.shape;
    let (outputs, components) = (shape.rows(), shape.components);
    let [reading_weights, bias, output] =
        split_lists(&learned.weights, shape.coefficient_net_lengths());
    let (reading_weights, reading_scales) =
        quantize(reading_weights, outputs, |index| index % outputs);
    let (output, output_scales) = quantize(output, components, |index| index / shape.hidden);
    let [center, reading_scales, bias, output_scales] =
        [&learned.center[..], &reading_scales, bias, &output_scales].map(pack_values);
    let coefficient_net = PackedCoefficientNet {
        components: u16::try_from(components).map_err(|_| RecipeError::Count(Field::Components))?,
        missing: learned.missing as u8,
        center: &center,
        scale: learned.scale,
        readings: &reading_weights,
        reading_scales: &reading_scales,
        bias: &bias,
        output: &output,
        output_scales: &output_scales,
        rows: &[],
        row_scales: &[],
        basis_checksum: 0,
    };
    let corrected = learned_correction.precision.len();
    let (rows, row_scales) = quantize(&learned_correction.rows, corrected, |index| {
        index % corrected
    });
    let [row_scales, precision] = [&row_scales[..], &learned_correction.precision].map(pack_values);
    let correction = PackedCorrection {
        rows: &rows,
        row_scales: &row_scales,
        precision: &precision,
    };
    match target {
        CompletionTarget::Linear { basis_checksum } => {
            let coefficient_net = PackedCoefficientNet {
                basis_checksum: *basis_checksum,
                ..coefficient_net
            };
            let target = PackedTarget::Linear;
            write(PackedMethod::Completed(
                coefficient_net,
                Some(correction),
                target,
            ))
        }
        CompletionTarget::Refinement(refinement, init_net) => {
            let [hidden, bias, output] = split_lists(init_net, shape.init_net_lengths());
            let inputs = 3 * components;
            let (hidden, hidden_scales) = quantize(hidden, shape.units, |index| index / inputs);
            let units = shape.units;
            let (output, output_scales) = quantize(output, shape.parameters, |index| index / units);
            let [hidden_scales, bias, output_scales] =
                [&hidden_scales[..], bias, &output_scales].map(pack_values);
            let init_net = PackedInitNet {
                hidden: &hidden,
                hidden_scales: &hidden_scales,
                bias: &bias,
                output: &output,
                output_scales: &output_scales,
            };
            match refinement {
                LearnedRefinement::Descent(descent) => pack_descent(descent, |descent| {
                    let target = PackedTarget::Descent(descent, init_net);
                    write(PackedMethod::Completed(
                        coefficient_net,
                        Some(correction),
                        target,
                    ))
                }),
                LearnedRefinement::GaussNewton(steps) => pack_steps(steps, corrected, |steps| {
                    let target = PackedTarget::GaussNewton(steps, init_net);
                    write(PackedMethod::Completed(
                        coefficient_net,
                        Some(correction),
                        target,
                    ))
                }),
            }
        }
    }
}

fn pack_steps<T>(
    learned: &LearnedSteps,
    components: usize,
    write: impl FnOnce(PackedGaussNewton<'_>) -> Result<T, RecipeError>,
) -> Result<T, RecipeError> {
    let (rows, scales) = quantize(&learned.rows, components, |index| index % components);
    write(PackedGaussNewton {
        model: learned.model,
        steps: u16::try_from(learned.steps).map_err(|_| RecipeError::Count(Field::StepCount))?,
        initial: &pack_values(&learned.initial),
        precision: &pack_values(&learned.precision),
        reading_weight: learned.reading_weight,
        error_scale: learned.error_scale,
        directions: &pack_pattern(&learned.directions),
        center: &pack_values(&learned.center),
        rows: &rows,
        row_scales: &pack_values(&scales),
    })
}
