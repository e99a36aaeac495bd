//! Procedural materials that resemble measured ones. No model of this project can fit them exactly.
//!
//! Each material has a diffuse base with retro-reflection at grazing angles, a highlight of two GTR microfacet lobes (a
//! core and a wider haze), Schlick's Fresnel term, sheen, a retro-reflective lobe, and noise. The noise increases
//! towards grazing angles, as in gonioreflectometer data.
//!
//! The classes are those of measured materials: metals, metallic paints, plastics and lacquers, rubbers and other rough
//! materials, fabrics, and woods. A set varies as much as measured materials in the brightness and width of highlights
//! and their tails, the increase towards grazing angles, albedo, and saturation.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::numeric::{Scalar, Trigonometry};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;

use crate::Material;
use glimpse_kernels::Dual;

/// The smallest and largest value of a parameter.
type Range = [f64; 2];

/// The parameter ranges of a class. Roughness, width, reflectance and albedo are log-uniform.
struct ClassRanges {
    class: Class,
    /// The fraction of a set's materials.
    share: f64,
    /// Roughness of the core.
    roughness: Range,
    /// Ratio of the haze's roughness to the core's.
    haze_width: Range,
    /// The haze's fraction of the highlight.
    haze: Range,
    /// Reflectance at normal incidence.
    fresnel: Range,
    /// Albedo of the diffuse part's brightest channel.
    diffuse: Range,
    /// The largest strength of the retro-reflective lobe.
    retro: f64,
}

/// A class of materials.
#[derive(Clone, Copy)]
enum Class {
    Metal,
    MetallicPaint,
    Plastic,
    Rubber,
    Fabric,
    Wood,
}

impl Class {
    /// Returns the last part of a material's name.
    fn name(self) -> &'static str {
        match self {
            Self::Metal => "metal",
            Self::MetallicPaint => "metallic-paint",
            Self::Plastic => "plastic",
            Self::Rubber => "rubber",
            Self::Fabric => "fabric",
            Self::Wood => "wood",
        }
    }
}

const CLASSES: [ClassRanges; 6] = [
    ClassRanges {
        class: Class::Metal,
        share: 0.22,
        roughness: [0.003, 0.3],
        haze_width: [1.5, 8.0],
        haze: [0.1, 0.8],
        fresnel: [0.1, 0.6],
        diffuse: [1e-4, 0.1],
        retro: 0.0,
    },
    ClassRanges {
        class: Class::MetallicPaint,
        share: 0.15,
        roughness: [0.004, 0.2],
        haze_width: [1.5, 16.0],
        haze: [0.2, 0.95],
        fresnel: [0.03, 0.25],
        diffuse: [0.003, 0.3],
        retro: 0.0,
    },
    ClassRanges {
        class: Class::Plastic,
        share: 0.27,
        roughness: [0.002, 0.25],
        haze_width: [1.5, 8.0],
        haze: [0.1, 0.8],
        fresnel: [0.015, 0.06],
        diffuse: [0.002, 0.7],
        retro: 0.0,
    },
    ClassRanges {
        class: Class::Rubber,
        share: 0.12,
        roughness: [0.15, 0.6],
        haze_width: [1.2, 2.5],
        haze: [0.2, 0.9],
        fresnel: [0.01, 0.06],
        diffuse: [0.01, 0.6],
        retro: 0.0,
    },
    ClassRanges {
        class: Class::Fabric,
        share: 0.12,
        roughness: [0.25, 0.9],
        haze_width: [1.1, 1.8],
        haze: [0.2, 0.9],
        fresnel: [0.01, 0.08],
        diffuse: [0.01, 0.6],
        retro: 0.15,
    },
    ClassRanges {
        class: Class::Wood,
        share: 0.12,
        roughness: [0.05, 0.4],
        haze_width: [1.3, 4.0],
        haze: [0.1, 0.8],
        fresnel: [0.015, 0.06],
        diffuse: [0.05, 0.7],
        retro: 0.05,
    },
];

/// A procedural material.
#[derive(Clone, Debug)]
pub struct Procedural {
    name: String,
    /// Diffuse albedo, in linear RGB.
    diffuse: [f64; 3],
    /// Burley's F90 of the diffuse part. Grazing angles are darker below 1 and brighter above 1.
    diffuse_grazing: f64,
    /// Strength of the highlight, in linear RGB.
    specular: [f64; 3],
    /// Reflectance at normal incidence.
    fresnel: f64,
    /// The fraction of Schlick's increase to 1 at grazing angles.
    fresnel_rise: f64,
    core: Lobe,
    haze: Lobe,
    /// Shadowing at grazing angles in addition to that of roughness: dust, scratches, the edges of a light's cone.
    shadow: f64,
    /// Sheen at large theta_d, in linear RGB.
    sheen: [f64; 3],
    /// Strength of the retro-reflective lobe at small theta_d.
    retro: f64,
    /// Width of the retro-reflective lobe.
    retro_width: f64,
    /// Amplitude of the noise at the horizon.
    noise: f64,
    /// Waves of the noise: frequencies along h_x, d_z and (h_x d_x)^2, and a phase.
    waves: [[f64; 4]; 4],
}

