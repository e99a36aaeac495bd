//! The evidence of readings for the loss of a fit: coefficients, innovation and residual.

use rayon::prelude::*;

use super::loss_predictor::Evidence;
use super::objective::{CHUNK, CompletedBatch, CompletionObjective, PreparedParameters};
use super::reading::Reading;
use super::task::Task;
use crate::meta::phase::Values;

impl CompletionObjective<'_> {
    /// Returns the innovation and the mean residual at the readings of each task.
    #[must_use]
    pub fn evidence(&self, values: &Values, tasks: &[Task]) -> Vec<Evidence> {
        let prepared = self.prepare(values, self.reachable_pattern(values));
        let evaluate_chunk = |tasks: &[Task]| -> Vec<Evidence> {
            let readings = self.read_all(&prepared, tasks);
            let completed = self.complete(&prepared, tasks, &readings);
            let each = readings.iter().enumerate().map(|(index, readings)| {
                let present = &completed.present[index];
                let corrected = &completed.corrected[index];
                let residual = self.residual(&prepared, &completed, readings, index);
                Evidence {
                    innovation: corrected.innovation(present),
                    residual,
                }
            });
            each.collect()
        };
        tasks
            .par_chunks(CHUNK)
            .flat_map_iter(evaluate_chunk)
            .collect()
    }

    /// Returns the mean residual of a task's fit at its readings.
    fn residual(
        &self,
        prepared: &PreparedParameters<'_>,
        completed: &CompletedBatch,
        readings: &[Reading],
        index: usize,
    ) -> f32 {
        let refined = self.refinement.and_then(|refinement| {
            self.with_inputs((prepared, completed, readings), index, |inputs| {
                refinement.loss(&refinement.fit(inputs), inputs.readings)
            })
        });
        refined.unwrap_or_else(|| {
            let present = &completed.present[index];
            let coefficients = &completed.corrected[index].coefficients;
            let at = &prepared.correction.at;
            let count = present.iter().filter(|present| **present).count().max(1);
            let errors = readings.iter().enumerate().filter(|(i, _)| present[*i]);
            let errors = errors.map(|(sample, reading)| {
                let modeled = at.brdf(sample, coefficients);
                let cosine = at.cos_theta_i[sample];
                let channels = modeled.iter().zip(&reading.brdf);
                channels
                    .map(|(f, y)| ((1.0 + f * cosine) / (1.0 + y * cosine)).ln().abs())
                    .sum::<f32>()
            });
            errors.sum::<f32>() / (3 * count) as f32
        })
    }

    /// Returns the corrected coefficients of each task that the net completes, averaged over channels.
    #[must_use]
    pub fn mean_coefficients(&self, values: &Values, tasks: &[Task]) -> Vec<Vec<f32>> {
        let prepared = self.prepare(values, self.reachable_pattern(values));
        let evaluate_chunk = |tasks: &[Task]| -> Vec<Vec<f32>> {
            let completed = self.complete(&prepared, tasks, &self.read_all(&prepared, tasks));
            let components = self.subset.basis.components();
            let each = completed.corrected.iter().map(|corrected| {
                let all = &corrected.coefficients;
                let mean = |k| (all[k] + all[components + k] + all[2 * components + k]) / 3.0;
                (0..self.shape.components).map(mean).collect()
            });
            each.collect()
        };
        tasks
            .par_chunks(CHUNK)
            .flat_map_iter(evaluate_chunk)
            .collect()
    }
}
