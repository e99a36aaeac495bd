//! Materials made up to look measured: richer than any model here can fit.
//!
//! Each is a diffuse base with retro-reflection at grazing angles, two microfacet lobes of one
//! highlight (a core and a wider haze, GTR), Schlick's Fresnel, sheen, a retro-reflective lobe,
//! and noise that grows towards grazing angles, as gonioreflectometers show it. The kinds are those
//! that one finds among measured materials: metals, metallic paints, plastics and lacquers, rubbers
//! and other rough ones, fabrics, woods. Their ranges are wide enough that a set of them is spread
//! as measured materials are: in brightness and width of highlights and their tails, in their rise
//! towards grazing angles, in albedo and in saturation.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::numeric::{Scalar, Trigonometry};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;

use crate::Material;
use glimpse_kernels::Dual;

/// What a number may be, from the lowest to the highest.
type Range = [f64; 2];

/// One kind of materials. Of roughness, width, reflectance and albedo all orders of magnitude are
/// equally likely.
struct Kind {
    class: Class,
    /// Its share of a set.
    share: f64,
    /// Roughness of the core, and how much wider the haze is.
    roughness: Range,
    wider: Range,
    /// The haze's share of the highlight.
    haze: Range,
    /// Reflectance at normal incidence.
    fresnel: Range,
    /// Albedo of the diffuse part's brightest channel.
    diffuse: Range,
    /// The strongest retro-reflective lobe.
    retro: f64,
}

/// The class of a kind.
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
    /// The name, the last part of a material's name.
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