/// A microfacet lobe.
#[derive(Clone, Debug)]
struct Lobe {
    roughness: f64,
    /// The exponent gamma of the GTR distribution. 2 is GGX, and larger exponents have shorter tails.
    falloff: f64,
    /// The factor of the distribution.
    scale: f64,
}

impl Lobe {
    /// Makes a lobe whose distribution integrates to `share`.
    fn new(roughness: f64, falloff: f64, share: f64) -> Self {
        let squared = roughness * roughness;
        let norm = (falloff - 1.0) * (squared - 1.0) / (PI * (1.0 - squared.powf(1.0 - falloff)));
        Self {
            roughness,
            falloff,
            scale: share * norm,
        }
    }
}

impl Procedural {
    /// Returns the first `count` materials of a seed's set.
    #[must_use]
    pub fn set(count: usize, seed: u64) -> Vec<Self> {
        (0..count).map(|index| Self::new(index, seed)).collect()
    }

    /// Returns material `index` of a seed's set.
    #[must_use]
    pub fn new(index: usize, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(index as u64);
        let random = &mut random;
        // A low-discrepancy sequence (golden ratio) selects the class, so that small sets have all classes too.
        let mut share = (index as f64 * 0.618_033_988_749_895 + uniform(random, 0.0, 0.02)) % 1.0;
        let mut ranges = &CLASSES[0];
        for each in &CLASSES {
            ranges = each;
            share -= ranges.share;
            if share < 0.0 {
                break;
            }
        }
        // Materials of different seeds have different names.
        let prefix = match seed {
            0 => String::new(),
            seed => format!("{seed}-"),
        };
        let name = format!("procedural-{prefix}{index:03}-{}", ranges.class.name());
        Self::from_ranges(ranges, name, random)
    }

    fn from_ranges(ranges: &ClassRanges, name: String, random: &mut ChaCha8Rng) -> Self {
        let hue = match ranges.class {
            Class::Metal => metal_tint(random),
            Class::Wood => {
                let stain = tint(random, 0.6);
                mixed([0.75, 0.42, 0.2], stain, uniform(random, 0.0, 0.5))
            }
            _ => tint(random, 0.95),
        };
        // Surface reflection is white, except on metals and pigmented surfaces.
        let specular = match ranges.class {
            Class::Metal => hue,
            Class::MetallicPaint | Class::Fabric => mixed(hue, [1.0; 3], uniform(random, 0.1, 0.9)),
            _ => [1.0; 3],
        };
        let sheen = mixed(hue, [1.0; 3], uniform(random, 0.0, 1.0));
        let core = log_uniform(random, ranges.roughness);
        let haze_width = log_uniform(random, ranges.haze_width);
        let haze_share = uniform(random, ranges.haze[0], ranges.haze[1]);
        let mut lobe = |roughness, share| {
            let falloff = log_uniform(random, [1.05, 3.0]);
            Lobe::new(roughness, falloff, share)
        };
        let core_lobe = lobe(core, 1.0 - haze_share);
        let haze_lobe = lobe((core * haze_width).min(0.99), haze_share);
        Self {
            name,
            diffuse: scaled(hue, log_uniform(random, ranges.diffuse)),
            diffuse_grazing: uniform(random, 0.4, 1.8),
            // Measured highlights are weaker than those of ideal interfaces.
            specular: scaled(specular, log_uniform(random, [0.25, 1.0])),
            fresnel: log_uniform(random, ranges.fresnel),
            fresnel_rise: uniform(random, 0.4, 1.0),
            core: core_lobe,
            haze: haze_lobe,
            shadow: log_uniform(random, [0.02, 0.3]),
            sheen: scaled(sheen, log_uniform(random, [0.001, 0.3])),
            retro: uniform(random, 0.0, ranges.retro),
            retro_width: uniform(random, 0.01, 0.1),
            noise: uniform(random, 0.0, 0.3),
            waves: std::array::from_fn(|_| {
                [
                    uniform(random, -40.0, 40.0),
                    uniform(random, -40.0, 40.0),
                    uniform(random, -100.0, 100.0),
                    uniform(random, 0.0, 2.0 * PI),
                ]
            }),
        }
    }

