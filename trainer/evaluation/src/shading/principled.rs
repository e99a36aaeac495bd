//! Mitsuba 3's BSDF `principled`: Disney's BRDF (Burley 2012, 2015) without transmission and anisotropy.

use std::f64::consts::PI;

use super::cosines::Cosines;
use super::fresnel::{dielectric, normal_reflectance, schlick, schlick_weight};
use super::microfacets::{separable_lobe, separable_shadowing};

/// The weights of linear RGB in the luminance.
const LUMINANCE: [f64; 3] = [0.212_671, 0.715_160, 0.072_169];
/// The roughness of the coat's distribution, without and with all gloss.
const COAT_ALPHA: [f64; 2] = [0.1, 0.001];
/// The roughness of the coat's shadowing.
const COAT_SHADOWING: f64 = 0.25;

/// Returns the BRDF, sr^-1.
pub(super) fn brdf(values: &[f64], at: &Cosines) -> [f64; 3] {
    let &[
        red,
        green,
        blue,
        roughness,
        metallic,
        specular,
        spec_tint,
        sheen,
        sheen_tint,
        clearcoat,
        clearcoat_gloss,
    ] = values
    else {
        return [f64::NAN; 3];
    };
    let base = [red, green, blue];
    let luminance: f64 = base
        .iter()
        .zip(LUMINANCE)
        .map(|(base, weight)| base * weight)
        .sum();
    let hue = base.map(|base| {
        if luminance > 0.0 {
            base / luminance
        } else {
            1.0
        }
    });
    let index = 2.0 / (1.0 - (0.08 * specular).sqrt()) - 1.0;

    let alpha = roughness * roughness;
    let mirrors = separable_lobe(alpha, at);
    let plain = (1.0 - spec_tint) * dielectric(index, at.difference);

    let coat = clearcoat * coat(clearcoat_gloss, at);

    let [toward_light, toward_sensor] = [at.light, at.sensor].map(schlick_weight);
    let retro = 2.0 * roughness * at.difference * at.difference;
    let diffuse = (1.0 - 0.5 * toward_light) * (1.0 - 0.5 * toward_sensor)
        + retro * (toward_light + toward_sensor + toward_light * toward_sensor * (retro - 1.0));
    let sheen = sheen * schlick_weight(at.difference);

    std::array::from_fn(|channel| {
        let (base, hue) = (base[channel], hue[channel]);
        let metal = schlick(base, 1.0, at.difference);
        let tinted = spec_tint * schlick(hue * normal_reflectance(index), 1.0, at.difference);
        let nonmetal = base * diffuse / PI + sheen * (1.0 - sheen_tint + sheen_tint * hue);
        mirrors * (metallic * metal + (1.0 - metallic) * (plain + tinted))
            + (1.0 - metallic) * nonmetal
            + coat
    })
}

/// Returns the BRDF of a coat of weight 1, sr^-1.
fn coat(gloss: f64, at: &Cosines) -> f64 {
    let [matte, glossy] = COAT_ALPHA;
    let square = (matte + (glossy - matte) * gloss).powi(2);
    // GTR1, a distribution with a longer tail than GGX.
    let density = (square - 1.0) / (PI * square.ln() * (1.0 + (square - 1.0) * at.half * at.half));
    0.25 * schlick(0.04, 1.0, at.difference) * density * separable_shadowing(COAT_SHADOWING, at)
}
