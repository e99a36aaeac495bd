//! Fresnel reflection of unpolarized light.

/// Returns (1 - cosine)^5, the weight of Schlick's approximation.
pub(super) fn schlick_weight(cosine: f64) -> f64 {
    (1.0 - cosine).clamp(0.0, 1.0).powi(5)
}

/// Returns Schlick's approximation with these reflectances at normal and at grazing incidence.
pub(crate) fn schlick(normal: f64, grazing: f64, cosine: f64) -> f64 {
    normal + (grazing - normal) * schlick_weight(cosine)
}

/// Returns the reflectance of a dielectric with this index of refraction, above 1, at normal incidence.
pub(super) fn normal_reflectance(index: f64) -> f64 {
    ((index - 1.0) / (index + 1.0)).powi(2)
}

/// Returns the reflectance of a dielectric with this index of refraction, at least 1.
pub(super) fn dielectric(index: f64, cosine: f64) -> f64 {
    let refracted = (1.0 - (1.0 - cosine * cosine) / (index * index))
        .max(0.0)
        .sqrt();
    let perpendicular = (cosine - index * refracted) / (cosine + index * refracted);
    let parallel = (index * cosine - refracted) / (index * cosine + refracted);
    0.5 * (perpendicular * perpendicular + parallel * parallel)
}

/// Returns the reflectance of a metal with this reflectance at normal incidence and this tint at 82 degrees, both 0 to 1
/// (Hoffman 2019, Fresnel Equations Considered Harmful).
pub(super) fn metal(normal: f64, tint: f64, cosine: f64) -> f64 {
    const EDGE: f64 = 1.0 / 7.0;
    let lack = schlick(normal, 1.0, EDGE) * (1.0 - tint) / (EDGE * (1.0 - EDGE).powi(6));
    schlick(normal, 1.0, cosine) - lack * cosine * (1.0 - cosine).powi(6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dielectric_agrees_with_schlick_at_both_ends() {
        let normal = dielectric(1.5, 1.0);
        assert!((normal - 0.04).abs() < 1e-12 && (normal_reflectance(1.5) - 0.04).abs() < 1e-12);
        assert!((dielectric(1.5, 1e-9) - 1.0).abs() < 1e-6);
        // Brewster's angle: only perpendicular light is reflected, (n^2 - 1)^2 / (n^2 + 1)^2 of it.
        let brewster = 1.5_f64.atan().cos();
        let expected = 0.5 * (1.25_f64 / 3.25).powi(2);
        assert!((dielectric(1.5, brewster) - expected).abs() < 1e-12);
    }

    #[test]
    fn metals_have_their_tint_at_82_degrees() {
        for (cosine, expected) in [
            (1.0, 0.6),
            (0.0, 1.0),
            (1.0 / 7.0, 0.3 * schlick(0.6, 1.0, 1.0 / 7.0)),
        ] {
            assert!(
                (metal(0.6, 0.3, cosine) - expected).abs() < 1e-12,
                "{cosine}"
            );
        }
    }
}
