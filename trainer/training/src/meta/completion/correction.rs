//! The ridge stage after the net, and its adjoint; see [`glimpse_core::fit::ridge`].

use std::sync::OnceLock;

use glimpse_core::fit::ridge::{RidgeGradient, System, factor_length, scratch_length};
use glimpse_core::geometry::Angles;
use glimpse_core::model::linear::unmap;
use glimpse_core::numeric::Matrix;
use glimpse_materials::basis::{Basis, angles_to_f64};

use super::reading::{LOG_SCALE, Reading, Standardization};

const CHANNELS: usize = 3;

/// The components at the samples of a pattern, with the precisions.
pub struct Correction {
    /// m, the number of completed coefficients of a channel.
    completed: usize,
    /// K, the number of components.
    components: usize,
    /// n rows of K.
    rows: Vec<f32>,
    /// The derivatives of the rows with respect to the angles of each sample.
    slopes: Vec<[f32; 3]>,
    precision: Vec<f32>,
    /// The factors for a task with all readings.
    complete: OnceLock<Vec<f32>>,
}

/// Corrected coefficients of a task.
pub struct Corrected {
    /// Those of red, then of green, then of blue.
    pub coefficients: Vec<f32>,
    completed: Vec<f32>,
    /// t of each channel, n; 0 for missing readings.
    targets: [Vec<f32>; CHANNELS],
    /// The weights of the readings: 1, or 0 for missing ones.
    scales: Vec<f32>,
    factors: Vec<f32>,
}

/// The gradient of a correction.
pub struct CorrectionGradient {
    /// With respect to the completed coefficients.
    pub completed: Vec<f32>,
    /// With respect to the precisions.
    pub precision: Vec<f32>,
    /// With respect to the angles of each sample.
    pub angles: Vec<[f32; 3]>,
}

impl Corrected {
    /// Returns the innovation: the mean of |t| over the present readings and channels.
    #[must_use]
    pub fn innovation(&self, present: &[bool]) -> f32 {
        let count = present.iter().filter(|present| **present).count().max(1);
        let sum: f32 = self.targets.iter().flatten().map(|t| t.abs()).sum();
        sum / (CHANNELS * count) as f32
    }
}

impl Correction {
    /// Evaluates the components of a basis at a pattern. The first `completed` of them have completed coefficients.
    #[must_use]
    pub fn new(basis: &Basis, angles: &[Angles<f32>], completed: usize, precision: &[f32]) -> Self {
        let entries = angles
            .iter()
            .map(|angles| basis.look_up(angles_to_f64(angles)));
        let (rows, slopes): (Vec<f32>, Vec<[f32; 3]>) = entries
            .flat_map(|entry| entry.components)
            .map(|[value, slopes @ ..]| (value as f32, slopes.map(|slope| slope as f32)))
            .unzip();
        Self {
            completed,
            components: precision.len(),
            precision: bounded_precision(&rows, precision),
            rows,
            slopes,
            complete: OnceLock::new(),
        }
    }

