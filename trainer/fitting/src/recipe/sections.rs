//! The sections of a recipe from the numbers of a training.

use glimpse_core::fit::{Net, Ridge, Start};
use glimpse_core::geometry::Angles;
use glimpse_core::numeric::{Floats, PackedRows};
use glimpse_kernels::completion::{Shape, split_lists};

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

    /// Returns a list of bytes.
    pub fn bytes(&self, values: &[u8]) -> &[u8] {
        self.0.alloc_slice_copy(values)
    }

    /// Returns a list of angles in radians, in the order theta_h, theta_d, phi_d.
    pub fn angles(&self, angles: &[Angles<f32>]) -> Floats<'_> {
        let triples = angles.iter();
        let numbers = triples.flat_map(|angles| angles.to_array());
        self.floats(&numbers.collect::<Vec<_>>())
    }

    /// Quantizes weights to signed bytes, with one scale per row. `row_of` maps the index of a weight to its row.
    ///
    /// The largest weight of a row is 127 times its scale. The error of a weight is at most half the scale.
    fn weights(
        &self,
        weights: &[f32],
        rows: usize,
        row_of: impl Fn(usize) -> usize,
    ) -> (&[u8], Floats<'_>) {
        let mut largest = vec![0.0_f32; rows];
        for (index, weight) in weights.iter().enumerate() {
            let row = &mut largest[row_of(index)];
            *row = row.max(weight.abs());
        }
        let scales: Vec<f32> = largest.iter().map(|largest| largest / 127.0).collect();
        let bytes = weights.iter().enumerate().map(|(index, weight)| {
            let scale = scales[row_of(index)];
            let steps = if scale > 0.0 { weight / scale } else { 0.0 };
            (steps.round().clamp(-127.0, 127.0) as i8).cast_unsigned()
        });
        let bytes = self.0.alloc_slice_fill_iter(bytes);
        (bytes, self.floats(&scales))
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
            // 1 is invalid.
            missing: 2 * u8::from(missing),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantization_error_is_at_most_half_a_step_and_largest_weight_is_exact() {
        let weights = [0.5, -1.27, 0.004, 0.0, 0.0, 0.0, 3.0, -0.1];
        let arena = Arena::default();
        let (bytes, scales) = arena.weights(&weights, 3, |index| index / 3);
        let scales: Vec<f32> = scales.iter().collect();
        assert_eq!(scales[1], 0.0);
        for (index, (byte, weight)) in bytes.iter().zip(weights).enumerate() {
            let scale = scales[index / 3];
            let restored = f32::from(byte.cast_signed()) * scale;
            assert!(
                (restored - weight).abs() <= 0.5001 * scale,
                "{restored} instead of {weight}"
            );
        }
        assert_eq!(bytes[1].cast_signed(), -127);
        assert_eq!(bytes[6].cast_signed(), 127);
    }
}
