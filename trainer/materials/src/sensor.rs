//! Quantization of BRDF readings by a sensor.

use std::f32::consts::PI;

/// Returns the BRDF that a sensor with a given number of levels reads.
///
/// The sensor measures the BRDF times cos(theta_i). It resolves `levels` equal steps between darkness and a white
/// surface (BRDF 1/pi) that faces the light, and continues with the same step above. With 0 levels, it does not
/// quantize.
#[must_use]
pub fn quantize(brdf: f32, cos_theta_i: f32, levels: u32) -> f32 {
    if levels == 0 {
        return brdf;
    }
    let levels_per_unit = levels as f32 * PI * cos_theta_i.max(1e-6);
    (brdf * levels_per_unit).round() / levels_per_unit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resolves_the_given_number_of_levels() {
        for (levels, cosine) in [(1_u32, 1.0_f32), (100, 1.0), (100, 0.3)] {
            let white = PI.recip();
            let read =
                (0..=100_000).map(|step| quantize(white * step as f32 * 1e-5, cosine, levels));
            let mut read: Vec<f32> = read.collect();
            assert!(read.is_sorted());
            read.dedup();
            let expected = (levels as f32 * cosine).round() as usize + 1;
            assert_eq!(read.len(), expected);
        }
        assert_eq!(quantize(0.123, 0.5, 0), 0.123);
    }

    #[test]
    fn error_is_at_most_half_a_step() {
        for step in 0..1000 {
            let (brdf, cosine) = (0.01 * step as f32, 0.4);
            let error = (quantize(brdf, cosine, 64) - brdf).abs() * cosine;
            assert!(error <= 0.5001 / (64.0 * PI), "{brdf}: {error}");
        }
    }
}
