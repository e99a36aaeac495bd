//! Gray readings.

use crate::model::ModelKind;

/// The channels of a fit's readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channels {
    /// Three channels.
    Color,
    /// The channels of each reading are equal: the fitted material is gray, to the bit.
    Gray,
}

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
