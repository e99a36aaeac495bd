//! Quantization of weights to bytes.

/// Quantizes weights to signed bytes, with one scale per row. `row_of` maps the index of a weight to its row.
///
/// The largest weight of a row is 127 times its scale. The error of a weight is at most half the scale.
#[must_use]
pub(super) fn quantize(
    weights: &[f32],
    rows: usize,
    row_of: impl Fn(usize) -> usize,
) -> (Vec<u8>, Vec<f32>) {
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
    (bytes.collect(), scales)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantization_error_is_at_most_half_a_step_and_largest_weight_is_exact() {
        let weights = [0.5, -1.27, 0.004, 0.0, 0.0, 0.0, 3.0, -0.1];
        let (bytes, scales) = quantize(&weights, 3, |index| index / 3);
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
