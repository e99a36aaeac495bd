//! The objective of a start and steps for readings at any directions: both depend on the readings only by coefficients.

use glimpse_core::model::Sample;
use glimpse_kernels::completion::{Batch, CompletionWeights, Shape};
use glimpse_kernels::lanes::WIDTH;
use glimpse_kernels::samples::SampleOctets;
use glimpse_materials::basis::Basis;
use glimpse_materials::sampling::uniform_valid;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::correction::bounded_precision;
use super::dataset::Dataset;
use super::hyperparameters::Hyperparameters;
use super::initial_weights::initial_weights;
use super::objective::{CHUNK, OUTER_SAMPLES};
use super::reading::Reading;
use super::refinement::{Refinement, RefinementInputs};
use super::task::{Dropout, Task};
use super::virtual_readings::VirtualReadings;
use super::weighted_loss::task_weight;
use crate::linear::{ComponentsAt, add_scaled};
use crate::meta::initialization::initial_guess;
use crate::meta::learned::LearnedRefinement;
use crate::meta::objective::{RandomStreams, mean_gradient};
use crate::meta::pattern::Pattern;
use crate::meta::phase::{OuterStep, Values};
use crate::meta::samples::WeightedSamples;

/// The smallest and the largest number of readings of a task.
const READINGS: [f32; 2] = [4.0, 64.0];
/// The number of draws of initial parameters that are compared.
const INITIAL_DRAWS: usize = 16;

/// The loss after the steps, over tasks with readings at random directions.
pub struct StartObjective<'a> {
    pub(super) dataset: &'a Dataset,
    pub(super) basis: &'a Basis,
    /// The precisions of the mean of the channels, and of the differences from it.
    pub(super) precision: [&'a [f32]; 2],
    pub(super) virtual_readings: VirtualReadings,
    pub(super) refinement: &'a dyn Refinement,
    pub(super) shape: Shape,
    pub(super) streams: RandomStreams,
}

