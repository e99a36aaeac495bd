//! The start of a fit from completed coefficients, and the treatment of gray readings.

use super::algorithm::{Channels, is_finite};
use super::completed::{Completed, InitNet, PARAMETERS_PER_UNIT};
use crate::model::ModelKind;

/// Replaces the parameters of the three channels by their mean if the readings are gray.
pub(super) fn keep_gray(words: &mut [f32], model: ModelKind, channels: Channels) {
    if channels == Channels::Color {
        return;
    }
    let colors = words.get_mut(model.colors()).unwrap_or_default();
    for triple in colors.as_chunks_mut().0 {
        let [red, green, blue] = *triple;
        *triple = [(red + green + blue) * (1.0 / 3.0); 3];
    }
}

/// Adds the init net's offsets to up to [`PARAMETERS_PER_UNIT`] parameters, from index `first`.
#[inline(never)]
pub(super) fn add_offsets(
    parameters: &mut [f32],
    init_net: &InitNet<'_>,
    first: usize,
    activations: &[f32],
) {
    let mut offsets = [0.0; PARAMETERS_PER_UNIT];
    init_net.offsets(first, activations, &mut offsets);
    for (parameter, offset) in parameters.iter_mut().zip(offsets) {
        *parameter += offset;
    }
}

/// Computes the activations of the init net. Also returns the predicted loss, because the descent overwrites the
/// coefficients.
///
/// The result is NaN if a coefficient or an activation is not finite. Later steps cannot detect this: activations are
/// rounded to integers, even those of NaN, and an infinite coefficient results in activations of 1. Not inlined, so
/// that its stack is released between slices.
#[inline(never)]
pub(super) fn activate(
    completed: &Completed<'_>,
    init_net: &InitNet<'_>,
    state: &[f32],
    activations: &mut [f32],
) -> f32 {
    let coefficients = completed.coefficients(state);
    init_net.activate(coefficients, activations);
    if !(coefficients.into_iter().all(is_finite) && is_finite(activations)) {
        return f32::NAN;
    }
    completed.predicted_loss(state).unwrap_or_default()
}
