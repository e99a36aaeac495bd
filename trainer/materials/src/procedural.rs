//! Procedural materials that resemble measured ones. No model of this project can fit them exactly.
//!
//! Each material has a diffuse base with retro-reflection at grazing angles, a highlight of two GTR microfacet lobes (a
//! core and a wider haze), Schlick's Fresnel term, sheen, a retro-reflective lobe, and noise. The noise increases
//! towards grazing angles, as in gonioreflectometer data. Under a clear coat the haze is a layer of its own: a metal, or
//! flakes with a thin film whose color travels with theta_d.
//!
//! The classes are those of measured materials: metals, metallic paints, plastics and lacquers, rubbers and other rough
//! materials, fabrics, woods, pearlescent paints, coated metals, and velvets. These properties vary as much within a set
//! as among measured materials: brightness and width of highlights and of their tails, increase towards grazing angles,
//! albedo, and saturation.

mod reflectors;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::numeric::{Scalar, Trigonometry};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use std::fmt;
use std::sync::LazyLock;

use crate::rows::rows;
use crate::sampling::random_stream;
use crate::{Brdf, BrdfWithDerivative, Material};
use glimpse_kernels::Dual;
use reflectors::{Film, Lobe};

/// The smallest and largest value of a parameter.
type Range = [f64; 2];

/// The parameter ranges of a class. `roughness`, `haze_roughness_ratio`, `fresnel` and `diffuse` are log-uniform.
#[derive(Deserialize)]
struct ClassRanges {
    class: Class,
    /// The fraction of a set's materials that are of this class.
    share: f64,
    /// Roughness of the highlight's core.
    roughness: Range,
    /// Ratio of the haze's roughness to the core's.
    haze_roughness_ratio: Range,
    /// The haze's fraction of the highlight.
    haze_share: Range,
    /// Reflectance at normal incidence.
    fresnel: Range,
    /// Albedo of the diffuse part's brightest channel.
    diffuse: Range,
    /// The largest strength of the retro-reflective lobe.
    max_retro: f64,
    /// Reflectance of the layer under a clear coat, whose highlight is the haze. None without a clear coat: core and
    /// haze are then parts of one highlight.
    layer: Option<Range>,
}

/// A class of materials. Its text is the last part of a material's name.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Class {
    Metal,
    MetallicPaint,
    Plastic,
    Rubber,
    Fabric,
    Wood,
    PearlescentPaint,
    CoatedMetal,
    Velvet,
}

/// The classes, in the order of their indices.
static CLASSES: LazyLock<Vec<ClassRanges>> =
    LazyLock::new(|| rows(include_str!("procedural/classes.csv")));

impl fmt::Display for Class {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

/// A procedural material.
#[derive(Clone, Debug)]
pub struct Procedural {
    name: String,
    class: Class,
    /// Diffuse albedo, in linear RGB.
    diffuse: [f64; 3],
    /// F90 of Burley's diffuse term. Grazing angles are darker with a value below 1, and brighter with a value above 1.
    diffuse_grazing: f64,
    /// The two lobes of the highlight: a core, and a wider haze.
    lobes: [Lobe; 2],
    /// The thin film on the reflectors of the haze.
    film: Option<Film>,
    /// Shadowing at grazing angles that roughness does not explain: dust, scratches, the edges of the light's cone.
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

impl Procedural {
    /// Returns the first `count` materials of a seed's set.
    #[must_use]
    pub fn set(count: usize, seed: u64) -> Vec<Self> {
        (0..count).map(|index| Self::new(index, seed)).collect()
    }

    /// Returns material `index` of a seed's set.
    #[must_use]
    pub fn new(index: usize, seed: u64) -> Self {
        let random = &mut random_stream(seed, index as u64);
        // A low-discrepancy sequence (golden ratio) selects the class, so that even small sets contain all classes.
        let mut remaining_share =
            (index as f64 * 0.618_033_988_749_895 + uniform(random, 0.0, 0.02)) % 1.0;
        let is_before = |ranges: &&ClassRanges| {
            remaining_share -= ranges.share;
            remaining_share >= 0.0
        };
        let before = CLASSES.iter().take_while(is_before).count();
        let ranges = &CLASSES[before.min(CLASSES.len() - 1)];
        // Materials of different seeds have different names.
        let prefix = match seed {
            0 => String::new(),
            seed => format!("{seed}-"),
        };
        let name = format!("procedural-{prefix}{index:03}-{}", ranges.class);
        Self::from_ranges(ranges, name, random)
    }

