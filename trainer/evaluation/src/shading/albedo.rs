//! The directional albedo of dielectric microfacets: the share of light that they reflect.

use std::f64::consts::TAU;
use std::sync::LazyLock;

use glimpse_materials::lists::add_scaled;

use super::fresnel::schlick_weight;
use super::microfacets::correlated_shadowing;

/// The number of entries of the table along each axis.
const SIZE: usize = 32;
/// The number of half vectors per entry.
const SAMPLES: u32 = 1024;

/// For each roughness and cosine: the albedo is the first number times the reflectance at normal incidence, plus the second
/// (Schlick's approximation).
static TABLE: LazyLock<Vec<[f64; 2]>> = LazyLock::new(|| {
    let coordinate = |index: usize| (index as f64 + 0.5) / SIZE as f64;
    (0..SIZE * SIZE)
        .map(|entry| integrate(coordinate(entry / SIZE), coordinate(entry % SIZE)))
        .collect()
});

/// The albedo of microfacets toward a direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Albedo {
    /// The albedo is this number times the reflectance at normal incidence,
    scale: f64,
    /// plus this one.
    offset: f64,
}

impl Albedo {
    /// Returns the albedo of microfacets with this reflectance at normal incidence, for single reflections.
    pub(super) fn single(self, normal: f64) -> f64 {
        normal * self.scale + self.offset
    }

    /// Returns the factor by which light that is reflected several times makes a BRDF larger (Turquin 2019). `fresnel` is the
    /// reflectance of one reflection.
    pub(super) fn compensation(self, fresnel: f64) -> f64 {
        let perfect = self.single(1.0);
        1.0 + fresnel * (1.0 - perfect) / perfect
    }
}

/// Returns the albedo toward a direction with this cosine, above 0 to 1. `alpha` is the roughness of the distribution, 0 to 1.
pub(super) fn albedo(alpha: f64, cosine: f64) -> Albedo {
    let position = |value: f64| (value * SIZE as f64 - 0.5).clamp(0.0, (SIZE - 1) as f64);
    let [row, column] = [alpha, cosine].map(position);
    let (row_share, column_share) = (row.fract(), column.fract());
    let (row, column) = (row as usize, column as usize);
    let mut sums = [0.0; 2];
    for (row, weight) in [(row, 1.0 - row_share), (row + 1, row_share)] {
        for (column, share) in [(column, 1.0 - column_share), (column + 1, column_share)] {
            let entry = TABLE[row.min(SIZE - 1) * SIZE + column.min(SIZE - 1)];
            add_scaled(&mut sums, weight * share, &entry);
        }
    }
    let [scale, offset] = sums;
    Albedo { scale, offset }
}

/// Integrates over half vectors that are distributed as the microfacets.
fn integrate(alpha: f64, cosine: f64) -> [f64; 2] {
    let sine = (1.0 - cosine * cosine).sqrt();
    let mut sums = [0.0; 2];
    for sample in 0..SAMPLES {
        let share = (f64::from(sample) + 0.5) / f64::from(SAMPLES);
        let phi = TAU * (f64::from(sample) * 0.618_033_988_749_895).fract();
        let cos_half = ((1.0 - share) / (1.0 + (alpha * alpha - 1.0) * share)).sqrt();
        let sin_half = (1.0 - cos_half * cos_half).sqrt();
        let difference = sine * sin_half * phi.cos() + cosine * cos_half;
        let light = 2.0 * difference * cos_half - cosine;
        if difference <= 0.0 || light <= 0.0 {
            continue;
        }
        let weight = correlated_shadowing(alpha, light, cosine) * difference / (cosine * cos_half);
        let grazing = schlick_weight(difference);
        add_scaled(&mut sums, weight, &[1.0 - grazing, grazing]);
    }
    sums.map(|sum| sum / f64::from(SAMPLES))
}
