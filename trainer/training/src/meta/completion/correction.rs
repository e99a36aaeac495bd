//! The correction of completed coefficients by the residuals of the readings, and its adjoint; see
//! [`glimpse_core::fit::correction`].

use std::sync::OnceLock;

use glimpse_core::fit::ridge::{
    add_outer_product, factorize_row_with, packed_length, solve_factorized,
};
use glimpse_core::geometry::Angles;
use glimpse_core::model::linear::unmap;
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
    /// The factors of Q'Q + P for a task with all readings.
    complete: OnceLock<Vec<f32>>,
}

/// Corrected coefficients of a task.
pub struct Corrected {
    /// Those of red, then of green, then of blue.
    pub coefficients: Vec<f32>,
    completed: Vec<f32>,
    /// r, for each sample and channel.
    residuals: Vec<[f32; CHANNELS]>,
    /// The factors of Q'Q + P.
    packed: Vec<f32>,
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
    /// Returns the innovation: the mean of |r| over the present readings and channels.
    #[must_use]
    pub fn innovation(&self, present: &[bool]) -> f32 {
        let count = present.iter().filter(|present| **present).count().max(1);
        let sum: f32 = self.residuals.iter().flatten().map(|r| r.abs()).sum();
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
            rows,
            slopes,
            precision: precision.to_vec(),
            complete: OnceLock::new(),
        }
    }

    fn present_rows<'r>(
        &'r self,
        present: &'r [bool],
    ) -> impl Iterator<Item = (usize, &'r [f32])> + 'r {
        let rows = self.rows.chunks_exact(self.components).enumerate();
        rows.filter(|(sample, _)| present[*sample])
    }

    fn factors(&self, present: &[bool]) -> Vec<f32> {
        let mut packed = vec![0.0; packed_length(self.components)];
        for (_, row) in self.present_rows(present) {
            add_outer_product(&mut packed, row.iter().copied(), 1.0);
        }
        for (index, precision) in self.precision.iter().enumerate() {
            factorize_row_with(&mut packed, index, *precision);
        }
        packed
    }

    /// Returns the BRDF of coefficients at a sample, sr⁻¹.
    #[must_use]
    pub fn brdf(
        &self,
        sample: usize,
        standardization: &Standardization,
        coefficients: &[f32],
    ) -> [f32; CHANNELS] {
        let row = &self.rows[sample * self.components..][..self.components];
        let (mean, cosines) = standardization.mean_and_cosines(sample);
        let mut channels = coefficients.chunks_exact(self.components);
        [(); CHANNELS].map(|()| {
            let list = channels.next().unwrap_or_default();
            unmap(mean + dot(row, list), 0.0, cosines)
        })
    }

    /// Corrects the completed coefficients of a task.
    #[must_use]
    pub fn correct(&self, readings: &[Reading], present: &[bool], completed: &[f32]) -> Corrected {
        let count = self.components;
        let mut coefficients = vec![0.0; CHANNELS * count];
        let mut residuals = vec![[0.0; CHANNELS]; readings.len()];
        for (sample, row) in self.present_rows(present) {
            let lists = coefficients.chunks_exact_mut(count);
            let channels = completed.chunks_exact(self.completed);
            for (channel, (list, completed)) in lists.zip(channels).enumerate() {
                let mapped = readings[sample].standardized[channel].value / LOG_SCALE;
                let residual = mapped - dot(row, completed);
                residuals[sample][channel] = residual;
                add_scaled(list, residual, row);
            }
        }
        let packed = match present.contains(&false) {
            true => self.factors(present),
            false => self.complete.get_or_init(|| self.factors(present)).clone(),
        };
        let lists = coefficients.chunks_exact_mut(count);
        for (list, completed) in lists.zip(completed.chunks_exact(self.completed)) {
            solve_factorized(&packed, list);
            add_scaled(list, 1.0, completed);
        }
        Corrected {
            coefficients,
            completed: completed.to_vec(),
            residuals,
            packed,
        }
    }

    /// Returns the gradient, given that with respect to the corrected coefficients.
    ///
    /// With s = (Q'Q + P)^-1 lambda of a channel, the derivatives are lambda - Q'Q s with respect to c_0, Q s with respect
    /// to the mapped reading, (r - Q z)_i s_k - (Q s)_i (z_k + c_0k) with respect to Q_ik, and -s_k z_k with respect to p_k.
    #[must_use]
    pub fn adjoint(
        &self,
        corrected: &Corrected,
        readings: &[Reading],
        present: &[bool],
        by_corrected: &[f32],
    ) -> CorrectionGradient {
        let count = self.components;
        let mut gradient = CorrectionGradient {
            completed: vec![0.0; CHANNELS * self.completed],
            precision: vec![0.0; count],
            angles: vec![[0.0; 3]; readings.len()],
        };
        for channel in 0..CHANNELS {
            let range = channel * count..(channel + 1) * count;
            let lambda = &by_corrected[range.clone()];
            let all = &corrected.coefficients[range];
            let completed_range = channel * self.completed..(channel + 1) * self.completed;
            let completed = &corrected.completed[completed_range.clone()];
            let mut z = all.to_vec();
            add_scaled(&mut z, -1.0, completed);
            let mut s = lambda.to_vec();
            solve_factorized(&corrected.packed, &mut s);
            for ((sum, s), z) in gradient.precision.iter_mut().zip(&s).zip(&z) {
                *sum -= s * z;
            }
            let by_completed = &mut gradient.completed[completed_range];
            add_scaled(by_completed, 1.0, lambda);
            for (sample, row) in self.present_rows(present) {
                let projection = dot(row, &s);
                let rest = corrected.residuals[sample][channel] - dot(row, &z);
                add_scaled(by_completed, -projection, row);
                let by_angles = &mut gradient.angles[sample];
                let tangent = readings[sample].standardized[channel].tangent;
                add_scaled(by_angles, projection / LOG_SCALE, &tangent);
                let slopes = self.slopes.chunks_exact(count).nth(sample);
                let slopes = slopes.unwrap_or_default();
                for ((slopes, s), c) in slopes.iter().zip(&s).zip(all) {
                    add_scaled(by_angles, rest * s - projection * c, slopes);
                }
            }
        }
        gradient
    }
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
