//! MaterialX's node `standard_surface`: Autodesk's Standard Surface, opaque, with its physically based nodes. The layers are
//! those of the node graph: a coat over a mixture of metal, and of a dielectric over a diffuse base. A layer passes on the
//! light that it does not reflect. Light that microfacets reflect several times is compensated.

use std::f64::consts::PI;

use super::albedo::{Albedo, albedo};
use super::cosines::Cosines;
use super::fresnel::{artistic_metal, dielectric, normal_reflectance};
use super::microfacets::specular;
use super::parameter::Role::{BaseColor, Coat, Metallic, Other, Roughness};
use super::parameter::{MIN_ROUGHNESS, Parameter};

pub(super) const PARAMETERS: [Parameter; 12] = [
    Parameter::share("base_color", BaseColor),
    Parameter::share("base_color", BaseColor),
    Parameter::share("base_color", BaseColor),
    Parameter::share("metalness", Metallic),
    Parameter::share("specular", Other(0.9)),
    Parameter::share("specular_color", Other(0.9)),
    Parameter::share("specular_color", Other(0.9)),
    Parameter::share("specular_color", Other(0.9)),
    Parameter::new("specular_roughness", [MIN_ROUGHNESS, 1.0], Roughness),
    Parameter::new("specular_IOR", [1.05, 3.0], Other(1.5)),
    Parameter::share("coat", Coat),
    Parameter::new("coat_roughness", [MIN_ROUGHNESS, 1.0], Other(0.3)),
];

/// The index of refraction of the coat, the default.
const COAT_INDEX: f64 = 1.5;

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
    let alpha = roughness * roughness;
    let mirrors = specular(alpha, at);
    let albedo_toward_sensor = albedo(alpha, at.sensor);
    let [highlight, passed] = layer(mirrors, albedo_toward_sensor, index, specular_weight, at);

    let coat_alpha = coat_roughness * coat_roughness;
    let [coat, uncovered] = layer(
        specular(coat_alpha, at),
        albedo(coat_alpha, at.sensor),
        COAT_INDEX,
        coat_weight,
        at,
    );

    let base = [red, green, blue];
    let tint = [specular_red, specular_green, specular_blue];
    std::array::from_fn(|channel| {
        // The specular color is the edge color of a metal.
        let edge = specular_weight * tint[channel];
        let fresnel = artistic_metal(base[channel], edge, at.difference);
        let metal = mirrors * fresnel * albedo_toward_sensor.compensation(fresnel);
        let nonmetal = tint[channel] * highlight + passed * base[channel] / PI;
        coat + uncovered * (metalness * metal + (1.0 - metalness) * nonmetal)
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
        let expected = [0.5, 0.3, 0.1].map(|albedo| albedo / PI);
        assert_eq!(brdf(&values, &AT), expected);
    }

    /// A layer with the index of air has no effect. One with a large index reflects light, and the base receives less.
    #[test]
    fn layers_take_light_from_base() {
        let at_index = |index: f64| {
            let values = [0.5, 0.5, 0.5, 0.0, 1.0, 0.0, 0.0, 0.0, 0.4, index, 0.0, 0.2];
            brdf(&values, &AT)[0] * PI / 0.5
        };
        let [weak, usual, strong] = [1.05, 1.5, 3.0].map(at_index);
        assert!((0.9..1.0).contains(&weak), "{weak}");
        assert!(
            weak > usual && usual > strong && strong > 0.5,
            "{usual} {strong}"
        );
    }

    #[test]
    fn metal_has_no_diffuse_light() {
        let values = [0.9, 0.6, 0.3, 1.0, 1.0, 1.0, 1.0, 1.0, 0.3, 1.5, 0.0, 0.2];
        let far = Cosines { half: 0.2, ..AT };
        let [red, ..] = brdf(&values, &far);
        assert!(red < 1e-2, "{red}");
        let [red, green, blue] = brdf(&values, &Cosines { half: 1.0, ..AT });
        assert!((green / red - 0.6 / 0.9).abs() < 0.1 && (blue / red - 0.3 / 0.9).abs() < 0.1);
    }
}
