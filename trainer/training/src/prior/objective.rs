//! The objective of schedule prior: the loss over tasks and its gradient by the CoefficientNet, the StartNet and the
//! pattern; for readings at random directions, by the StartNet alone.

use glimpse_core::fit::{GaussNewton, Start};
use glimpse_core::model::ModelKind;
use glimpse_fitting::linear::ComponentsAt;
use glimpse_fitting::recipe::expected_loss::LossEstimate;
use glimpse_fitting::recipe::options::TrainingOptions;
use glimpse_fitting::recipe::sections::{Arena, count};
use glimpse_kernels::ModelKernels;
use glimpse_kernels::completion::{CompletionWeights, Shape};
use glimpse_materials::sampling::{random_stream, uniform_valid};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::completed_tasks::{
    CompletedTasks, Prepared, WeightedLoss, chunk_gradient, weighted_mean,
};
use super::dataset::Subset;
use super::hyperparameters::Hyperparameters;
use super::initial_weights::initial_weights;
use super::refinement::{STEPS, choose_initial, initial_hyperparameters};
use super::sample_order::greedy_order;
use super::steps::Steps;
use crate::correction::Correction;
use crate::initialization::initial_guess;
use crate::outer::{MetaValues, OuterStep, scaled_sum};
use crate::pattern::{Reach, SamplePattern};
use crate::scan_budget::Motion;
use crate::streams::RandomStreams;
use crate::tasks::reading::TaskReading;
use crate::tasks::task::{Dropout, TrainingTask};

/// The number of tasks that a thread processes together.
const CHUNK: usize = 16;
/// The number of coefficients, m.
pub(super) const COMPONENTS: usize = 24;
/// The number of hidden units of the CoefficientNet, h.
const HIDDEN_UNITS: usize = 64;
/// The number of hidden units of the StartNet, g.
const START_UNITS: usize = 32;
/// The weight of the loss before the refinement in the gradient. The weight of the loss after it is 1.
const AUXILIARY_WEIGHT: f32 = 0.3;
/// The smallest and the largest number of readings at random directions.
const RANDOM_READINGS: [f32; 2] = [4.0, 64.0];
/// The initial precision of a component in the correction.
const INITIAL_PRECISION: f32 = 3.0;
/// The stride of the validation octets that are used to sort samples. A subset is accurate enough.
const ORDER_OCTET_STRIDE: usize = 8;
/// The number of materials for the comparison of initial parameters.
const INITIAL_TASKS: usize = 32;
/// The random number stream of initial parameters.
const INITIAL_STREAM: u64 = u64::MAX - 100;

/// The objective of schedule prior: the CoefficientNet at a trained pattern, or a ridge fit at random directions, and the
/// StartNet with its refinement.
pub struct PriorObjective<'a> {
    /// The materials of this run.
    pub subset: &'a Subset<'a>,
    /// The layer sizes of both networks.
    pub shape: Shape,
    /// The number of directions of a task's loss, at a pattern.
    pub outer_samples: usize,
    /// The random number streams.
    pub streams: RandomStreams,
    /// The refinement after the StartNet; None for the model Linear.
    pub refinement: Option<&'static ModelKernels>,
    /// The weight of the loss before the refinement in the gradient. The weight of the loss after the refinement is 1.
    pub auxiliary_weight: f32,
    /// The directions that the pattern may have.
    pub reach: Reach<'a>,
    /// The motion of a scan, if its time has a budget.
    pub motion: Option<Motion>,
    /// The precisions of a ridge fit at random directions, which are redrawn for each chunk of tasks, in place of the
    /// CoefficientNet at a pattern: those of the channels' mean, and of the differences from it.
    pub random_directions: Option<[&'a [f32]; 2]>,
    /// The values of an earlier run, whose pattern and hyperparameters a run starts with; None draws a pattern per guess.
    pub earlier: Option<&'a MetaValues>,
}

/// The tasks of a step.
#[derive(Clone, Copy, Debug)]
pub struct StepOptions {
    /// The number of directions of a task's loss.
    pub outer_samples: usize,
    /// The distribution of missing readings.
    pub dropout: Dropout,
    /// True if the loss is that after the steps, false for that of the coefficients.
    pub is_refined: bool,
}

