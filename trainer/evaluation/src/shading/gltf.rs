//! The material of glTF 2.0 (specification, appendix B) with `KHR_materials_specular` and `KHR_materials_clearcoat`. Its masking is
//! the height-correlated one, which renderers use.

use std::f64::consts::PI;

use super::cosines::Cosines;
use super::fresnel::schlick;
use super::microfacets::specular;

/// The reflectance at normal incidence of the index of refraction 1.5, which the material has by default.
const NORMAL_REFLECTANCE: f64 = 0.04;

/// Returns the BRDF, sr^-1.
pub(super) fn brdf(values: &[f64], at: &Cosines) -> [f64; 3] {
    let &[
        red,
        green,
        blue,
        metallic,
        roughness,
        specular_factor,
        specular_red,
        specular_green,
        specular_blue,
        clearcoat,
        clearcoat_roughness,
    ] = values
    else {
        return [f64::NAN; 3];
    };
    let mirrors = specular(roughness * roughness, at);
    let fresnel = [specular_red, specular_green, specular_blue].map(|color| {
        let normal = specular_factor * (NORMAL_REFLECTANCE * color).min(1.0);
        schlick(normal, specular_factor, at.difference)
    });
    let transmitted = 1.0 - fresnel.into_iter().fold(0.0, f64::max);
    let coat = specular(clearcoat_roughness * clearcoat_roughness, at);
    let coat_weight = clearcoat * schlick(NORMAL_REFLECTANCE, 1.0, at.sensor);
    let base = [red, green, blue];
    std::array::from_fn(|channel| {
        let dielectric = transmitted * base[channel] / PI + fresnel[channel] * mirrors;
        let metal = schlick(base[channel], 1.0, at.difference) * mirrors;
        let uncoated = dielectric + metallic * (metal - dielectric);
        uncoated + coat_weight * (coat - uncoated)
    })
}
