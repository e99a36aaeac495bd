//! The ridge stage after the net, and its adjoint; see [`glimpse_core::fit::ridge`].

use std::sync::OnceLock;

use glimpse_core::fit::ridge::{RidgeGradient, scratch_length};
use glimpse_fitting::linear::{ComponentsAt, bounded_precision};
use glimpse_materials::lists::{add_scaled, dot};

use super::tasks::reading::{LOG_SCALE, TaskReading};

const CHANNELS: usize = 3;

/// The components at the samples of a pattern, with the precisions.
pub struct Correction {
    /// The components.
    pub at: ComponentsAt,
    /// m, the number of completed coefficients of a channel.
    completed: usize,
    precision: Vec<f32>,
    /// The factors for a task with all readings.
    complete: OnceLock<Vec<f32>>,
}

/// Corrected coefficients of a task.
#[derive(Default)]
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
    /// Returns coefficients that another stage estimated. They have no adjoint.
    pub(super) fn estimated(coefficients: Vec<f32>) -> Self {
        Self {
            coefficients,
            ..Self::default()
        }
    }

    /// Returns the innovation: the mean of |t| over the present readings and channels.
    #[must_use]
    pub fn innovation(&self, present: &[bool]) -> f32 {
        let count = present.iter().filter(|present| **present).count().max(1);
        let sum: f32 = self.targets.iter().flatten().map(|t| t.abs()).sum();
        sum / (CHANNELS * count) as f32
    }
}

impl Correction {
    /// Creates the stage of a pattern. The first `completed` components have completed coefficients.
    #[must_use]
    pub fn new(at: ComponentsAt, completed: usize, precision: &[f32]) -> Self {
        Self {
            completed,
            precision: bounded_precision(&at.rows, precision),
            at,
            complete: OnceLock::new(),
        }
    }

    /// Corrects the completed coefficients of a task.
    #[must_use]
    pub fn correct(
        &self,
        readings: &[TaskReading],
        present: &[bool],
        completed: &[f32],
    ) -> Corrected {
        let count = self.at.components;
        let scales: Vec<f32> = present.iter().map(|present| f32::from(*present)).collect();
        let factorize = || self.at.factorize(&self.precision, &scales);
        let factors = if present.contains(&false) {
            factorize()
        } else {
            self.complete.get_or_init(factorize).clone()
        };
        let system = self.at.system(&self.precision, &scales);
        let mut scratch = vec![0.0; scratch_length(readings.len(), count)];
        let mut coefficients = vec![0.0; CHANNELS * count];
        let lists = coefficients.chunks_exact_mut(count);
        let channels = completed.chunks_exact(self.completed);
        let mut targets = [(); CHANNELS].map(|()| vec![0.0; readings.len()]);
        for (channel, (list, completed)) in lists.zip(channels).enumerate() {
            for (sample, target) in targets[channel].iter_mut().enumerate() {
                if present[sample] {
                    let mapped = readings[sample].standardized[channel].value / LOG_SCALE;
                    *target = mapped - dot(self.at.row(sample), completed);
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
        readings: &[TaskReading],
        by_corrected: &[f32],
    ) -> CorrectionGradient {
        let (count, samples) = (self.at.components, readings.len());
        let mut gradient = CorrectionGradient {
            completed: vec![0.0; CHANNELS * self.completed],
            precision: vec![0.0; count],
            angles: vec![[0.0; 3]; samples],
        };
        let system = self.at.system(&self.precision, &corrected.scales);
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
                add_scaled(by_initial, -by_target, self.at.row(sample));
                add_scaled(by_row, -by_target, initial);
                let tangent = readings[sample].standardized[channel].tangent;
                let by_angles = &mut gradient.angles[sample];
                add_scaled(by_angles, by_target / LOG_SCALE, &tangent);
            }
        }
        let rows = by_rows.chunks_exact(count);
        let rows = rows.zip(self.at.slopes.chunks_exact(count));
        for (by_angles, (by_row, slopes)) in gradient.angles.iter_mut().zip(rows) {
            for (by_entry, slopes) in by_row.iter().zip(slopes) {
                add_scaled(by_angles, *by_entry, slopes);
            }
        }
        gradient
    }
}
