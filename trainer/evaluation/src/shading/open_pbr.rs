//! OpenPBR 1.1, MaterialX's node `open_pbr_surface`, opaque, with its physically based nodes. The layers are those of the node
//! graph: a coat over a mixture of metal, and of a dielectric over a diffuse base. A layer passes on the light that it does not
//! reflect. Light that microfacets reflect several times is compensated. A coat makes the layers below rougher and darker.

use std::f64::consts::PI;

use super::albedo::{Albedo, albedo};
use super::cosines::Cosines;
use super::fresnel::{dielectric, metal, normal_reflectance};
use super::microfacets::specular;

/// The index of refraction of the coat, the default.
const COAT_INDEX: f64 = 1.6;

/// Returns the BRDF, sr^-1.
pub(super) fn brdf(values: &[f64], at: &Cosines) -> [f64; 3] {
    let &[
        red,
        green,
        blue,
        metalness,
        specular_weight,
        specular_red,
        specular_green,
        specular_blue,
        roughness,
        index,
        coat_weight,
        coat_roughness,
    ] = values
    else {
        return [f64::NAN; 3];
    };
    let mix = |base: f64, coated: f64| base + coat_weight * (coated - base);
    let spread = (2.0 * coat_roughness.powi(4) + roughness.powi(4)).min(1.0);
    let alpha = mix(roughness, spread.powf(0.25)).powi(2);
    let mirrors = specular(alpha, at);
    let albedo_toward_sensor = albedo(alpha, at.sensor);
    // Relative to the coat, and with the specular weight as a factor of the reflectance at normal incidence.
    let index = mix(index, (index / COAT_INDEX).max(COAT_INDEX / index));
    let root = (specular_weight * normal_reflectance(index)).sqrt();
    let index = (1.0 + root) / (1.0 - root);
    let [highlight, passed] = layer(mirrors, albedo_toward_sensor, index, 1.0, at);

    let coat_alpha = coat_roughness * coat_roughness;
    let [coat, uncovered] = layer(
        specular(coat_alpha, at),
        albedo(coat_alpha, at.sensor),
        COAT_INDEX,
        coat_weight,
        at,
    );
    let inner = 1.0 - (1.0 - normal_reflectance(COAT_INDEX)) / (COAT_INDEX * COAT_INDEX);

    let base = [red, green, blue];
    let tint = [specular_red, specular_green, specular_blue];
    std::array::from_fn(|channel| {
        let (base, tint) = (base[channel], tint[channel]);
        let fresnel = metal(base, tint, at.difference);
        let metal =
            specular_weight * mirrors * fresnel * albedo_toward_sensor.compensation(fresnel);
        let nonmetal = tint * highlight + passed * base / PI;
        // The share of light that the base reflects, and the coat back to it.
        let reflected = base * (1.0 - metalness + metalness * specular_weight);
        let darkening = mix(1.0, (1.0 - inner) / (1.0 - inner * reflected));
        coat + uncovered * darkening * (metalness * metal + (1.0 - metalness) * nonmetal)
    })
}

/// Returns the BRDF of a dielectric layer with this weight, sr^-1, and the share of light that it passes on.
fn layer(mirrors: f64, albedo: Albedo, index: f64, weight: f64, at: &Cosines) -> [f64; 2] {
    let fresnel = dielectric(index, at.difference);
    let compensation = albedo.compensation(fresnel);
    let reflected = albedo.single(normal_reflectance(index)) * compensation;
    [
        weight * mirrors * fresnel * compensation,
        1.0 - weight * reflected.min(1.0),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    const AT: Cosines = Cosines {
        light: 0.7,
        sensor: 0.8,
        half: 0.95,
        difference: 0.85,
    };

    #[test]
    fn base_without_layers_is_diffuse() {
        let values = [0.5, 0.3, 0.1, 0.0, 0.0, 1.0, 1.0, 1.0, 0.4, 1.5, 0.0, 0.2];
        // Schlick's approximation of the albedo is above 0 at grazing angles.
        for (f, albedo) in brdf(&values, &AT).into_iter().zip([0.5, 0.3, 0.1]) {
            assert!((0.98..=1.0).contains(&(f * PI / albedo)), "{f} {albedo}");
        }
    }

    /// A coat adds its own highlight, and darkens a diffuse base: dark colors more than white.
    #[test]
    fn coat_darkens_base() {
        let reflected = |base: f64, coat: f64| {
            let values = [
                base, base, base, 0.0, 0.0, 1.0, 1.0, 1.0, 0.4, 1.5, coat, 0.05,
            ];
            brdf(&values, &Cosines { half: 0.2, ..AT })[0] * PI / base
        };
        let [dark, white] = [0.1, 0.99].map(|base| reflected(base, 1.0) / reflected(base, 0.0));
        assert!(dark < 0.5 && (0.8..1.0).contains(&white), "{dark} {white}");
    }
}
