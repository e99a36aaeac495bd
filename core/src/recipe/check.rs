//! Whether what a recipe holds can be fitted by.

use super::format::{PackedDescent, PackedLearner, PackedRidge};
use super::{Field, MAX_COMPONENTS, MAX_INNER_STEPS, RecipeError};
use crate::fit::ridge::Problem;
use crate::fit::{Descent, Learner, Ridge};
use crate::numeric::Floats;

/// Checks what a body holds, for a pattern of so many samples.
pub(super) fn check(packed: PackedLearner<'_>, samples: usize) -> Result<Learner<'_>, RecipeError> {
    match packed {
        PackedLearner::Descent(packed) => descent(packed).map(Learner::Descent),
        PackedLearner::Ridge(packed) => ridge(packed, samples).map(Learner::Ridge),
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
        initial: list(packed.initial, parameters, Field::Initial)?,
        step_sizes: list(packed.step_sizes, parameters, Field::StepSizes)?,
    })
}

fn ridge(packed: PackedRidge<'_>, samples: usize) -> Result<Ridge<'_>, RecipeError> {
    let components = usize::from(packed.components);
    if !(1..=MAX_COMPONENTS).contains(&components) {
        return Err(RecipeError::Count(Field::Components));
    }
    let basis = list(
        packed.basis,
        samples.saturating_mul(components),
        Field::Basis,
    )?;
    let mean = list(packed.mean, samples, Field::Mean)?;
    let median = list(packed.median, samples, Field::Median)?;
    let weight = positive(packed.weight, samples, Field::Weight)?;
    let precision = positive(packed.precision, components, Field::Precision)?;
    if median.iter().any(|value| value < 0.0) {
        return Err(RecipeError::Negative(Field::Median));
    }
    let problem = Problem::new(basis.words(), precision.words());
    Ok(Ridge {
        problem: problem.map_err(|_| RecipeError::Count(Field::Basis))?,
        basis,
        mean,
        median,
        weight,
        precision,
        basis_checksum: packed.basis_checksum,
    })
}

/// A list of so many finite numbers.
fn list(bytes: &[u8], length: usize, field: Field) -> Result<Floats<'_>, RecipeError> {
    let list = Floats::new(bytes)
        .filter(|list| list.len() == length)
        .ok_or(RecipeError::Count(field))?;
    if list.iter().all(f32::is_finite) {
        Ok(list)
    } else {
        Err(RecipeError::NonFinite(field))
    }
}

/// A list of so many positive, finite numbers.
fn positive(bytes: &[u8], length: usize, field: Field) -> Result<Floats<'_>, RecipeError> {
    let list = list(bytes, length, field)?;
    if list.iter().all(|value| value > 0.0) {
        Ok(list)
    } else {
        Err(RecipeError::NotPositive(field))
    }
}