    /// Returns the index of the material's class, for splits by class.
    #[must_use]
    pub fn class_index(&self) -> usize {
        self.class as usize
    }

    fn from_ranges(ranges: &ClassRanges, name: String, random: &mut ChaCha8Rng) -> Self {
        let base_color = match ranges.class {
            Class::Metal | Class::CoatedMetal => metal_tint(random),
            Class::Wood => {
                let stain = tint(random, 0.6);
                mix([0.75, 0.42, 0.2], stain, uniform(random, 0.0, 0.5))
            }
            _ => tint(random, 0.95),
        };
        // Surface reflection is white, except on metals and pigmented surfaces.
        let specular = match ranges.class {
            Class::Metal => base_color,
            Class::MetallicPaint | Class::Fabric | Class::Velvet => {
                mix(base_color, [1.0; 3], uniform(random, 0.1, 0.9))
            }
            _ => [1.0; 3],
        };
        // Measured highlights are weaker than those of ideal interfaces.
        let specular = scaled(specular, log_uniform(random, [0.25, 1.0]));
        let sheen = mix(base_color, [1.0; 3], uniform(random, 0.0, 1.0));
        let sheen_range = match ranges.class {
            Class::Velvet => [0.1, 1.5],
            _ => [0.001, 0.3],
        };
        let core_roughness = log_uniform(random, ranges.roughness);
        let haze_roughness_ratio = log_uniform(random, ranges.haze_roughness_ratio);
        let haze_share = uniform(random, ranges.haze_share[0], ranges.haze_share[1]);
        let haze_roughness = (core_roughness * haze_roughness_ratio).min(0.99);
        let fresnel = [
            log_uniform(random, ranges.fresnel),
            uniform(random, 0.4, 1.0),
        ];
        let (layer, film) = match ranges.layer {
            None => ((specular, fresnel), None),
            Some(reflectance) => {
                let reflectance = log_uniform(random, reflectance);
                let film = matches!(ranges.class, Class::PearlescentPaint).then(|| {
                    let path = uniform(random, 200.0, 1_400.0);
                    Film::new(path, uniform(random, 0.2, 0.95), uniform(random, 1.4, 2.4))
                });
                let pigment = mix(base_color, [1.0; 3], uniform(random, 0.0, 1.0));
                let color = match ranges.class {
                    Class::CoatedMetal => base_color,
                    _ => pigment,
                };
                ((color, [reflectance, 0.2]), film)
            }
        };
        let mut lobe = |(color, fresnel), roughness: f64, share| {
            let falloff = log_uniform(random, [1.05, 3.0]);
            // The distribution integrates to the share.
            let squared = roughness * roughness;
            let norm =
                (falloff - 1.0) * (squared - 1.0) / (PI * (1.0 - squared.powf(1.0 - falloff)));
            Lobe {
                color,
                fresnel,
                roughness,
                falloff,
                scale: share * norm,
            }
        };
        let lobes = [
            lobe((specular, fresnel), core_roughness, 1.0 - haze_share),
            lobe(layer, haze_roughness, haze_share),
        ];
        Self {
            name,
            class: ranges.class,
            diffuse: scaled(base_color, log_uniform(random, ranges.diffuse)),
            diffuse_grazing: uniform(random, 0.4, 1.8),
            lobes,
            film,
            shadow: log_uniform(random, [0.02, 0.3]),
            sheen: scaled(sheen, log_uniform(random, sheen_range)),
            retro: uniform(random, 0.0, ranges.max_retro),
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
        // A lower limit of the cosines keeps every term finite outside the valid region.
        let limited = |cosine: S| (cosine - c(1e-3)).relu() + c(1e-3);
        let (cos_i, cos_o) = (limited(at.cos_theta_i()), limited(at.cos_theta_o()));

        let grazing_increase = c(self.diffuse_grazing - 1.0);
        let mut base = (one + grazing_increase * fifth_power(one - cos_i))
            * (one + grazing_increase * fifth_power(one - cos_o))
            * c(1.0 / PI);
        if self.retro > 0.0 {
            let exponent = (one - at.dz * at.dz) * c(1.0 / self.retro_width);
            base = base + c(self.retro / PI) * (-exponent).exp();
        }

        let schlick_weight = fifth_power(one - at.dz);
        let lobe_value = |lobe: &Lobe| {
            // The base of the GTR distribution, cos^2(theta_h) (roughness^2 - 1) + 1. This form has no cancellation at
            // sharp highlights.
            let gtr_base = at.hx * at.hx + at.hz * at.hz * c(lobe.roughness * lobe.roughness);
            let distribution = c(lobe.scale) * (-(gtr_base.ln() * c(lobe.falloff))).exp();
            // Schlick's approximation of Smith's G1 is cosine / (cosine (1 - k) + k), where k is `shadow`. The cosine
            // above cancels with a cosine in the denominator of the microfacet BRDF.
            let shadow = (0.5 * lobe.roughness + self.shadow).min(1.0);
            let g1_denominator = |cosine: S| cosine * c(1.0 - shadow) + c(shadow);
            distribution * c(0.25) / (g1_denominator(cos_i) * g1_denominator(cos_o))
        };
        let highlights = self.lobes.each_ref().map(|lobe| {
            let [normal, rise] = lobe.fresnel;
            lobe_value(lobe) * (c(normal) + c(rise * (1.0 - normal)) * schlick_weight)
        });

        let mut wave_sum = c(0.0);
        // (h_x d_x)^2 is 0 at the pole, where phi_d has no meaning. It has period pi in phi_d.
        let azimuthal = at.hx * at.dx;
        let azimuthal = azimuthal * azimuthal;
        for [along_hx, along_dz, along_azimuthal, phase] in self.waves {
            let angle = at.hx * c(along_hx)
                + at.dz * c(along_dz)
                + azimuthal * c(along_azimuthal)
                + c(phase);
            wave_sum = wave_sum + angle.sin_cos().0 * c(0.25);
        }
        let lower_cosine = (cos_i - cos_o).if_positive(cos_o, cos_i);
        let noise_factor = one + c(self.noise) * fifth_power(one - lower_cosine) * wave_sum;

        std::array::from_fn(|channel| {
            let diffuse = base * c(self.diffuse[channel]);
            let sheen = schlick_weight * c(self.sheen[channel] / PI);
            let [core, haze] = self.lobes.each_ref().map(|lobe| c(lobe.color[channel]));
            let film = self.film.as_ref();
            let film = film.map_or(one, |film| film.factor(channel, at.dz));
            let highlight = highlights[0] * core + highlights[1] * haze * film;
            (diffuse + sheen + highlight) * noise_factor
        })
    }
}

impl Brdf for Procedural {
    fn at_angles(&self, angles: Angles<f32>) -> [f32; 3] {
        self.evaluate(&HalfDifference::from_angles(angles))
    }