/// The tasks of a step at random directions.
pub(super) const RANDOM_TASKS: StepOptions = StepOptions {
    outer_samples: 128,
    dropout: Dropout::Any,
    is_refined: true,
};
/// The tasks for the comparison of initial parameters at random directions.
const RANDOM_STEP: OuterStep = OuterStep {
    phase_index: 1,
    step: 0,
    batch: 2 * CHUNK,
};

impl<'a> PriorObjective<'a> {
    /// Creates the objective of a run on a subset.
    pub(super) fn new(subset: &'a Subset<'a>, options: &'a TrainingOptions) -> Self {
        let parameters = options.model.parameters().unwrap_or(0);
        Self {
            subset,
            shape: Shape {
                samples: options.samples,
                components: COMPONENTS.min(subset.basis.components()),
                hidden: HIDDEN_UNITS,
                units: if parameters > 0 { START_UNITS } else { 0 },
                parameters,
            },
            outer_samples: Steps::of(options.effort, options.model).outer_samples,
            streams: RandomStreams { seed: options.seed },
            refinement: ModelKernels::of(options.model),
            auxiliary_weight: AUXILIARY_WEIGHT,
            reach: Reach {
                limits: options.limits(),
                fixed: &options.pattern,
            },
            motion: Motion::of(options),
            random_directions: None,
            earlier: None,
        }
    }

    /// Returns the model.
    #[must_use]
    pub fn model(&self) -> ModelKind {
        self.refinement
            .map_or(ModelKind::Linear, |kernels| kernels.model)
    }

    fn prepare<'v>(&'v self, values: &'v MetaValues, pattern: SamplePattern) -> Prepared<'v> {
        let (basis, shape) = (&self.subset.basis, self.shape);
        let hyperparameters = Hyperparameters::decode(&values.hyperparameters, basis.components());
        let at = ComponentsAt::new(basis, pattern.angles.clone());
        Prepared {
            subset: self.subset,
            correction: Correction::new(at, shape.components, &hyperparameters.precision),
            values,
            weights: CompletionWeights {
                shape,
                coefficient_net: &values.coefficient_net,
                start_net: &values.start_net,
            },
            hyperparameters,
            pattern,
            random_directions: self.random_directions,
            auxiliary_weight: self.auxiliary_weight,
        }
    }

    /// Returns initial meta-parameters. `guess` is the index of an independent initialization. The earlier run may have
    /// more components.
    #[must_use]
    pub fn initial_values(&self, guess: u64) -> MetaValues {
        let mut random = ChaCha8Rng::seed_from_u64(self.streams.guess_seed(guess));
        let [coefficient_net, start_net] = initial_weights(self.shape, &mut random);
        let initial = self
            .refinement
            .map(|kernels| initial_guess(kernels.model, &mut random));
        let hyperparameters = Hyperparameters {
            steps: self.refinement.map(initial_hyperparameters),
            precision: vec![INITIAL_PRECISION; self.subset.basis.components()],
        };
        let mut values = MetaValues {
            hyperparameters: hyperparameters.encode(),
            initial: initial.unwrap_or_default(),
            pattern: self.streams.initial_pattern(guess, self.shape.samples),
            coefficient_net,
            start_net,
        };
        if let Some(earlier) = self.earlier {
            let count = values.hyperparameters.len();
            values.hyperparameters = earlier.hyperparameters[..count].to_vec();
            values.pattern.clone_from(&earlier.pattern);
        }
        match self.refinement {
            Some(kernels) if self.random_directions.is_some() => {
                let loss = |values: &MetaValues| self.gradient(values, RANDOM_STEP, RANDOM_TASKS).0;
                choose_initial(kernels.model, values, &mut random, loss)
            }
            _ => values,
        }
    }

