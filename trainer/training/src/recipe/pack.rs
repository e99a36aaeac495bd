//! The conversion of a training result to the bytes of a recipe.

use glimpse_core::geometry::Angles;
use glimpse_core::gonio::Limits;
use glimpse_core::recipe::{
    Field, PackedCoefficientNet, PackedCorrection, PackedDescent, PackedGaussNewton, PackedInitNet,
    PackedMethod, PackedPartialLoss, PackedRidge, PackedTarget, RecipeError, RecipeParts,
};
use glimpse_kernels::completion::split_lists;

use super::file::{RecipeDefect, RecipeFile};
use super::metadata::{Metadata, Noise, Training};
use super::quantize::quantize;
use crate::linear::RecipeBasis;
use crate::meta::learned::{
    CompletionTarget, LearnedCoefficientNet, LearnedCorrection, LearnedDescent, LearnedFit,
    LearnedRecipe, LearnedRefinement, LearnedSteps,
};
use crate::meta::options::{CompletionOptions, Options};
use crate::meta::plan::Schedule;

/// The training result is not a valid recipe.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "training did not converge to a valid recipe; train with another seed or with more materials"
)]
pub struct PackError(#[from] RecipeDefect);

/// Packs a training result and its metadata as a recipe. `data` is the name of the training materials.
///
/// # Errors
/// Fails if the result is not a valid recipe, for example if a number is not finite.
pub fn pack_recipe(
    learned: &LearnedRecipe,
    options: &Options,
    data: &str,
) -> Result<RecipeFile, PackError> {
    let completion_options =
        Some(&options.completion_options).filter(|_| options.schedule == Schedule::Prior);
    let metadata = Metadata {
        limits: completion_options
            .map(|each| each.limits)
            .filter(|limits| *limits != Limits::NONE),
        noise: completion_options
            .map(CompletionOptions::noise)
            .filter(|noise| *noise != Noise::default()),
        scan_budget: completion_options.and_then(|each| each.scan),
        expected_loss: Some(learned.expected_loss),
        training: Some(Training::new(options, data, learned.materials.len())),
        materials: learned.materials.clone(),
    };
    let loss_predictor = learned.loss_predictor.as_ref();
    let prediction = loss_predictor.map(|each| pack_values(&each.weights));
    let partial = loss_predictor.and_then(|each| each.partial.as_ref());
    let partial = partial.map(|each| [&each.loss, &each.bound].map(|list| pack_values(list)));
    let pattern = pack_pattern(&learned.pattern);
    let file = pack_fit(&learned.fit, |fit| {
        RecipeFile::write(&RecipeParts {
            expected_loss: Some(learned.expected_loss.estimate.loss),
            prediction: prediction.as_deref(),
            uncertainty: loss_predictor.map(|each| each.uncertainty),
            is_in_path_order: metadata.scan_budget.is_some(),
            partial: partial
                .as_ref()
                .map(|[loss, bound]| PackedPartialLoss { loss, bound }),
            metadata: &metadata.to_bytes(),
            ..RecipeParts::new(&pattern, fit)
        })
    });
    Ok(file?)
}

/// Packs a learned fit and passes it to `write`.
///
/// # Errors
/// Fails if a count exceeds the format's limit, or if `write` fails.
pub fn pack_fit<T, E: From<RecipeError>>(
    fit: &LearnedFit,
    write: impl FnOnce(PackedMethod<'_>) -> Result<T, E>,
) -> Result<T, E> {
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

fn pack_descent<T, E: From<RecipeError>>(
    learned: &LearnedDescent,
    write: impl FnOnce(PackedDescent<'_>) -> Result<T, E>,
) -> Result<T, E> {
    write(PackedDescent {
        model: learned.model,
        inner_steps: u16::try_from(learned.inner_steps)
            .map_err(|_| RecipeError::Count(Field::InnerSteps))?,
        initial: &pack_values(&learned.initial),
        step_sizes: &pack_values(&learned.step_sizes),
    })
}

fn pack_ridge<T, E: From<RecipeError>>(
    basis: &RecipeBasis,
    write: impl FnOnce(PackedRidge<'_>) -> Result<T, E>,
) -> Result<T, E> {
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

fn pack_completed<T, E: From<RecipeError>>(
    learned: &LearnedCoefficientNet,
    learned_correction: &LearnedCorrection,
    target: &CompletionTarget,
    write: impl FnOnce(PackedMethod<'_>) -> Result<T, E>,
) -> Result<T, E> {
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

fn pack_steps<T, E: From<RecipeError>>(
    learned: &LearnedSteps,
    components: usize,
    write: impl FnOnce(PackedGaussNewton<'_>) -> Result<T, E>,
) -> Result<T, E> {
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
