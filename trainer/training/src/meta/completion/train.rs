//! A training run of schedule prior: all materials, and then folds of them to judge by.

use std::ops::ControlFlow;

use glimpse_core::recipe::ValidationSplit;
use glimpse_kernels::completion::Shape;
use glimpse_materials::basis::Basis;
use glimpse_materials::{Identity, Material, Procedural};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::dataset::{Dataset, Part};
use super::draw::{AugmentationOptions, Dropout, Group, Task};
use super::loss_predictor::{HeldOutLoss, LossPredictor};
use super::objective::CompletionObjective;
use super::reading::{ReadingCenters, SCALE};
use super::refinement::Refinement;
use crate::linear::ReducedBasis;
use crate::meta::identity::RunIdentity;
use crate::meta::learned::{
    CompletionTarget, Learned, LearnedCompletion, LearnedDescent, LearnedFit, ValidatedLoss,
};
use crate::meta::objective::{Expected, RandomStreams};
use crate::meta::options::{CompletionOptions, Options};
use crate::meta::outer::{Observer, Outcome, Progress, Run, RunError};
use crate::meta::pattern::reachable;
use crate::meta::plan::Plan;

/// SGD steps from a completed start.
pub const STARTED_STEPS: usize = 1;
/// m of a completion.
const COMPONENTS: usize = 24;
/// h of a completion.
const HIDDEN: usize = 64;
/// g of a start.
const UNITS: usize = 32;
/// What the loss of completed coefficients counts for where a descent follows.
const AUXILIARY: f32 = 0.3;
/// Directions at which materials are evaluated once, with each highlight warp; for thousands of materials fewer,
/// see [`pool_size`].
const POOL: usize = 8_192;
/// How many bytes the values there may take: all of up to 4,096 materials.
const POOL_BYTES: usize = 3 << 30;
/// Into how many folds materials are divided, and how many there are at least for that.
const FOLDS: usize = 4;
const LEAST_TO_FOLD: usize = 10;
/// How many variations of each fold's materials a prediction goes by, and at how many directions each
/// of them is judged.
const VARIED: usize = 1_024;
const VARIED_OUTER: usize = 1_024;

/// Trains on all materials; then, to know what to expect of unseen ones, on all but each fold.
///
/// # Errors
/// If it is stopped, or cannot be saved.
pub fn train(
    options: &Options,
    plan: &Plan,
    refinement: Option<&dyn Refinement>,
    materials: Vec<Box<dyn Material>>,
    observer: &mut Observer<'_>,
) -> Result<Learned, RunError> {
    let identities: Vec<Identity> = materials.iter().map(|each| Identity::of(&**each)).collect();
    let identity = options.identity(&identities);
    let dataset = dataset(materials, options);
    let folds = folds(dataset.own, options.seed);
    let fold_plan = Plan::of_a_fold(options.effort, options.model, options.samples, dataset.own);
    let mut session = Session {
        options,
        identity,
        refinement,
        dataset: &dataset,
        total: plan.steps() + folds.len() * fold_plan.steps(),
        done: 0,
        observer,
    };

    let whole = Part::whole(&dataset, COMPONENTS);
    let (objective, Outcome { expected, values }) = session.run(&whole, plan, None, 0)?;
    let shape = objective.shape;
    let own: Vec<usize> = (0..dataset.own).collect();
    let of_all = objective.losses_of_materials(&values, &own);
    let mut witnesses = Vec::new();
    let mut seen = Level::default();
    for (index, fold) in folds.iter().enumerate() {
        let part = Part::without(&dataset, COMPONENTS, fold);
        let (without, outcome) =
            session.run(&part, &fold_plan, Some(&values.pattern), index + 1)?;
        let others: Vec<usize> = own
            .iter()
            .copied()
            .filter(|at| !fold.contains(at))
            .collect();
        seen.add(
            others.iter().map(|index| of_all[*index]),
            without.losses_of_materials(&outcome.values, &others),
        );
        let plain = fold
            .iter()
            .map(|each| Task::plain(*each, options.samples, 0));
        let plain: Vec<Task> = plain.collect();
        let varied = varied(&dataset, fold, index, options);
        for (tasks, losses, plain) in [
            (
                &plain,
                without.losses_of_materials(&outcome.values, fold),
                true,
            ),
            (&varied, without.losses_of(&outcome.values, &varied), false),
        ] {
            let each = objective
                .mean_coefficients(&values, tasks)
                .into_iter()
                .zip(losses);
            witnesses.extend(each.map(|(coefficients, loss)| HeldOutLoss {
                coefficients,
                loss,
                plain,
                fold: index,
            }));
        }
    }
    for witness in &mut witnesses {
        witness.loss *= seen.ratio();
    }
    let expected_loss = expected_loss(expected, &witnesses);
    let pattern = reachable(&values.pattern, &options.completion_options.limits);
    let centers = ReadingCenters::new(&whole.basis, &pattern);
    let completion = LearnedCompletion {
        shape,
        missing: dataset.variety.where_missing(),
        center: centers.means(),
        scale: SCALE,
        weights: values.completion,
    };
    let mut basis = None;
    let target = match refinement {
        None => CompletionTarget::Linear {
            rows: ReducedBasis::new(&whole.basis, &pattern).basis,
            basis_checksum: Basis::checksum(basis.insert(whole.basis.to_bytes())),
        },
        Some(refinement) => {
            let descent = LearnedDescent {
                model: options.model,
                inner_steps: refinement.steps(),
                initial: values.initial,
                step_sizes: plan.step_size_form.step_sizes(&values.hyperparameters),
            };
            CompletionTarget::Descent(descent, values.start)
        }
    };
    Ok(Learned {
        pattern,
        fit: LearnedFit::Completed(completion, target),
        prediction: LossPredictor::new(&witnesses, FOLDS),
        basis,
        expected_loss,
        materials: identities,
    })
}