    fn evaluate<S: Trigonometry>(&self, at: &HalfDifference<S>) -> [S; 3] {
        let c = S::constant;
        let one = c(1.0);
        // A lower limit of the cosines, so that nothing diverges outside the valid region.
        let floor = |cosine: S| (cosine - c(1e-3)).relu() + c(1e-3);
        let (incoming, outgoing) = (floor(at.cos_theta_i()), floor(at.cos_theta_o()));

        let grazing = c(self.diffuse_grazing - 1.0);
        let mut base = (one + grazing * fifth(one - incoming))
            * (one + grazing * fifth(one - outgoing))
            * c(1.0 / PI);
        if self.retro > 0.0 {
            let distance = (one - at.dz * at.dz) * c(1.0 / self.retro_width);
            base = base + c(self.retro / PI) * (-distance).exp();
        }

        let grazing_difference = fifth(one - at.dz);
        let fresnel =
            c(self.fresnel) + c(self.fresnel_rise * (1.0 - self.fresnel)) * grazing_difference;
        let lobe = |lobe: &Lobe| {
            // cos^2 (a^2 - 1) + 1, without cancellation at sharp highlights.
            let bell = at.hx * at.hx + at.hz * at.hz * c(lobe.roughness * lobe.roughness);
            let distribution = c(lobe.scale) * (-(bell.ln() * c(lobe.falloff))).exp();
            let shadow = (0.5 * lobe.roughness + self.shadow).min(1.0);
            let visible = |cosine: S| cosine * c(1.0 - shadow) + c(shadow);
            distribution * c(0.25) / (visible(incoming) * visible(outgoing))
        };
        let highlight = fresnel * (lobe(&self.core) + lobe(&self.haze));

        let mut noise = c(0.0);
        // (h_x d_x)^2 does not depend on phi_d at the pole, and has period pi in phi_d.
        let azimuthal = at.hx * at.dx;
        let azimuthal = azimuthal * azimuthal;
        for [hx, dz, azimuth, phase] in self.waves {
            let wave = at.hx * c(hx) + at.dz * c(dz) + azimuthal * c(azimuth) + c(phase);
            noise = noise + wave.sin_cos().0 * c(0.25);
        }
        let lower = (incoming - outgoing).if_positive(outgoing, incoming);
        let noise = one + c(self.noise) * fifth(one - lower) * noise;

        let mut brdf = [c(0.0); 3];
        for (channel, f) in brdf.iter_mut().enumerate() {
            let diffuse = base * c(self.diffuse[channel]);
            let sheen = grazing_difference * c(self.sheen[channel] / PI);
            *f = (diffuse + sheen + highlight * c(self.specular[channel])) * noise;
        }
        brdf
    }
}

impl Material for Procedural {
    fn name(&self) -> &str {
        &self.name
    }

    fn brdf(&self, angles: Angles<f32>) -> [f32; 3] {
        self.evaluate(&HalfDifference::from_angles(angles))
    }

    fn brdf_with_derivative(&self, angles: Angles<f32>) -> ([f32; 3], [[f32; 3]; 3]) {
        let at = HalfDifference::from_angles(Dual::variables(angles));
        Dual::split(self.evaluate(&at))
    }

    fn brdf_batch(&self, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]) {
        for (at, brdf) in at.iter().zip(brdf) {
            *brdf = self.evaluate(at);
        }
    }

    fn is_reciprocal(&self) -> bool {
        true
    }
}

fn fifth<S: Scalar>(x: S) -> S {
    let squared = x * x;
    squared * squared * x
}

#[inline(never)] // The code of the generator is long.
fn uniform(random: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * random.random::<f64>()
}

fn log_uniform(random: &mut ChaCha8Rng, [low, high]: Range) -> f64 {
    uniform(random, low.ln(), high.ln()).exp()
}

fn scaled(color: [f64; 3], scale: f64) -> [f64; 3] {
    color.map(|value| value * scale)
}

fn mixed(a: [f64; 3], b: [f64; 3], fraction: f64) -> [f64; 3] {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * fraction)
}

/// Returns a random color whose largest channel is 1. A pigment absorbs each channel independently, at a saturation of
/// 1 by a factor of up to e^6.
fn tint(random: &mut ChaCha8Rng, saturation: f64) -> [f64; 3] {
    let strength = 6.0 * saturation * uniform(random, 0.0, 1.0);
    let color: [f64; 3] = std::array::from_fn(|_| (-strength * uniform(random, 0.0, 1.0)).exp());
    let largest = color.iter().copied().fold(0.0, f64::max);
    scaled(color, 1.0 / largest)
}

