//! The bodies of formats 1 and 2, which are read and written no more.

use serde::Deserialize;

use super::contents::{Contents, Statements};
use super::error::RecipeError;
use super::ingredients::{Expectation, PackedDescent, PackedLearner, Provenance};
use crate::model::ModelKind;

/// Reads the body of format 1: a descent always.
pub(super) fn first(body: &[u8]) -> Result<Contents<'_>, RecipeError> {
    let body: FirstBody<'_> = whole(body)?;
    let learner = PackedLearner::Descent(PackedDescent {
        model: body.model,
        inner_steps: body.inner_steps,
        initial: body.initial,
        step_sizes: body.step_sizes,
    });
    Ok(contents(body.pattern, learner, body.end))
}

/// Reads the body of format 2.
pub(super) fn second(body: &[u8]) -> Result<Contents<'_>, RecipeError> {
    let body: SecondBody<'_> = whole(body)?;
    Ok(contents(body.pattern, body.learner, body.end))
}

#[derive(Deserialize)]
struct FirstBody<'a> {
    model: ModelKind,
    inner_steps: u16,
    pattern: &'a [u8],
    initial: &'a [u8],
    step_sizes: &'a [u8],
    #[serde(borrow)]
    end: End<'a>,
}

#[derive(Deserialize)]
struct SecondBody<'a> {
    pattern: &'a [u8],
    #[serde(borrow)]
    learner: PackedLearner<'a>,
    #[serde(borrow)]
    end: End<'a>,
}

/// What both end in: the loss to expect, and where the recipe came from.
#[derive(Deserialize)]
struct End<'a> {
    expected_loss: f32,
    trainer: &'a str,
    data: &'a str,
    materials: u32,
    schedule: &'a str,
    seed: u64,
}

fn whole<'a, T: Deserialize<'a>>(body: &'a [u8]) -> Result<T, RecipeError> {
    match postcard::take_from_bytes(body) {
        Ok((body, [])) => Ok(body),
        _ => Err(RecipeError::Malformed),
    }
}

fn contents<'a>(pattern: &'a [u8], learner: PackedLearner<'a>, end: End<'a>) -> Contents<'a> {
    Contents {
        pattern,
        learner,
        statements: Statements {
            expectation: Some(Expectation {
                loss: end.expected_loss,
                standard_error: None,
                materials: 0,
                on: "",
            }),
            provenance: Some(Provenance {
                trainer: end.trainer,
                data: end.data,
                materials: end.materials,
                schedule: end.schedule,
                seed: end.seed,
                options: "",
            }),
            ..Statements::default()
        },
    }
}
