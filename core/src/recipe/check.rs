//! Checks of a recipe's numbers.

use super::contents::PackedEstimate;
use super::error::RecipeError;
use super::field::Field;
use super::format::{
    MAX_COMPONENTS, MAX_GAUSS_NEWTON_STEPS, MAX_INNER_STEPS, MAX_SAMPLES, MAX_VIRTUAL_READINGS,
};
use super::kind::Kind;
use super::parts::{
    PackedCoefficientNet, PackedCorrection, PackedDescent, PackedGaussNewton, PackedInitNet,
    PackedMethod, PackedPartialLoss, PackedRidge, PackedTarget,
};
use crate::fit::coefficient_net::{CoefficientNet, MissingPolicy};
use crate::fit::component_rows::ComponentRows;
use crate::fit::correction::Correction;
use crate::fit::gauss_newton::{GaussNewton, VirtualReadings};
use crate::fit::ridge::Problem;
use crate::fit::{COMPLETION, RIDGE, Uncertainty};
use crate::fit::{
    Completed, Components, Descent, FitMethod, InitNet, MAX_ROWS, MAX_UNITS, PartialLoss, Ridge,
    Target,
};
use crate::geometry::{Angles, HalfDifference};
use crate::numeric::Floats;

/// The three angles of a sample, packed as in a recipe.
pub(super) type PackedAngles = [u8; 12];

/// Checks the directions to measure.
pub(super) fn pattern(packed: &[u8]) -> Result<&[PackedAngles], RecipeError> {
    let pattern = directions(packed, MAX_SAMPLES, Field::Pattern)?;
    match first_below_horizon(pattern) {
        Some(index) => Err(RecipeError::BelowHorizon(index as u16)),
        None => Ok(pattern),
    }
}

/// Checks the number of directions, and the range of their angles.
fn directions(packed: &[u8], max: usize, field: Field) -> Result<&[PackedAngles], RecipeError> {
    let (directions, []) = packed.as_chunks() else {
        return Err(RecipeError::Count(field));
    };
    if !(1..=max).contains(&directions.len()) {
        return Err(RecipeError::Count(field));
    }
    let numbers = directions.len().saturating_mul(3);
    list(packed, numbers, field, in_range)?;
    Ok(directions)
}

fn first_below_horizon(packed: &[PackedAngles]) -> Option<usize> {
    packed
        .iter()
        .position(|packed| !HalfDifference::from_angles(Angles::from_le_bytes(packed)).is_valid())
}

/// Checks the method for a pattern of `samples` samples, and the estimate of its loss.
pub(super) fn method<'a>(
    packed: PackedMethod<'a>,
    estimate: PackedEstimate<'a>,
    samples: usize,
) -> Result<FitMethod<'a>, RecipeError> {
    match packed {
        PackedMethod::Descent(packed) => descent(packed).map(FitMethod::Descent),
        PackedMethod::Ridge(packed) if RIDGE => ridge(packed, samples).map(FitMethod::Ridge),
        PackedMethod::Completed(packed, correction, target) if COMPLETION => {
            completed(&packed, correction, target, estimate, samples).map(FitMethod::Completed)
        }
        // `Contents` has already refused these sections.
        PackedMethod::Ridge(_) => Err(RecipeError::Unknown(Kind::RIDGE)),
        PackedMethod::Completed(..) => Err(RecipeError::Unknown(Kind::COMPLETION)),
    }
}

