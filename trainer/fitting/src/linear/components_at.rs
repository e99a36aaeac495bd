//! Principal components at some directions, and the ridge system of readings there.

use glimpse_core::fit::ridge::{System, factor_length, scratch_length};
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::{map, unmap};
use glimpse_core::numeric::Matrix;
use glimpse_kernels::{AngleDual, Dual};
use glimpse_materials::basis::BasisTable;
use glimpse_materials::lists::{add_scaled, dot};

/// The K components of a basis at n directions, with derivatives with respect to the angles.
#[derive(Clone, Debug, Default)]
pub struct ComponentsAt {
    /// The directions, n.
    pub angles: Vec<Angles<f32>>,
    /// K, the number of components.
    pub components: usize,
    /// The components: n rows of K values.
    pub rows: Vec<f32>,
    /// The derivatives of each entry of the rows.
    pub slopes: Vec<[f32; 3]>,
    /// The mean of ln((f w + e) / e) over the training BRDFs f, n values.
    pub mean: Vec<AngleDual<f32>>,
    /// cos(theta_i) cos(theta_o), n values.
    pub cosines: Vec<AngleDual<f32>>,
    /// cos(theta_i), n values.
    pub cos_theta_i: Vec<f32>,
}

impl ComponentsAt {
    /// Evaluates a basis at angles in radians.
    #[must_use]
    pub fn new(basis: &BasisTable, angles: Vec<Angles<f32>>) -> Self {
        let mut at = Self {
            components: basis.components(),
            angles,
            ..Self::default()
        };
        let single = |slopes: [f64; 3]| slopes.map(|slope| slope as f32);
        for angles in &at.angles {
            let entry = basis.look_up(angles.map(f64::from));
            let [mean, derivatives @ ..] = entry.center;
            at.mean.push(Dual {
                value: mean as f32,
                tangent: single(derivatives),
            });
            for [value, derivatives @ ..] in entry.components {
                at.rows.push(value as f32);
                at.slopes.push(single(derivatives));
            }
            let direction = HalfDifference::from_angles(AngleDual::variables(*angles));
            at.cosines
                .push(direction.cos_theta_i() * direction.cos_theta_o());
            at.cos_theta_i.push(direction.cos_theta_i().value);
        }
        at
    }

    /// Returns n, the number of directions.
    #[inline]
    #[must_use]
    pub fn count(&self) -> usize {
        self.angles.len()
    }

    /// Returns the components at a direction.
    #[inline]
    #[must_use]
    pub fn row(&self, direction: usize) -> &[f32] {
        &self.rows[direction * self.components..][..self.components]
    }

    /// Returns the values of the mean.
    #[must_use]
    pub fn means(&self) -> Vec<f32> {
        self.mean.iter().map(|mean| mean.value).collect()
    }

    /// Returns a BRDF at a direction (sr⁻¹, not times the cosine), mapped and minus the mean.
    #[inline]
    #[must_use]
    pub fn mapped(&self, direction: usize, brdf: AngleDual<f32>) -> AngleDual<f32> {
        map(brdf, self.cosines[direction]) - self.mean[direction]
    }

    /// Returns the BRDF of coefficients at a direction, sr⁻¹, not times the cosine. `coefficients` are those of red, then
    /// green, then blue.
    #[inline]
    #[must_use]
    pub fn brdf(&self, direction: usize, coefficients: &[f32]) -> [f32; 3] {
        let row = self.row(direction);
        let (mean, cosines) = (self.mean[direction].value, self.cosines[direction].value);
        let mut channels = coefficients.chunks_exact(self.components);
        [(); 3].map(|()| {
            let list = channels.next().unwrap_or_default();
            unmap(mean + dot(row, list), cosines)
        })
    }

    /// Returns the ridge system of readings at the directions. `precision` has K values, `scales` the weight of each
    /// reading.
    #[inline]
    #[must_use]
    pub fn system<'s>(
        &'s self,
        precision: &'s [f32],
        scales: &'s [f32],
    ) -> System<'s, f32, f32, Matrix<'s, f32>> {
        System {
            rows: Matrix(&self.rows, self.components),
            scales,
            precision,
        }
    }

    /// Factorizes the ridge system.
    #[must_use]
    pub fn factorize(&self, precision: &[f32], scales: &[f32]) -> Vec<f32> {
        let system = self.system(precision, scales);
        let mut factors = vec![0.0; factor_length(self.count(), self.components)];
        let mut scratch = vec![0.0; self.components];
        for row in 0..system.order() {
            system.factorize_row(row, &mut factors, &mut scratch);
        }
        factors
    }

    /// Returns the coefficients of readings at all directions (BRDF in linear RGB, sr⁻¹, not times the cosine): those of
    /// red, then green, then blue.
    #[must_use]
    pub fn fit(&self, precision: &[f32], readings: &[[f32; 3]]) -> Vec<f32> {
        self.solve(precision, self.mapped_channels(readings))
            .concat()
    }

    /// Returns the coefficients with precisions of the mean of the channels, and of the differences from it, as core's
    /// estimator does.
    #[must_use]
    pub fn fit_channels(&self, precision: [&[f32]; 2], readings: &[[f32; 3]]) -> Vec<f32> {
        let mut channels = self.mapped_channels(readings);
        let [red, green, blue] = &channels;
        let sums = red.iter().zip(green).zip(blue);
        let mean: Vec<f32> = sums.map(|((r, g), b)| (r + g + b) / 3.0).collect();
        for channel in &mut channels {
            add_scaled(channel, -1.0, &mean);
        }
        let [mean] = self.solve(precision[0], [mean]);
        let mut coefficients = self.solve(precision[1], channels);
        for channel in &mut coefficients {
            add_scaled(channel, 1.0, &mean);
        }
        coefficients.concat()
    }

    /// Returns the mapped readings of each channel, minus the mean.
    pub(super) fn mapped_channels(&self, readings: &[[f32; 3]]) -> [Vec<f32>; 3] {
        [0, 1, 2].map(|channel| {
            let readings = readings.iter().enumerate();
            let mapped = readings.map(|(direction, brdf)| {
                self.mapped(direction, Dual::from_value(brdf[channel]))
                    .value
            });
            mapped.collect()
        })
    }

    /// Solves the ridge system for lists of targets.
    fn solve<const N: usize>(&self, precision: &[f32], targets: [Vec<f32>; N]) -> [Vec<f32>; N] {
        let scales = vec![1.0; self.count()];
        let factors = self.factorize(precision, &scales);
        let system = self.system(precision, &scales);
        let mut scratch = vec![0.0; scratch_length(self.count(), self.components)];
        targets.map(|targets| {
            let mut coefficients = vec![0.0; self.components];
            system.solve(&factors, &targets, &mut coefficients, &mut scratch);
            coefficients
        })
    }
}

// The functions of inner loops are inlined into other crates, of which training is one.

/// The largest ratio of a component's squared entries to its precision.
const MAX_RATIO: f32 = 3e4;

/// Raises the precisions that would make the system of order n too ill-conditioned for the device's f32. They hardly
/// restrain their coefficients.
#[must_use]
pub fn bounded_precision(rows: &[f32], precision: &[f32]) -> Vec<f32> {
    let mut bounded = precision.to_vec();
    for row in rows.chunks_exact(precision.len().max(1)) {
        for (precision, entry) in bounded.iter_mut().zip(row) {
            *precision = precision.max(entry * entry / MAX_RATIO);
        }
    }
    bounded
}
