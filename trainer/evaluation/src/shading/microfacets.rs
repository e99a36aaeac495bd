//! The GGX distribution of microfacets (Walter et al. 2007), isotropic.

use std::f64::consts::PI;

use super::cosines::Cosines;

/// Returns the density of normals, per sr. `alpha` is the roughness of the distribution.
fn distribution(alpha: f64, cos_half: f64) -> f64 {
    // A mirror, 0, has no density.
    let square = (alpha * alpha).max(1e-12);
    let base = cos_half * cos_half * (square - 1.0) + 1.0;
    square / (PI * base * base)
}

/// Returns Smith's masking function G1: the share of microfacets that are visible from a direction.
fn masking(alpha: f64, cosine: f64) -> f64 {
    let tangent_square = (1.0 - cosine * cosine) / (cosine * cosine);
    2.0 / (1.0 + (1.0 + alpha * alpha * tangent_square).sqrt())
}

/// Returns the separable masking-shadowing function.
pub(super) fn separable_shadowing(alpha: f64, at: &Cosines) -> f64 {
    masking(alpha, at.light) * masking(alpha, at.sensor)
}

/// Returns the BRDF of perfectly reflecting microfacets with separable masking-shadowing, sr^-1.
pub(crate) fn separable_lobe(alpha: f64, at: &Cosines) -> f64 {
    distribution(alpha, at.half) * separable_shadowing(alpha, at) / (4.0 * at.light * at.sensor)
}

/// Returns the height-correlated masking-shadowing function.
pub(super) fn correlated_shadowing(alpha: f64, light: f64, sensor: f64) -> f64 {
    let [one, other] = [light, sensor].map(|cosine| 1.0 / masking(alpha, cosine));
    1.0 / (one + other - 1.0)
}

/// Returns the BRDF of perfectly reflecting microfacets with height-correlated masking-shadowing, sr^-1.
pub(super) fn specular(alpha: f64, at: &Cosines) -> f64 {
    distribution(alpha, at.half) * correlated_shadowing(alpha, at.light, at.sensor)
        / (4.0 * at.light * at.sensor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn projected_area_of_microfacets_is_1() {
        for alpha in [0.05, 0.3, 1.0] {
            let steps = 200_000;
            let sum: f64 = (0..steps)
                .map(|step| {
                    let theta = PI / 2.0 * (f64::from(step) + 0.5) / f64::from(steps);
                    let (sine, cosine) = theta.sin_cos();
                    distribution(alpha, cosine) * cosine * sine
                })
                .sum();
            let area = sum * 2.0 * PI * PI / 2.0 / f64::from(steps);
            assert!((area - 1.0).abs() < 1e-6, "{alpha}: {area}");
        }
    }
}
