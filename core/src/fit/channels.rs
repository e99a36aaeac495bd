//! The readings of a fit, and gray ones.

use crate::model::{ModelKind, Samples};

/// The channels of a fit's readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channels {
    /// Three channels.
    Color,
    /// The channels of each reading are equal: the fitted material is gray, to the bit.
    Gray,
}

/// The readings of a fit.
pub(super) type Readings<'a> = (Samples<'a>, Channels);

/// Replaces the parameters of the three channels by their mean if the readings are gray.
pub(super) fn keep_gray(parameters: &mut [f32], model: ModelKind, channels: Channels) {
    if channels == Channels::Color {
        return;
    }
    let colors = parameters.get_mut(model.colors()).unwrap_or_default();
    for triple in colors.as_chunks_mut().0 {
        let [red, green, blue] = *triple;
        *triple = [(red + green + blue) * (1.0 / 3.0); 3];
    }
}