    fn values_at(&self, at: &[HalfDifference<f32>]) -> Vec<[f32; 3]> {
        at.iter().map(|at| self.evaluate(at)).collect()
    }
}

impl Material for Procedural {
    fn name(&self) -> &str {
        &self.name
    }

    fn with_derivatives(&self, angles: &[Angles<f32>]) -> Vec<BrdfWithDerivative> {
        let at = |angles: &Angles<f32>| HalfDifference::from_angles(Dual::variables(*angles));
        let duals = angles.iter().map(|angles| self.evaluate(&at(angles)));
        duals.map(Dual::split).collect()
    }

    fn is_reciprocal(&self) -> bool {
        true
    }
}

fn fifth_power<S: Scalar>(x: S) -> S {
    let squared = x * x;
    squared * squared * x
}

#[inline(never)] // Inlining would repeat the generator's long code at every call.
fn uniform(random: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * random.random::<f64>()
}

fn log_uniform(random: &mut ChaCha8Rng, [low, high]: Range) -> f64 {
    uniform(random, low.ln(), high.ln()).exp()
}

fn scaled(color: [f64; 3], scale: f64) -> [f64; 3] {
    color.map(|value| value * scale)
}

fn mix(a: [f64; 3], b: [f64; 3], fraction: f64) -> [f64; 3] {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * fraction)
}

/// Returns a random color whose largest channel is 1. A pigment attenuates each channel independently, by a factor of
/// up to e^(6 `saturation`).
fn tint(random: &mut ChaCha8Rng, saturation: f64) -> [f64; 3] {
    let strength = 6.0 * saturation * uniform(random, 0.0, 1.0);
    let color: [f64; 3] = std::array::from_fn(|_| (-strength * uniform(random, 0.0, 1.0)).exp());
    let largest = color.iter().copied().fold(0.0, f64::max);
    scaled(color, 1.0 / largest)
}

/// Returns a random color between silver and copper, through nickel and brass.
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
mod tests;