/// How much less the whole training loses than shorter ones of folds do, on materials that both saw: what
/// losses of those that folds did not see are multiplied by.
#[derive(Default)]
struct Level {
    of_all: f32,
    of_folds: f32,
}

impl Level {
    fn add(&mut self, of_all: impl Iterator<Item = f32>, of_fold: Vec<f32>) {
        self.of_all += of_all.sum::<f32>();
        self.of_folds += of_fold.iter().sum::<f32>();
    }

    fn ratio(&self) -> f32 {
        match self.of_folds > 0.0 {
            true => self.of_all / self.of_folds,
            false => 1.0,
        }
    }
}

/// Variations of a fold's materials.
fn varied(dataset: &Dataset, fold: &[usize], index: usize, options: &Options) -> Vec<Task> {
    let group = Group {
        materials: fold.to_vec(),
        share: 1.0,
    };
    let mut random = ChaCha8Rng::seed_from_u64(options.seed);
    random.set_stream(u64::MAX - 1 - index as u64);
    let sizes = [options.samples, VARIED_OUTER];
    let one = |_| {
        let groups = std::slice::from_ref(&group);
        let (pool, variety) = (&dataset.pool, &dataset.variety);
        Task::random(
            pool,
            groups,
            variety,
            sizes,
            Dropout::LastOrFew,
            &mut random,
        )
    };
    (0..VARIED).map(one).collect()
}

/// What to expect: the mean over the materials that were left out, or, without folds, over all.
fn expected_loss(of_training: Expected, witnesses: &[HeldOutLoss]) -> ValidatedLoss {
    let plain = witnesses.iter().filter(|each| each.plain);
    let losses: Vec<f64> = plain.map(|each| f64::from(each.loss)).collect();
    if losses.is_empty() {
        return ValidatedLoss {
            expected: of_training,
            split: ValidationSplit::Training,
        };
    }
    let mean = losses.iter().sum::<f64>() / losses.len() as f64;
    ValidatedLoss {
        expected: Expected::new(mean as f32, losses.iter().copied()),
        split: ValidationSplit::Folds,
    }
}