fn descent(packed: PackedDescent<'_>) -> Result<Descent<'_>, RecipeError> {
    if !(1..=MAX_INNER_STEPS).contains(&packed.inner_steps) {
        return Err(RecipeError::Count(Field::InnerSteps));
    }
    let Some(parameters) = packed.model.parameters() else {
        return Err(RecipeError::Model(packed.model));
    };
    Ok(Descent {
        model: packed.model,
        inner_steps: packed.inner_steps,
        initial: list(packed.initial, parameters, Field::Initial, finite)?,
        step_sizes: list(packed.step_sizes, parameters, Field::StepSizes, finite)?,
    })
}

fn ridge(packed: PackedRidge<'_>, samples: usize) -> Result<Ridge<'_>, RecipeError> {
    let components = usize::from(packed.components);
    if !(1..=MAX_COMPONENTS).contains(&components) {
        return Err(RecipeError::Count(Field::Components));
    }
    let entries = samples.saturating_mul(components);
    let basis = list(packed.basis, entries, Field::Basis, in_range)?;
    let precision = list(packed.precision, components, Field::Precision, positive)?;
    let problem = Problem::new(basis.words(), precision.words());
    Ok(Ridge {
        problem: problem.map_err(|_| RecipeError::Count(Field::Basis))?,
        basis,
        mean: list(packed.mean, samples, Field::Mean, in_range)?,
        median: list(packed.median, samples, Field::Median, not_negative)?,
        weight: list(packed.weight, samples, Field::Weight, positive)?,
        precision,
        basis_checksum: packed.basis_checksum,
    })
}

fn completed<'a>(
    packed: &PackedCoefficientNet<'a>,
    packed_correction: Option<PackedCorrection<'a>>,
    target: PackedTarget<'a>,
    estimate: PackedEstimate<'a>,
    samples: usize,
) -> Result<Completed<'a>, RecipeError> {
    let components = usize::from(packed.components);
    let rows = Floats::new(packed.bias).map_or(0, |bias| bias.len());
    if !(1..=MAX_ROWS).contains(&rows) {
        return Err(RecipeError::Count(Field::Bias));
    }
    if !(1..=rows).contains(&components) {
        return Err(RecipeError::Count(Field::Components));
    }
    positive(packed.scale, Field::Scale)?;
    let weights = rows.saturating_mul(3).saturating_mul(samples);
    let hidden = rows.saturating_sub(components);
    let correction = match packed_correction {
        None => None,
        Some(packed) => Some(correction(&packed, components, samples)?),
    };
    let corrected = correction
        .as_ref()
        .map_or(components, Correction::components);
    let is_linear = matches!(target, PackedTarget::Linear);
    let has_rows = is_linear && correction.is_none();
    // A fit does not use these fields, so writing the recipe again would lose them.
    for (is_valid, field) in [
        (has_rows || packed.rows.is_empty(), Field::Rows),
        (has_rows || packed.row_scales.is_empty(), Field::RowScales),
        (
            is_linear || packed.basis_checksum == 0,
            Field::BasisChecksum,
        ),
    ] {
        if !is_valid {
            return Err(RecipeError::Unused(field));
        }
    }
    let row_components = if has_rows { components } else { 0 };
    let target = match target {
        PackedTarget::Linear => Target::Linear(Components {
            at_samples: ComponentRows {
                rows: bytes(
                    packed.rows,
                    samples.saturating_mul(row_components),
                    Field::Rows,
                )?,
                scales: list(packed.row_scales, row_components, Field::RowScales, finite)?,
            },
            basis_checksum: packed.basis_checksum,
        }),
        PackedTarget::Descent(descent, init_net) => {
            let descent = self::descent(descent)?;
            let init_net = self::init_net(init_net, corrected, descent.initial.len())?;
            Target::Descent(descent, init_net)
        }
        PackedTarget::GaussNewton(steps, init_net) => {
            let steps = gauss_newton(&steps, corrected)?;
            let init_net = self::init_net(init_net, corrected, steps.initial.len())?;
            Target::GaussNewton(steps, init_net)
        }
    };
    Ok(Completed {
        coefficient_net: CoefficientNet {
            components,
            readings: bytes(packed.readings, weights, Field::Readings)?,
            scales: list(packed.reading_scales, rows, Field::ReadingScales, finite)?.words(),
            bias: list(packed.bias, rows, Field::Bias, finite)?.words(),
            output: bytes(
                packed.output,
                components.saturating_mul(hidden),
                Field::Output,
            )?,
            output_scales: list(
                packed.output_scales,
                components,
                Field::OutputScales,
                finite,
            )?
            .words(),
        },
        center: list(packed.center, samples, Field::Center, in_range)?,
        scale: packed.scale,
        correction,
        missing: MissingPolicy::from_number(packed.missing)
            .ok_or(RecipeError::Range(Field::Missing))?,
        prediction: match estimate.prediction {
            None => Floats::EMPTY,
            Some(packed) => {
                let entries = components.saturating_add(1);
                list(packed, entries, Field::Prediction, in_range)?
            }
        },
        uncertainty: estimate.uncertainty.map(checked_uncertainty).transpose()?,
        partial: match estimate.partial {
            None => None,
            Some(packed) => Some(partial_loss(packed, samples)?),
        },
        target,
    })
}

fn checked_uncertainty(uncertainty: Uncertainty) -> Result<Uncertainty, RecipeError> {
    in_range(uncertainty.innovation, Field::InnovationExponent)?;
    in_range(uncertainty.residual, Field::ResidualExponent)?;
    positive(uncertainty.bound, Field::Bound)?;
    positive(uncertainty.max_innovation, Field::MaxInnovation)?;
    Ok(uncertainty)
}

fn partial_loss(
    packed: PackedPartialLoss<'_>,
    samples: usize,
) -> Result<PartialLoss<'_>, RecipeError> {
    Ok(PartialLoss {
        loss: list(packed.loss, samples, Field::PartialLoss, in_range)?,
        bound: list(packed.bound, samples, Field::PartialBound, positive)?,
    })
}

