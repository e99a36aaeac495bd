//! Fresnel reflection of unpolarized light.

/// Returns (1 - cosine)^5, the weight of Schlick's approximation.
pub(super) fn schlick_weight(cosine: f64) -> f64 {
    (1.0 - cosine).clamp(0.0, 1.0).powi(5)
}

/// Returns Schlick's approximation with these reflectances at normal and at grazing incidence.
pub(super) fn schlick(normal: f64, grazing: f64, cosine: f64) -> f64 {
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

/// Returns the reflectance of a metal with this reflectance at normal incidence and this tint at its edges, both 0 to 1
/// (Gulbrandsen 2014, Artist Friendly Metallic Fresnel).
pub(super) fn artistic_metal(normal: f64, edge: f64, cosine: f64) -> f64 {
    let normal = normal.clamp(0.0, 0.99);
    let root = normal.sqrt();
    let [smallest, largest] = [(1.0 - normal) / (1.0 + normal), (1.0 + root) / (1.0 - root)];
    let index = largest + (smallest - largest) * edge;
    let absorbed = normal * (index + 1.0).powi(2) - (index - 1.0).powi(2);
    conductor(index, (absorbed / (1.0 - normal)).max(0.0), cosine)
}

/// Returns the reflectance of a conductor with this index of refraction and this square of its extinction.
fn conductor(index: f64, extinction_square: f64, cosine: f64) -> f64 {
    let cos_square = cosine * cosine;
    let sin_square = 1.0 - cos_square;
    let difference = index * index - extinction_square - sin_square;
    let modulus = (difference * difference + 4.0 * index * index * extinction_square).sqrt();
    let real = (0.5 * (modulus + difference)).max(0.0).sqrt();
    let [sum, mixed] = [modulus + cos_square, 2.0 * real * cosine];
    let perpendicular = (sum - mixed) / (sum + mixed);
    let [sum, mixed] = [
        cos_square * modulus + sin_square * sin_square,
        mixed * sin_square,
    ];
    let parallel = perpendicular * (sum - mixed) / (sum + mixed);
    0.5 * (perpendicular + parallel)
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
    fn conductor_without_extinction_is_dielectric() {
        for cosine in [0.1, 0.5, 0.9, 1.0] {
            let difference = conductor(1.7, 0.0, cosine) - dielectric(1.7, cosine);
            assert!(difference.abs() < 1e-12, "{cosine}: {difference}");
        }
        for edge in [0.0, 0.5, 1.0] {
            assert!((artistic_metal(0.6, edge, 1.0) - 0.6).abs() < 1e-12);
            assert!(artistic_metal(0.6, edge, 1e-6) > 0.99);
        }
    }
}
