//! The bodies of formats 1 and 2, which are read and written no more.

use serde::Deserialize;

use super::contents::{Contents, Statements};
use super::error::RecipeError;
use super::ingredients::{Expectation, PackedDescent, PackedLearner, Provenance};

/// Reads the body of format 1: a descent always.
pub(super) fn first(body: &[u8]) -> Result<Contents<'_>, RecipeError> {
    let mut body = Fields(body);
    let (model, inner_steps) = (body.next()?, body.next()?);
    let pattern = body.next()?;
    let learner = PackedLearner::Descent(PackedDescent {
        model,
        inner_steps,
        initial: body.next()?,
        step_sizes: body.next()?,
    });
    contents(pattern, learner, body)
}

/// Reads the body of format 2.
pub(super) fn second(body: &[u8]) -> Result<Contents<'_>, RecipeError> {
    let mut body = Fields(body);
    let pattern = body.next()?;
    let learner = match body.next::<u32>()? {
        0 => PackedLearner::Descent(body.next()?),
        1 => PackedLearner::Ridge(body.next()?),
        _ => return Err(RecipeError::Malformed),
    };
    contents(pattern, learner, body)
}

/// The fields of a body that are not read yet, one after the other: what reads one by one is there
/// for the sections already, and takes a firmware no flash.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn next<T: Deserialize<'a>>(&mut self) -> Result<T, RecipeError> {
        let (field, rest) =
            postcard::take_from_bytes(self.0).map_err(|_| RecipeError::Malformed)?;
        self.0 = rest;
        Ok(field)
    }
}

/// What both end in: the loss to expect, and where the recipe came from.
fn contents<'a>(
    pattern: &'a [u8],
    learner: PackedLearner<'a>,
    mut end: Fields<'a>,
) -> Result<Contents<'a>, RecipeError> {
    let loss = end.next()?;
    let provenance = Provenance {
        trainer: end.next()?,
        data: end.next()?,
        materials: end.next()?,
        schedule: end.next()?,
        seed: end.next()?,
        options: "",
    };
    if !end.0.is_empty() {
        return Err(RecipeError::Malformed);
    }
    Ok(Contents {
        pattern,
        learner,
        statements: Statements {
            expectation: Some(Expectation {
                loss,
                standard_error: None,
                materials: 0,
                on: "",
            }),
            provenance: Some(provenance),
            ..Statements::default()
        },
    })
}