    fn system<'s>(&'s self, scales: &'s [f32]) -> System<'s, f32, f32, Matrix<'s, f32>> {
        System {
            rows: Matrix(&self.rows, self.components),
            scales,
            precision: &self.precision,
        }
    }

    fn factors(&self, scales: &[f32]) -> Vec<f32> {
        let system = self.system(scales);
        let mut factors = vec![0.0; factor_length(scales.len(), self.components)];
        let mut scratch = vec![0.0; self.components];
        for row in 0..system.order() {
            system.factorize_row(row, &mut factors, &mut scratch);
        }
        factors
    }

    fn row(&self, sample: usize) -> &[f32] {
        &self.rows[sample * self.components..][..self.components]
    }

    /// Returns the BRDF of coefficients at a sample, sr⁻¹.
    #[must_use]
    pub fn brdf(
        &self,
        sample: usize,
        standardization: &Standardization,
        coefficients: &[f32],
    ) -> [f32; CHANNELS] {
        let row = self.row(sample);
        let (mean, cosines) = standardization.mean_and_cosines(sample);
        let mut channels = coefficients.chunks_exact(self.components);
        [(); CHANNELS].map(|()| {
            let list = channels.next().unwrap_or_default();
            unmap(mean + dot(row, list), cosines)
        })
    }

    /// Corrects the completed coefficients of a task.
    #[must_use]
    pub fn correct(&self, readings: &[Reading], present: &[bool], completed: &[f32]) -> Corrected {
        let count = self.components;
        let scales: Vec<f32> = present.iter().map(|present| f32::from(*present)).collect();
        let factors = match present.contains(&false) {
            true => self.factors(&scales),
            false => self.complete.get_or_init(|| self.factors(&scales)).clone(),
        };
        let system = self.system(&scales);
        let mut scratch = vec![0.0; scratch_length(readings.len(), count)];
        let mut coefficients = vec![0.0; CHANNELS * count];
        let lists = coefficients.chunks_exact_mut(count);
        let channels = completed.chunks_exact(self.completed);
        let mut targets = [(); CHANNELS].map(|()| vec![0.0; readings.len()]);
        for (channel, (list, completed)) in lists.zip(channels).enumerate() {
            for (sample, target) in targets[channel].iter_mut().enumerate() {
                if present[sample] {
                    let mapped = readings[sample].standardized[channel].value / LOG_SCALE;
                    *target = mapped - dot(self.row(sample), completed);
                }
            }
            system.solve(&factors, &targets[channel], list, &mut scratch);
            add_scaled(list, 1.0, completed);
        }
        Corrected {
            coefficients,
            completed: completed.to_vec(),
            targets,
            scales,
            factors,
        }
    }

    /// Returns the gradient, given that with respect to the corrected coefficients.
    ///
    /// t depends on the completed coefficients a and the rows: t = u - Q a.
    #[must_use]
    pub fn adjoint(
        &self,
        corrected: &Corrected,
        readings: &[Reading],
        by_corrected: &[f32],
    ) -> CorrectionGradient {
        let (count, samples) = (self.components, readings.len());
        let mut gradient = CorrectionGradient {
            completed: vec![0.0; CHANNELS * self.completed],
            precision: vec![0.0; count],
            angles: vec![[0.0; 3]; samples],
        };
        let system = self.system(&corrected.scales);
        let mut scratch = vec![0.0; count + scratch_length(samples, count)];
        let mut by_rows = vec![0.0; samples * count];
        let channels = corrected.coefficients.chunks_exact(count);
        let channels = channels.zip(by_corrected.chunks_exact(count));
        let initial = corrected.completed.chunks_exact(self.completed);
        let by_initial = gradient.completed.chunks_exact_mut(self.completed);
        for (channel, (((all, lambda), initial), by_initial)) in
            channels.zip(initial).zip(by_initial).enumerate()
        {
            let mut z = all.to_vec();
            add_scaled(&mut z, -1.0, initial);
            let mut by_targets = vec![0.0; samples];
            system.adjoint(
                &corrected.factors,
                (&corrected.targets[channel], &z),
                lambda,
                &mut RidgeGradient {
                    targets: &mut by_targets,
                    rows: &mut by_rows,
                    precision: &mut gradient.precision,
                },
                &mut scratch,
            );
            add_scaled(by_initial, 1.0, lambda);
            let rows = by_rows.chunks_exact_mut(count).zip(by_targets).enumerate();
            for (sample, (by_row, by_target)) in rows {
                add_scaled(by_initial, -by_target, self.row(sample));
                add_scaled(by_row, -by_target, initial);
                let tangent = readings[sample].standardized[channel].tangent;
                let by_angles = &mut gradient.angles[sample];
                add_scaled(by_angles, by_target / LOG_SCALE, &tangent);
            }
        }
        let rows = by_rows.chunks_exact(count);
        let rows = rows.zip(self.slopes.chunks_exact(count));
        for (by_angles, (by_row, slopes)) in gradient.angles.iter_mut().zip(rows) {
            for (by_entry, slopes) in by_row.iter().zip(slopes) {
                add_scaled(by_angles, *by_entry, slopes);
            }
        }
        gradient
    }
}

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

fn dot(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// sum += factor * list, up to the length of the shorter list
fn add_scaled(sum: &mut [f32], factor: f32, list: &[f32]) {
    for (entry, value) in sum.iter_mut().zip(list) {
        *entry += factor * value;
    }
}