impl StartObjective<'_> {
    /// Returns the best of several draws of initial meta-parameters.
    pub(super) fn initial_values(&self) -> Values {
        let mut random = ChaCha8Rng::seed_from_u64(self.streams.seed);
        let [coefficient_net, start_net] = initial_weights(self.shape, &mut random);
        let hyperparameters = Hyperparameters {
            steps: Some(self.refinement.initial_hyperparameters()),
            precision: Vec::new(),
        };
        let mut values = Values {
            hyperparameters: hyperparameters.encode(),
            coefficient_net,
            start_net,
            ..Values::default()
        };
        let step = OuterStep {
            phase_index: 1,
            step: 0,
            batch: 2 * CHUNK,
        };
        let mut best = (f32::INFINITY, Vec::new());
        for _ in 0..INITIAL_DRAWS {
            values.initial = initial_guess(self.refinement.model(), &mut random);
            let (loss, _) = self.gradient(&values, step);
            // Always false for NaN.
            if loss < best.0 || best.1.is_empty() {
                best = (loss, values.initial.clone());
            }
        }
        values.initial = best.1;
        values
    }

    /// Returns the content of a recipe.
    pub(super) fn learned(&self, values: Values) -> Option<LearnedRefinement> {
        let steps = Hyperparameters::decode(&values.hyperparameters, 0).steps?;
        let (refinement, readings) = (self.refinement, &self.virtual_readings);
        Some(LearnedRefinement {
            steps: refinement.learned(values.initial, steps, readings),
            shape: self.shape,
            start_net: values.start_net,
        })
    }

    /// Returns the weighted mean loss over a step's tasks, and its gradient.
    pub fn gradient(&self, values: &Values, step: OuterStep) -> (f32, Values) {
        let chunks: Vec<usize> = (0..step.batch).step_by(CHUNK).collect();
        let results = chunks.into_par_iter().map(|first| {
            let mut random = self.streams.slot(step, first + 1);
            self.chunk_gradient(values, CHUNK.min(step.batch - first), &mut random)
        });
        mean_gradient(&results.collect::<Vec<_>>())
    }

    /// Returns the mean over tasks whose readings have the same directions.
    fn chunk_gradient(
        &self,
        values: &Values,
        count: usize,
        random: &mut ChaCha8Rng,
    ) -> (f32, Values) {
        let [min, max] = READINGS;
        let readings = min * (max / min).powf(random.random());
        let pattern = Pattern::new(uniform_valid(readings as usize, random.random()));
        let at = ComponentsAt::new(self.basis, pattern.angles().to_vec());
        let [mean, difference] = self
            .precision
            .map(|precision| bounded_precision(&at.rows, precision));
        let options = &self.dataset.augmentation_options;
        let draw = |_| {
            let samples = [at.count(), OUTER_SAMPLES];
            let (pool, groups) = (&self.dataset.pool, &self.dataset.groups);
            Task::random(pool, groups, options, samples, Dropout::Any, random)
        };
        let tasks: Vec<Task> = (0..count).map(draw).collect();
        let brdf = tasks.iter().map(|task| -> Vec<[f32; 3]> {
            let readings = Reading::read_task(task, &self.dataset.materials, options, &at);
            readings.into_iter().map(|reading| reading.brdf).collect()
        });
        let brdf: Vec<Vec<[f32; 3]>> = brdf.collect();
        let coefficients: Vec<Vec<f32>> = brdf
            .iter()
            .map(|brdf| at.fit_channels([&mean, &difference], brdf))
            .collect();

        let weights = CompletionWeights {
            shape: self.shape,
            coefficient_net: &values.coefficient_net,
            start_net: &values.start_net,
        };
        let mut batch = Batch::new(self.shape, count);
        for (index, coefficients) in coefficients.iter().enumerate() {
            batch.set_coefficients(index, coefficients);
        }
        batch.activate(&weights);
        let hyperparameters = Hyperparameters::decode(&values.hyperparameters, 0);
        let mut gradient = values.as_ref().map(|list| vec![0.0; list.len()]);
        let mut by_hyperparameters = hyperparameters.zeros();
        let (mut loss, share) = (0.0, 1.0 / count as f32);
        let present = vec![true; at.count()];
        for (index, task) in tasks.iter().enumerate() {
            let Some(steps) = &hyperparameters.steps else {
                continue;
            };
            let mut initial = batch.offsets(index);
            add_scaled(&mut initial, 1.0, &values.initial);
            let readings =
                WeightedSamples::present(pattern.octet_directions(), &brdf[index], &present);
            let inputs = RefinementInputs {
                initial: &initial,
                hyperparameters: steps,
                coefficients: &coefficients[index],
                readings: &readings.octets(),
                virtual_readings: &self.virtual_readings,
            };
            let outer = task.samples(&self.dataset.pool);
            let refined = self.refinement.gradient(&inputs, &outer.octets());
            let black: f32 = loss_of_black(&outer.octets());
            let weight = share * task_weight(black);
            loss += weight * refined.loss;
            add_scaled(&mut gradient.initial, weight, &refined.initial);
            if let Some(by_steps) = &mut by_hyperparameters.steps {
                by_steps.add_scaled(weight, &refined.hyperparameters);
            }
            let by_offsets = refined.initial.iter().map(|derivative| weight * derivative);
            batch.set_offset_gradient(index, by_offsets);
        }
        batch.start_net_adjoint(&weights, &mut gradient.start_net);
        gradient.hyperparameters = hyperparameters.by_logarithms(&by_hyperparameters);
        (loss, gradient)
    }
}

/// Returns the loss of f = 0.
fn loss_of_black(outer: &SampleOctets<'_>) -> f32 {
    let samples =
        (0..outer.values.len()).flat_map(|octet| (0..WIDTH).map(move |lane| (octet, lane)));
    let losses = samples.map(|(octet, lane)| {
        let Sample {
            at,
            measured,
            weight,
        } = outer.sample(octet, lane);
        weight
            * measured
                .map(|y| (y * at.cos_theta_i()).ln_1p())
                .iter()
                .sum::<f32>()
    });
    losses.sum()
}