/// The materials at hand, and procedural ones.
fn dataset(mut materials: Vec<Box<dyn Material>>, options: &Options) -> Dataset {
    let completion_options = &options.completion_options;
    let own = materials.len();
    let parts = match &options.portions[..] {
        [] => vec![(own, 1.0)],
        some => some
            .iter()
            .map(|each| (each.materials, each.share))
            .collect(),
    };
    let mut groups = Vec::new();
    let mut first = 0;
    for (materials, share) in parts {
        groups.push(Group {
            materials: (first..first + materials).collect(),
            share: share * (1.0 - completion_options.procedural),
        });
        first += materials;
    }
    if completion_options.procedural > 0.0 {
        let (count, seed) = CompletionOptions::MIXED_IN;
        let set = Procedural::set(count, seed).into_iter();
        materials.extend(set.map(|each| Box::new(each) as Box<dyn Material>));
        groups.push(Group {
            materials: (own..materials.len()).collect(),
            share: completion_options.procedural,
        });
    }
    let variety = AugmentationOptions {
        missing: completion_options.missing,
        noise: completion_options.noise(),
        ..AugmentationOptions::default()
    };
    let size = pool_size(own, variety.warps.len());
    Dataset::new(materials, own, groups, variety, size, options.seed)
}

/// At how many directions so many materials are evaluated, with so many warps and once more as they
/// are: at half as many, and again half, until the values fit into [`POOL_BYTES`].
fn pool_size(materials: usize, warps: usize) -> usize {
    const LEAST: usize = 512;
    let mut size = POOL;
    while size > LEAST && materials * (warps + 1) * size * size_of::<[f32; 3]>() > POOL_BYTES {
        size /= 2;
    }
    size
}

/// Which materials are left out together; no folds of too few materials.
fn folds(materials: usize, seed: u64) -> Vec<Vec<usize>> {
    if materials < LEAST_TO_FOLD {
        return Vec::new();
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(u64::MAX);
    let mut order: Vec<usize> = (0..materials).collect();
    order.shuffle(&mut random);
    let fold = |first| order.iter().copied().skip(first).step_by(FOLDS).collect();
    (0..FOLDS).map(fold).collect()
}

/// Several runs that an observer sees as one.
struct Session<'s, 'o> {
    options: &'s Options,
    identity: RunIdentity,
    refinement: Option<&'s dyn Refinement>,
    dataset: &'s Dataset,
    /// Outer steps of all runs, and of those that are done.
    total: usize,
    done: usize,
    observer: &'s mut Observer<'o>,
}

impl<'s> Session<'s, '_> {
    fn run<'a>(
        &mut self,
        part: &'a Part,
        plan: &Plan,
        pattern: Option<&'a [f32]>,
        stage: usize,
    ) -> Result<(CompletionObjective<'a>, Outcome), RunError>
    where
        's: 'a,
    {
        let seed = self.options.seed;
        let parameters = self
            .refinement
            .map_or(0, |by| by.model().parameters().unwrap_or(0));
        let objective = CompletionObjective {
            dataset: self.dataset,
            part,
            shape: Shape {
                samples: self.options.samples,
                components: part.basis.components(),
                hidden: HIDDEN,
                units: if parameters > 0 { UNITS } else { 0 },
                parameters,
            },
            weighing: plan.weighing,
            streams: RandomStreams { seed },
            refinement: self.refinement,
            first_step_size: plan.first_step_size,
            auxiliary: AUXILIARY,
            limits: self.options.completion_options.limits,
            pattern,
        };
        let run = Run {
            objective: &objective,
            plan,
            identity: self.identity,
            seed,
            checkpoints: self.options.checkpoints.clone(),
            stage,
        };
        let (before, total) = (self.done, self.total);
        let observer = &mut *self.observer;
        let mut of_all = |progress: &Progress| -> ControlFlow<()> {
            observer(&Progress {
                done: before + progress.done,
                total,
                ..*progress
            })
        };
        let outcome = match run.finish(&mut of_all) {
            Err(RunError::Stopped(done)) => Err(RunError::Stopped(before + done)),
            outcome => outcome,
        }?;
        self.done += plan.steps();
        Ok((objective, outcome))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_of_thousands_of_materials_fewer_directions_are_kept() {
        let sizes = [1, 100, 4_096, 4_097, 10_000, 1_000_000].map(|count| pool_size(count, 7));
        assert_eq!(sizes, [8_192, 8_192, 8_192, 4_096, 2_048, 512]);
    }
}