    /// Returns the start and the steps of a recipe; None for the model Linear.
    pub(super) fn sections<'s>(
        &self,
        arena: &'s Arena,
        values: &MetaValues,
    ) -> Option<(Start<'s>, GaussNewton<'s>)> {
        let components = self.subset.basis.components();
        let steps = Hyperparameters::decode(&values.hyperparameters, components).steps?;
        let at = &self.subset.virtual_readings.at;
        let gauss_newton = GaussNewton {
            model: self.refinement?.model,
            steps: count(STEPS),
            initial: arena.floats(&values.initial),
            precision: arena.floats(&steps.precision),
            reading_weight: steps.reading_weight,
            error_scale: steps.error_scale,
            directions: arena.angles(&at.angles),
            center: arena.floats(&at.means()),
            rows: arena.rows(at),
        };
        Some((arena.start(self.shape, &values.start_net), gauss_newton))
    }

    /// Returns meta-parameters, or their moments, with the samples in another order, given as indices.
    #[must_use]
    pub fn permute_samples(&self, mut values: MetaValues, order: &[usize]) -> MetaValues {
        permute(&mut values.pattern, 3, order);
        permute(&mut values.coefficient_net, 3 * self.shape.rows(), order);
        values
    }

    /// Sorts samples by their importance, for scans that may end early: by the loss of the completed coefficients on the
    /// validation materials.
    ///
    /// With a budget for the time of a scan, the order is that of the path instead.
    #[must_use]
    pub fn reorder_samples(&self, values: MetaValues) -> MetaValues {
        let reading_options = &self.subset.dataset.reading_options;
        if reading_options.missing_share == 0.0 || self.motion.is_some() {
            return values;
        }
        let prepared = self.prepare(&values, self.reach.reachable_pattern(&values.pattern));
        let mut tasks = self.plain_tasks(&self.subset.validation_materials, ORDER_OCTET_STRIDE);
        let readings = tasks.par_iter().map(|task| prepared.read(task));
        let readings: Vec<Vec<TaskReading>> = readings.collect();
        let order = greedy_order(self.shape.samples, |present| {
            for task in &mut tasks {
                task.present.copy_from_slice(present);
            }
            let chunks = tasks.par_chunks(CHUNK).zip(readings.par_chunks(CHUNK));
            let losses = chunks.flat_map_iter(|(tasks, readings)| {
                let completed = CompletedTasks::new(&prepared, tasks, readings);
                let loss = |index| completed.loss(index, None, &self.subset.validation);
                (0..tasks.len()).map(loss).collect::<Vec<_>>()
            });
            weighted_mean(&losses.collect::<Vec<_>>())
        });
        // Fixed samples come first, in their own order.
        let fixed = self.reach.fixed.len();
        let trained = order.into_iter().filter(|sample| *sample >= fixed);
        let order: Vec<usize> = (0..fixed).chain(trained).collect();
        self.permute_samples(values, &order)
    }

    /// Returns meta-parameters with the best of several draws of initial parameters. The losses after the fit differ by a
    /// factor of two between draws of Neural; Phong and Cook-Torrance have a single draw.
    #[must_use]
    pub fn choose_initial(&self, values: MetaValues) -> MetaValues {
        let Some(kernels) = self.refinement else {
            return values;
        };
        let all = &self.subset.validation_materials;
        let stride = all.len().div_ceil(INITIAL_TASKS).max(1);
        let materials: Vec<usize> = all.iter().copied().step_by(stride).collect();
        let tasks = self.plain_tasks(&materials, ORDER_OCTET_STRIDE);
        let mut random = random_stream(self.streams.seed, INITIAL_STREAM);
        choose_initial(kernels.model, values, &mut random, |values| {
            weighted_mean(&self.losses(values, &tasks, self.refinement))
        })
    }

    /// Returns the weighted mean loss over a step's batch of tasks, and its gradient, which includes the
    /// [barrier](crate::pattern::SamplePattern::barrier).
    #[must_use]
    pub fn gradient(
        &self,
        values: &MetaValues,
        outer_step: OuterStep,
        options: StepOptions,
    ) -> (f32, MetaValues) {
        let refinement = self.refinement.filter(|_| options.is_refined);
        let share = 1.0 / outer_step.batch as f32;
        let Subset {
            dataset, groups, ..
        } = self.subset;
        let draw = |samples, random: &mut ChaCha8Rng| {
            let counts = [samples, options.outer_samples];
            dataset.draw_task(groups, counts, options.dropout, random)
        };
        if self.random_directions.is_some() {
            let chunks = (0..outer_step.batch).into_par_iter().step_by(CHUNK);
            let chunks = chunks.map(|first| {
                let count = CHUNK.min(outer_step.batch - first);
                let random = &mut self.streams.slot(outer_step, first + 1);
                let [min, max] = RANDOM_READINGS;
                let samples = (min * (max / min).powf(random.random())) as usize;
                let angles = uniform_valid(samples, random.random());
                let prepared = self.prepare(values, SamplePattern::new(&Reach::ANY, angles));
                let tasks = (0..count).map(|_| draw(samples, random).ending_after(samples));
                chunk_gradient(&prepared, &tasks.collect::<Vec<_>>(), refinement)
            });
            return scaled_sum(share, &chunks.collect::<Vec<_>>());
        }
        let prepared = self.prepare(values, self.reach.pattern(&values.pattern));
        let tasks = (0..outer_step.batch).map(|slot| {
            let random = &mut self.streams.slot(outer_step, slot + 1);
            draw(self.shape.samples, random)
        });
        let tasks: Vec<TrainingTask> = tasks.collect();
        let chunks = tasks.par_chunks(CHUNK);
        let chunks = chunks.map(|tasks| chunk_gradient(&prepared, tasks, refinement));
        let (loss, mut gradient) = scaled_sum(share, &chunks.collect::<Vec<_>>());
        let (by_angles, _) = gradient.pattern.as_chunks();
        gradient.pattern = prepared
            .pattern
            .gradient_by_logits(|sample| by_angles[sample]);
        (loss, gradient)
    }

    /// Calls a function for each task, with the chunk of tasks that contains it and the index there.
    pub(super) fn map_tasks<T: Send>(
        &self,
        values: &MetaValues,
        tasks: &[TrainingTask],
        function: impl Fn(&CompletedTasks<'_>, usize) -> T + Sync,
    ) -> Vec<T> {
        let prepared = self.prepare(values, self.reach.reachable_pattern(&values.pattern));
        let results = tasks.par_chunks(CHUNK).flat_map_iter(|tasks| {
            let readings = prepared.read_all(tasks);
            let completed = CompletedTasks::new(&prepared, tasks, &readings);
            let results = (0..tasks.len()).map(|index| function(&completed, index));
            results.collect::<Vec<T>>()
        });
        results.collect()
    }

    /// Returns the unweighted loss and the weight of each task at the validation directions.
    fn losses(
        &self,
        values: &MetaValues,
        tasks: &[TrainingTask],
        refinement: Option<&'static ModelKernels>,
    ) -> Vec<WeightedLoss> {
        self.map_tasks(values, tasks, |completed, index| {
            completed.loss(index, refinement, &self.subset.validation)
        })
    }

    /// Returns the weighted mean loss of the completed coefficients on the validation materials, by which the best pattern
    /// is selected: the StartNet is trained only after the search. It is larger for patterns beyond a budget.
    #[must_use]
    pub fn selection_loss(&self, values: &MetaValues) -> f32 {
        let motion = self.motion.as_ref();
        let factor = motion.map_or(1.0, |motion| motion.selection_factor(&values.pattern));
        let tasks = self.plain_tasks(&self.subset.validation_materials, 1);
        factor * weighted_mean(&self.losses(values, &tasks, None))
    }

    /// Returns the unweighted mean loss on the validation materials. For a fold they are unseen; otherwise they are the
    /// training materials at other directions.
    #[must_use]
    pub fn expected_loss(&self, values: &MetaValues) -> LossEstimate {
        let tasks = self.plain_tasks(&self.subset.validation_materials, 1);
        let losses = self.losses(values, &tasks, self.refinement);
        LossEstimate::of(&losses.iter().map(|task| task.loss).collect::<Vec<_>>())
    }

    /// Returns tasks without augmentation, at every `stride`-th octet of validation directions.
    pub(super) fn plain_tasks(&self, materials: &[usize], stride: usize) -> Vec<TrainingTask> {
        let octets = self.subset.validation.pool.octet_count();
        let plain = |material: &usize| TrainingTask {
            octets: (0..octets as u32).step_by(stride).collect(),
            ..TrainingTask::plain(*material, self.shape.samples, 0)
        };
        materials.iter().map(plain).collect()
    }
}

/// Reorders a list with `width` entries per sample.
fn permute(list: &mut [f32], width: usize, order: &[usize]) {
    let original = list.to_vec();
    let entries = order.iter().zip(list.chunks_exact_mut(width));
    for (sample, entry) in entries {
        entry.copy_from_slice(&original[sample * width..][..width]);
    }
}
