//! The bodies of formats 1 and 2, which are read and written no more.

use super::contents::Contents;
use super::decode::Fields;
use super::error::RecipeError;
use super::ingredients::{PackedDescent, PackedLearner};
use super::statements::Stated;

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
    Ok(Contents {
        pattern,
        learner,
        prediction: None,
        stated: Stated::End(body.0),
    })
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
    Ok(Contents {
        pattern,
        learner,
        prediction: None,
        stated: Stated::End(body.0),
    })
}
