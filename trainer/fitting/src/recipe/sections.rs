//! The sections of a recipe from the numbers of a training.

use glimpse_core::fit::{Net, Ridge, Start};
use glimpse_core::geometry::Angles;
use glimpse_core::numeric::{Floats, PackedRows};
use glimpse_kernels::completion::{Shape, split_lists};

use super::quantize::quantize;
use crate::linear::{ComponentsAt, bounded_precision};

/// The bytes of lists, which sections borrow.
#[derive(Default)]
pub struct Arena(bumpalo::Bump);

impl Arena {
    /// Returns a list of numbers.
    pub fn floats(&self, values: &[f32]) -> Floats<'_> {
        let bytes: Vec<u8> = values.iter().copied().flat_map(f32::to_le_bytes).collect();
        Floats::new(self.0.alloc_slice_copy(&bytes))
    }

    /// Returns a list of angles in radians, in the order theta_h, theta_d, phi_d.
    pub fn angles(&self, angles: &[Angles<f32>]) -> Floats<'_> {
        let triples = angles.iter();
        let numbers = triples.flat_map(|angles| angles.to_array());
        self.floats(&numbers.collect::<Vec<_>>())
    }

    /// Quantizes weights; see [`quantize`].
    fn weights(
        &self,
        weights: &[f32],
        rows: usize,
        row_of: impl Fn(usize) -> usize,
    ) -> (&[u8], Floats<'_>) {
        let (bytes, scales) = quantize(weights, rows, row_of);
        (self.0.alloc_slice_copy(&bytes), self.floats(&scales))
    }

    /// Quantizes the rows of components at directions.
    pub fn rows(&self, at: &ComponentsAt) -> PackedRows<'_> {
        let components = at.components;
        let (entries, scales) =
            self.weights(&at.rows, components, |index| index % components.max(1));
        PackedRows { entries, scales }
    }

    /// Returns the ridge stage of a pattern, with rows of f32. `precision` has an entry for each component.
    pub fn ridge(&self, at: &ComponentsAt, precision: &[f32], basis_checksum: u32) -> Ridge<'_> {
        Ridge {
            precision: self.floats(&bounded_precision(&at.rows, precision)),
            difference_precision: Floats::default(),
            center: self.floats(&at.means()),
            rows: PackedRows {
                entries: self.floats(&at.rows).words().as_flattened(),
                scales: Floats::default(),
            },
            basis_checksum,
        }
    }

    /// Returns the network from readings to coefficients, which tolerates missing readings if `missing` is true. `scale` is that
    /// of centered logarithms.
    pub fn net(&self, shape: Shape, weights: &[f32], missing: bool, scale: f32) -> Net<'_> {
        let rows = shape.rows();
        let [readings, bias, output] = split_lists(weights, shape.coefficient_net_lengths());
        let (readings, reading_scales) = self.weights(readings, rows, |index| index % rows);
        let (output, output_scales) =
            self.weights(output, shape.components, |index| index / shape.hidden);
        Net {
            bias: self.floats(bias),
            components: count(shape.components),
            missing: if missing { 2 } else { 0 },
            scale,
            readings,
            reading_scales,
            output,
            output_scales,
        }
    }

    /// Returns the network from coefficients to the start of the steps.
    pub fn start(&self, shape: Shape, weights: &[f32]) -> Start<'_> {
        let [hidden, bias, output] = split_lists(weights, shape.start_net_lengths());
        let inputs = hidden.len() / shape.units.max(1);
        let (hidden, hidden_scales) = self.weights(hidden, shape.units, |index| index / inputs);
        let (output, output_scales) =
            self.weights(output, shape.parameters, |index| index / shape.units);
        Start {
            bias: self.floats(bias),
            hidden,
            hidden_scales,
            output,
            output_scales,
        }
    }
}

/// Returns a count as the format holds it. The format's limits are smaller, so that larger counts are refused.
#[must_use]
pub fn count(number: usize) -> u16 {
    u16::try_from(number).unwrap_or(u16::MAX)
}
