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

use super::completed_tasks::task_weight;
use super::dataset::Dataset;
use super::gradient_sum::GradientSum;
use super::hyperparameters::Hyperparameters;
use super::initial_weights::initial_weights;
use super::objective::{CHUNK, OUTER_SAMPLES};
use super::refinement::{Refinement, RefinementInputs};
use super::virtual_readings::VirtualReadings;
use crate::linear::{ComponentsAt, add_scaled};
use crate::meta::correction::bounded_precision;
use crate::meta::initialization::initial_guess;
use crate::meta::learned::LearnedRefinement;
use crate::meta::pattern::Pattern;
use crate::meta::phase::{OuterStep, Values, scaled_sum};
use crate::meta::streams::RandomStreams;
use crate::meta::tasks::reading::Reading;
use crate::meta::tasks::samples::WeightedSamples;
use crate::meta::tasks::task::{Dropout, Task};

/// The smallest and the largest number of readings of a task.
const READINGS: [f32; 2] = [4.0, 64.0];

/// The loss after the steps, over tasks with readings at random directions.
pub struct StartObjective<'a> {
    pub(super) dataset: &'a Dataset,
    pub(super) basis: &'a Basis,
    /// The precisions of the mean of the channels, and of the differences from it.
    pub(super) precision: [&'a [f32]; 2],
    pub(super) virtual_readings: VirtualReadings,
    pub(super) refinement: Refinement,
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
        let values = Values {
            hyperparameters: hyperparameters.encode(),
            initial: initial_guess(self.refinement.model(), &mut random),
            coefficient_net,
            start_net,
            ..Values::default()
        };
        let step = OuterStep {
            phase_index: 1,
            step: 0,
            batch: 2 * CHUNK,
        };
        let loss = |values: &Values| self.gradient(values, step).0;
        self.refinement.choose_initial(values, &mut random, loss)
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
    pub(super) fn gradient(&self, values: &Values, step: OuterStep) -> (f32, Values) {
        let chunks: Vec<usize> = (0..step.batch).step_by(CHUNK).collect();
        let results = chunks.into_par_iter().map(|first| {
            let mut random = self.streams.slot(step, first + 1);
            self.chunk_gradient(values, CHUNK.min(step.batch - first), &mut random)
        });
        scaled_sum(1.0 / step.batch as f32, &results.collect::<Vec<_>>())
    }

    /// Returns the sum over tasks whose readings have the same directions.
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
        let (pool, groups) = (&self.dataset.pool, &self.dataset.groups);
        let options = &self.dataset.reading_options;
        let samples = [at.count(), OUTER_SAMPLES];
        let draw = |_| Task::random(pool, groups, options, samples, Dropout::Any, random);
        let tasks: Vec<Task> = (0..count).map(draw).collect();
        let fits = tasks.iter().map(|task| {
            let levels = options.noise.levels;
            let readings = Reading::read_task(task, &self.dataset.materials, levels, &at);
            let brdf = Reading::brdf(&readings);
            let coefficients = at.fit_channels([&mean, &difference], &brdf);
            (brdf, coefficients)
        });
        let (brdf, coefficients): (Vec<_>, Vec<_>) = fits.unzip();

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
        let mut sum = GradientSum::new(values, &hyperparameters);
        let present = vec![true; at.count()];
        for (index, task) in tasks.iter().enumerate() {
            let Some(steps) = &hyperparameters.steps else {
                continue;
            };
            let mut initial = batch.offsets(index);
            add_scaled(&mut initial, 1.0, &values.initial);
            let directions = pattern.octet_directions();
            let inputs = RefinementInputs {
                initial,
                hyperparameters: steps,
                coefficients: &coefficients[index],
                readings: WeightedSamples::present(directions, &brdf[index], &present),
                virtual_readings: &self.virtual_readings,
            };
            let outer = task.samples(pool);
            let refined = self.refinement.gradient(&inputs, &outer.octets());
            let weight = task_weight(loss_of_black(&outer.octets()));
            sum.loss += weight * refined.loss;
            sum.add_refined(&mut batch, index, weight, &refined);
        }
        batch.start_net_adjoint(&weights, &mut sum.values.start_net);
        sum.finish(&hyperparameters)
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