const KINDS: [Kind; 6] = [
    Kind {
        class: Class::Metal,
        share: 0.22,
        roughness: [0.003, 0.3],
        wider: [1.5, 8.0],
        haze: [0.1, 0.8],
        fresnel: [0.1, 0.6],
        diffuse: [1e-4, 0.1],
        retro: 0.0,
    },
    Kind {
        class: Class::MetallicPaint,
        share: 0.15,
        roughness: [0.004, 0.2],
        wider: [1.5, 16.0],
        haze: [0.2, 0.95],
        fresnel: [0.03, 0.25],
        diffuse: [0.003, 0.3],
        retro: 0.0,
    },
    Kind {
        class: Class::Plastic,
        share: 0.27,
        roughness: [0.002, 0.25],
        wider: [1.5, 8.0],
        haze: [0.1, 0.8],
        fresnel: [0.015, 0.06],
        diffuse: [0.002, 0.7],
        retro: 0.0,
    },
    Kind {
        class: Class::Rubber,
        share: 0.12,
        roughness: [0.15, 0.6],
        wider: [1.2, 2.5],
        haze: [0.2, 0.9],
        fresnel: [0.01, 0.06],
        diffuse: [0.01, 0.6],
        retro: 0.0,
    },
    Kind {
        class: Class::Fabric,
        share: 0.12,
        roughness: [0.25, 0.9],
        wider: [1.1, 1.8],
        haze: [0.2, 0.9],
        fresnel: [0.01, 0.08],
        diffuse: [0.01, 0.6],
        retro: 0.15,
    },
    Kind {
        class: Class::Wood,
        share: 0.12,
        roughness: [0.05, 0.4],
        wider: [1.3, 4.0],
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
    /// Burley's F90 of the diffuse part: below 1 darkens grazing angles, above brightens them.
    diffuse_grazing: f64,
    /// Highlight: strength in linear RGB, reflectance at normal incidence.
    specular: [f64; 3],
    fresnel: f64,
    /// How much of Schlick's rise to 1 at grazing angles is there.
    fresnel_rise: f64,
    core: Lobe,
    haze: Lobe,
    /// What shadows at grazing angles besides roughness: dust, scratches, the edges of a light's cone.
    shadow: f64,
    /// Sheen at large theta_d, in linear RGB.
    sheen: [f64; 3],
    /// Retro-reflective lobe at small theta_d: strength and width.
    retro: f64,
    retro_width: f64,
    /// Noise: amplitude at the horizon; of each wave its frequencies along h_x, d_z and (h_x d_x)^2, and a
    /// phase.
    noise: f64,
    waves: [[f64; 4]; 4],
}

/// A microfacet lobe.
#[derive(Clone, Debug)]
struct Lobe {
    roughness: f64,
    /// How fast it falls off: the gamma of the GTR distribution; 2 is GGX, more has less tail.
    falloff: f64,
    /// What the distribution is multiplied by.
    scale: f64,
}

impl Lobe {
    /// One whose distribution integrates to `share`.
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
    /// The first `count` materials of the set with this seed.
    #[must_use]
    pub fn set(count: usize, seed: u64) -> Vec<Self> {
        (0..count).map(|index| Self::new(index, seed)).collect()
    }

    /// Material `index` of the set with this seed.
    #[must_use]
    pub fn new(index: usize, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(index as u64);
        let random = &mut random;
        // Kinds come in a fixed proportion along a low-discrepancy sequence (golden ratio), so
        // that small sets are mixed well too.
        let mut share = (index as f64 * 0.618_033_988_749_895 + uniform(random, 0.0, 0.02)) % 1.0;
        let mut kind = &KINDS[0];
        for each in &KINDS {
            kind = each;
            share -= kind.share;
            if share < 0.0 {
                break;
            }
        }
        // Sets of different seeds have no name in common.
        let set = match seed {
            0 => String::new(),
            seed => format!("{seed}-"),
        };
        let name = format!("procedural-{set}{index:03}-{}", kind.class.name());
        Self::of_kind(kind, name, random)
    }

    fn of_kind(kind: &Kind, name: String, random: &mut ChaCha8Rng) -> Self {
        let hue = match kind.class {
            Class::Metal => metal_tint(random),
            Class::Wood => {
                let stain = tint(random, 0.6);
                mixed([0.75, 0.42, 0.2], stain, uniform(random, 0.0, 0.5))
            }
            _ => tint(random, 0.95),
        };
        // What reflects at its surface is white, unless the light has met pigments before.
        let specular = match kind.class {
            Class::Metal => hue,
            Class::MetallicPaint | Class::Fabric => mixed(hue, [1.0; 3], uniform(random, 0.1, 0.9)),
            _ => [1.0; 3],
        };
        let sheen = mixed(hue, [1.0; 3], uniform(random, 0.0, 1.0));
        let core = log_uniform(random, kind.roughness);
        let wider = log_uniform(random, kind.wider);
        let haze_share = uniform(random, kind.haze[0], kind.haze[1]);
        let mut lobe = |roughness, share| {
            let falloff = log_uniform(random, [1.05, 3.0]);
            Lobe::new(roughness, falloff, share)
        };
        let core_lobe = lobe(core, 1.0 - haze_share);
        let haze_lobe = lobe((core * wider).min(0.99), haze_share);
        Self {
            name,
            diffuse: scaled(hue, log_uniform(random, kind.diffuse)),
            diffuse_grazing: uniform(random, 0.4, 1.8),
            // Measured highlights are weaker than those of ideal interfaces.
            specular: scaled(specular, log_uniform(random, [0.25, 1.0])),
            fresnel: log_uniform(random, kind.fresnel),
            fresnel_rise: uniform(random, 0.4, 1.0),
            core: core_lobe,
            haze: haze_lobe,
            shadow: log_uniform(random, [0.02, 0.3]),
            sheen: scaled(sheen, log_uniform(random, [0.001, 0.3])),
            retro: uniform(random, 0.0, kind.retro),
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
        // Just above the horizon at least, so that nothing diverges outside of the valid region.
        let floor = |cosine: S| (cosine - c(1e-3)).relu() + c(1e-3);
        let (incoming, outgoing) = (floor(at.cos_theta_i()), floor(at.cos_theta_o()));

        let grazing = c(self.diffuse_grazing - 1.0);
        let mut base = (one + grazing * fifth(one - incoming))
            * (one + grazing * fifth(one - outgoing))
            * c(1.0 / PI);
        if self.retro > 0.0 {
            let apart = (one - at.dz * at.dz) * c(1.0 / self.retro_width);
            base = base + c(self.retro / PI) * (-apart).exp();
        }

        let grazing_difference = fifth(one - at.dz);
        let fresnel =
            c(self.fresnel) + c(self.fresnel_rise * (1.0 - self.fresnel)) * grazing_difference;
        let lobe = |lobe: &Lobe| {
            // (cos^2 (a^2 - 1) + 1), without the cancellation at sharp highlights.
            let bell = at.hx * at.hx + at.hz * at.hz * c(lobe.roughness * lobe.roughness);
            let distribution = c(lobe.scale) * (-(bell.ln() * c(lobe.falloff))).exp();
            let shadow = (0.5 * lobe.roughness + self.shadow).min(1.0);
            let visible = |cosine: S| cosine * c(1.0 - shadow) + c(shadow);
            distribution * c(0.25) / (visible(incoming) * visible(outgoing))
        };
        let highlight = fresnel * (lobe(&self.core) + lobe(&self.haze));

        let mut noise = c(0.0);
        // Of phi_d there is none at the pole, and the same on the other side.
        let turn = at.hx * at.dx;
        let turn = turn * turn;
        for [hx, dz, by_turn, phase] in self.waves {
            let wave = at.hx * c(hx) + at.dz * c(dz) + turn * c(by_turn) + c(phase);
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

#[inline(never)] // it draws from the generator, whose code is long
fn uniform(random: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * random.random::<f64>()
}

fn log_uniform(random: &mut ChaCha8Rng, [low, high]: Range) -> f64 {
    uniform(random, low.ln(), high.ln()).exp()
}

fn scaled(color: [f64; 3], scale: f64) -> [f64; 3] {
    color.map(|value| value * scale)
}

fn mixed(a: [f64; 3], b: [f64; 3], share: f64) -> [f64; 3] {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * share)
}

/// A color whose largest channel is 1. A pigment dims each channel by its own absorption; at a
/// saturation of 1 it does so by up to a factor of e^6.
fn tint(random: &mut ChaCha8Rng, saturation: f64) -> [f64; 3] {
    let strength = 6.0 * saturation * uniform(random, 0.0, 1.0);
    let color: [f64; 3] = std::array::from_fn(|_| (-strength * uniform(random, 0.0, 1.0)).exp());
    let largest = color.iter().copied().fold(0.0, f64::max);
    scaled(color, 1.0 / largest)
}

/// From silver over nickel and brass to copper.
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

    fn place(angles: Angles<f32>) -> Angles<f64> {
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

    /// The formula has kinks where the two directions are equally low, and just above the horizon.
    fn near_kink(angles: Angles<f64>) -> bool {
        let at = HalfDifference::from_angles(angles);
        let (incoming, outgoing) = (at.cos_theta_i(), at.cos_theta_o());
        (incoming - outgoing).abs() < 2e-3 || incoming.min(outgoing) < 3e-3
    }

    #[test]
    fn derivatives_agree_with_differences() {
        const STEP: f64 = 2e-5;
        let (mut compared, mut discarded, mut largest) = (0, 0, 0.0_f64);
        for material in Procedural::set(60, 3) {
            for angles in uniform_valid(100, 9).into_iter().map(place) {
                if near_kink(angles) {
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
    fn single_precision_is_close_to_double() {
        let mut largest = [0.0_f64; 2];
        for material in Procedural::set(60, 4) {
            for angles in uniform_valid(100, 10) {
                let duals = material.evaluate(&HalfDifference::from_angles(
                    Dual::<f64, 3>::variables(place(angles)),
                ));
                let (exact, exact_derivative) = Dual::split(duals);
                let (beside, derivative) = material.brdf_with_derivative(angles);
                let found = material.brdf(angles);
                for channel in 0..3 {
                    for found in [found[channel], beside[channel]] {
                        let error = (f64::from(found) - exact[channel]).abs() / exact[channel];
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
        println!("largest errors in single precision: {largest:?}");
        assert!(largest[0] < 2e-4 && largest[1] < 5e-4, "{largest:?}");
    }

    #[test]
    fn materials_are_reciprocal_isotropic_and_positive() {
        for material in Procedural::set(60, 5) {
            for angles in uniform_valid(100, 11).into_iter().map(place) {
                let found = material.evaluate(&HalfDifference::from_angles(angles));
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
                for (f, exchanged) in found.into_iter().zip(exchanged) {
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