/// Checks a correction of at least `components` components.
fn correction<'a>(
    packed: &PackedCorrection<'a>,
    components: usize,
    samples: usize,
) -> Result<Correction<'a>, RecipeError> {
    let count = Floats::new(packed.precision).map_or(0, |list| list.len());
    if !(components..=MAX_COMPONENTS).contains(&count) {
        return Err(RecipeError::Count(Field::CorrectionPrecision));
    }
    let rows = samples.saturating_mul(count);
    Ok(Correction {
        at_samples: ComponentRows {
            rows: bytes(packed.rows, rows, Field::CorrectionRows)?,
            scales: list(packed.row_scales, count, Field::CorrectionRowScales, finite)?,
        },
        precision: list(
            packed.precision,
            count,
            Field::CorrectionPrecision,
            positive,
        )?,
    })
}

fn gauss_newton<'a>(
    packed: &PackedGaussNewton<'a>,
    components: usize,
) -> Result<GaussNewton<'a>, RecipeError> {
    if !(1..=MAX_GAUSS_NEWTON_STEPS).contains(&packed.steps) {
        return Err(RecipeError::Count(Field::StepCount));
    }
    let Some((parameters, active)) = packed.model.parameters().zip(packed.model.active()) else {
        return Err(RecipeError::Model(packed.model));
    };
    positive(packed.reading_weight, Field::ReadingWeight)?;
    positive(packed.error_scale, Field::ErrorScale)?;
    let directions = directions(
        packed.directions,
        MAX_VIRTUAL_READINGS,
        Field::VirtualDirections,
    )?;
    let readings = directions.len();
    if first_below_horizon(directions).is_some() {
        return Err(RecipeError::Range(Field::VirtualDirections));
    }
    let rows = readings.saturating_mul(components);
    Ok(GaussNewton {
        model: packed.model,
        steps: packed.steps,
        initial: list(packed.initial, parameters, Field::StepInitial, finite)?,
        precision: list(
            packed.precision,
            active.count(),
            Field::StepPrecision,
            positive,
        )?,
        reading_weight: packed.reading_weight,
        error_scale: packed.error_scale,
        virtual_readings: VirtualReadings {
            directions,
            center: list(packed.center, readings, Field::VirtualCenter, in_range)?,
            components: ComponentRows {
                rows: bytes(packed.rows, rows, Field::VirtualRows)?,
                scales: list(
                    packed.row_scales,
                    components,
                    Field::VirtualRowScales,
                    finite,
                )?,
            },
        },
    })
}

fn init_net(
    packed: PackedInitNet<'_>,
    components: usize,
    parameters: usize,
) -> Result<InitNet<'_>, RecipeError> {
    let units = Floats::new(packed.bias).map_or(0, |bias| bias.len());
    if !(1..=MAX_UNITS).contains(&units) {
        return Err(RecipeError::Count(Field::StartBias));
    }
    let inputs = components.saturating_mul(3);
    let hidden = units.saturating_mul(inputs);
    Ok(InitNet {
        hidden: bytes(packed.hidden, hidden, Field::StartHidden)?,
        hidden_scales: list(
            packed.hidden_scales,
            units,
            Field::StartHiddenScales,
            finite,
        )?
        .words(),
        bias: list(packed.bias, units, Field::StartBias, finite)?.words(),
        output: bytes(
            packed.output,
            parameters.saturating_mul(units),
            Field::StartOutput,
        )?,
        output_scales: list(
            packed.output_scales,
            parameters,
            Field::StartOutputScales,
            finite,
        )?
        .words(),
    })
}

/// Checks the number of bytes.
#[inline(never)]
fn bytes(bytes: &[u8], length: usize, field: Field) -> Result<&[u8], RecipeError> {
    if bytes.len() == length {
        Ok(bytes)
    } else {
        Err(RecipeError::Count(field))
    }
}

/// Checks the length of a list and each of its numbers. Not inlined, because it is called for many lists.
#[inline(never)]
fn list(
    bytes: &[u8],
    length: usize,
    field: Field,
    check: fn(f32, Field) -> Result<(), RecipeError>,
) -> Result<Floats<'_>, RecipeError> {
    let list = Floats::new(bytes)
        .filter(|list| list.len() == length)
        .ok_or(RecipeError::Count(field))?;
    list.iter().try_for_each(|value| check(value, field))?;
    Ok(list)
}

pub(super) fn finite(value: f32, field: Field) -> Result<(), RecipeError> {
    if value.is_finite() {
        Ok(())
    } else {
        Err(RecipeError::NonFinite(field))
    }
}

fn in_range(value: f32, field: Field) -> Result<(), RecipeError> {
    finite(value, field)?;
    let (min, max) = field.range();
    if (min..=max).contains(&value) {
        Ok(())
    } else {
        Err(RecipeError::Range(field))
    }
}

pub(super) fn not_negative(value: f32, field: Field) -> Result<(), RecipeError> {
    finite(value, field)?;
    if value < 0.0 {
        return Err(RecipeError::Negative(field));
    }
    in_range(value, field)
}

fn positive(value: f32, field: Field) -> Result<(), RecipeError> {
    finite(value, field)?;
    if value <= 0.0 {
        return Err(RecipeError::NotPositive(field));
    }
    in_range(value, field)
}