/// Returns a random color from silver over nickel and brass to copper.
fn metal_tint(random: &mut ChaCha8Rng) -> [f64; 3] {
    let warmth = uniform(random, -0.05, 0.6).max(0.0);
    let noise: [f64; 3] = std::array::from_fn(|_| uniform(random, 0.9, 1.1));
    [
        noise[0],
        noise[1] * (1.0 - 0.5 * warmth),
        noise[2] * (1.0 - warmth),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::uniform_valid;

    fn to_f64(angles: Angles<f32>) -> Angles<f64> {
        Angles {
            theta_h: angles.theta_h.into(),
            theta_d: angles.theta_d.into(),
            phi_d: angles.phi_d.into(),
        }
    }

    fn moved(angles: Angles<f64>, angle: usize, by: f64) -> Angles<f64> {
        let mut moved = angles;
        *[&mut moved.theta_h, &mut moved.theta_d, &mut moved.phi_d][angle] += by;
        moved
    }

    /// Returns true near a kink of the formula: where both cosines are equal, and just above the horizon.
    fn is_near_kink(angles: Angles<f64>) -> bool {
        let at = HalfDifference::from_angles(angles);
        let (incoming, outgoing) = (at.cos_theta_i(), at.cos_theta_o());
        (incoming - outgoing).abs() < 2e-3 || incoming.min(outgoing) < 3e-3
    }

    #[test]
    fn derivatives_agree_with_differences() {
        const STEP: f64 = 2e-5;
        let (mut compared, mut discarded, mut largest) = (0, 0, 0.0_f64);
        for material in Procedural::set(60, 3) {
            for angles in uniform_valid(100, 9).into_iter().map(to_f64) {
                if is_near_kink(angles) {
                    discarded += 1;
                    continue;
                }
                let duals = material.evaluate(&HalfDifference::from_angles(
                    Dual::<f64, 3>::variables(angles),
                ));
                let (values, derivative) = Dual::split(duals);
                for angle in [0, 1, 2] {
                    let [far_low, low, high, far_high] = [-2.0, -1.0, 1.0, 2.0].map(|steps| {
                        material.evaluate(&HalfDifference::from_angles(moved(
                            angles,
                            angle,
                            steps * STEP,
                        )))
                    });
                    for channel in 0..3 {
                        let difference = (far_low[channel] - far_high[channel]
                            + 8.0 * (high[channel] - low[channel]))
                            / (12.0 * STEP);
                        let slope = derivative[channel][angle];
                        let error = (slope - difference).abs() / slope.abs().max(values[channel]);
                        largest = largest.max(error);
                        assert!(
                            error < 1e-5,
                            "{}: {slope} and {difference}",
                            material.name()
                        );
                    }
                }
                compared += 1;
            }
        }
        println!("{compared} compared, {discarded} at kinks, largest error {largest:.1e}");
        assert!(
            compared > 5000 && discarded < 300,
            "{compared} and {discarded}"
        );
    }

    #[test]
    fn f32_is_close_to_f64() {
        let mut largest = [0.0_f64; 2];
        for material in Procedural::set(60, 4) {
            for angles in uniform_valid(100, 10) {
                let duals = material.evaluate(&HalfDifference::from_angles(
                    Dual::<f64, 3>::variables(to_f64(angles)),
                ));
                let (exact, exact_derivative) = Dual::split(duals);
                let (with_derivative, derivative) = material.brdf_with_derivative(angles);
                let brdf = material.brdf(angles);
                for channel in 0..3 {
                    for value in [brdf[channel], with_derivative[channel]] {
                        let error = (f64::from(value) - exact[channel]).abs() / exact[channel];
                        largest[0] = largest[0].max(error);
                    }
                    for angle in 0..3 {
                        let slope = exact_derivative[channel][angle];
                        let error = (f64::from(derivative[channel][angle]) - slope).abs();
                        largest[1] = largest[1].max(error / slope.abs().max(exact[channel]));
                    }
                }
            }
        }
        println!("largest errors in f32: {largest:?}");
        assert!(largest[0] < 2e-4 && largest[1] < 5e-4, "{largest:?}");
    }

    #[test]
    fn materials_are_reciprocal_isotropic_and_positive() {
        for material in Procedural::set(60, 5) {
            for angles in uniform_valid(100, 11).into_iter().map(to_f64) {
                let brdf = material.evaluate(&HalfDifference::from_angles(angles));
                let exchanged =
                    material.evaluate(&HalfDifference::from_angles(moved(angles, 2, PI)));
                let pole = |phi_d| {
                    let angles = Angles {
                        theta_h: 0.0,
                        phi_d,
                        ..angles
                    };
                    material.evaluate(&HalfDifference::from_angles(angles))[0]
                };
                assert!((pole(0.0) / pole(angles.phi_d) - 1.0).abs() < 1e-9);
                for (f, exchanged) in brdf.into_iter().zip(exchanged) {
                    assert!(f > 0.0 && f.is_finite(), "{}: {f}", material.name());
                    assert!(
                        (f - exchanged).abs() < 1e-9 * f,
                        "{}: {f} {exchanged}",
                        material.name()
                    );
                }
            }
        }
    }
}
