//! Training with schedule prior: one run on all materials, then one run per fold to estimate the expected loss.

use std::ops::ControlFlow;

use glimpse_core::model::ModelKind;
use glimpse_kernels::completion::Shape;
use glimpse_materials::basis::Basis;
use glimpse_materials::{Identity, Material, Procedural, SourceShare};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::dataset::{Dataset, Subset};
use super::held_out::{HeldOut, TrainedFold};
use super::loss_predictor::{HeldOutLoss, HeldOutOrigin, LossPredictor};
use super::objective::CompletionObjective;
use super::reading::LOG_SCALE;
use super::refinement::Refinement;
use super::task::{AugmentationOptions, MaterialGroup};
use crate::linear::ComponentsAt;
use crate::meta::identity::RunIdentity;
use crate::meta::learned::{
    LearnedFit, LearnedNet, LearnedRecipe, LearnedRefinement, LearnedRidge, ValidatedLoss,
    ValidationSplit,
};
use crate::meta::objective::{LossEstimate, RandomStreams};
use crate::meta::options::{CompletionOptions, Options};
use crate::meta::outer::{Observer, OuterLoop, PathOfSamples, Progress, RunError};
use crate::meta::pattern::Reach;
use crate::meta::phase::{Phase, Values};
use crate::meta::plan::Effort;
use crate::meta::schedules::prior;

/// The number of Gauss-Newton steps from these parameters.
pub const GAUSS_NEWTON_STEPS: usize = 2;
/// The number of coefficients, m.
const COMPONENTS: usize = 24;
/// The number of components of the correction, K, for the model Linear with more samples than a device fits.
const MAX_CORRECTED_COMPONENTS: usize = 120;
/// The largest number of samples with [`COMPONENTS`] in the correction.
const MAX_DEVICE_SAMPLES: usize = 64;
/// The number of hidden units of the CoefficientNet, h.
const HIDDEN_UNITS: usize = 64;
/// The number of hidden units of the StartNet, g.
pub(super) const INIT_NET_UNITS: usize = 32;
/// The weight of the loss before the descent in the gradient, for models fitted by descent. The weight of the loss
/// after the descent is 1.
const AUXILIARY_WEIGHT: f32 = 0.3;
/// The maximum number of pool directions. With thousands of materials the pool is smaller; see [`pool_size`].
const MAX_POOL_SIZE: usize = 8_192;
/// The maximum memory of the pool in bytes, enough for 4,096 materials at all directions.
const MAX_POOL_BYTES: usize = 3 << 30;
/// The number of folds.
const FOLDS: usize = 4;
/// The minimum number of materials of a source that is a fold.
const MIN_SOURCE: usize = 5;
/// The minimum number of materials to form folds.
const MIN_MATERIALS_FOR_FOLDS: usize = 10;

/// Trains a recipe on all materials. Then trains once per fold on the materials outside the fold, to estimate the loss
/// on unseen materials.
///
/// # Errors
/// If the run is stopped, or a checkpoint cannot be read or written.
pub fn train(
    options: &Options,
    refinement: Option<&dyn Refinement>,
    materials: Vec<Box<dyn Material>>,
    observer: &mut Observer<'_>,
) -> Result<LearnedRecipe, RunError> {
    let identities: Vec<Identity> = materials
        .iter()
        .map(|each| Identity::new(&**each))
        .collect();
    let identity = options.identity(&identities);
    let dataset = dataset(materials, options);
    let folds = folds(dataset.training_count, &options.source_shares, options.seed);
    let [steps, fold_steps] = prior::step_counts(options.effort, options.model);
    let mut session = Session {
        options,
        identity,
        refinement,
        dataset: &dataset,
        total: steps + folds.len() * fold_steps,
        done: 0,
        observer,
    };

    let components = corrected_components(options);
    let all = Subset::all(&dataset, components);
    let objective = session.objective(&all, None);
    let values = session.run(&objective, prior::phases, 0)?;
    let expected_loss = objective.expected_loss(&values);
    let shape = objective.shape;
    let mut held_out = HeldOut::new(&dataset, options);
    for (index, Fold { materials, origin }) in folds.iter().enumerate() {
        // The classes of procedural materials that are left out with the fold.
        let classes: Vec<usize> = (dataset.training_count..dataset.materials.len())
            .filter(|each| dataset.classes[each - dataset.training_count] % FOLDS == index)
            .collect();
        let subset = Subset::without(&dataset, components, &[&materials[..], &classes].concat());
        let fold_objective = session.objective(&subset, Some(&values));
        let fold_values = session.run(&fold_objective, prior::fold, index + 1)?;
        held_out.add(&TrainedFold {
            index,
            full: (&objective, &values),
            fold: (&fold_objective, &fold_values),
            materials,
            origin: *origin,
            classes: &classes,
        });
    }
    let held_out = held_out.finish();
    let expected_loss = validated_loss(expected_loss, &held_out.complete);
    let pattern = objective.reachable_pattern(&values).angles().to_vec();
    let hyperparameters = objective.hyperparameters(&values);
    let net = LearnedNet {
        shape,
        missing: dataset.augmentation_options.missing_policy(),
        scale: LOG_SCALE,
        weights: values.coefficient_net,
    };
    let basis = refinement.is_none().then(|| all.basis.to_bytes());
    let checksum = basis.as_deref().map_or(0, Basis::checksum);
    let at = ComponentsAt::new(&all.basis, pattern.clone());
    let ridge = LearnedRidge::new(at, &hyperparameters.precision, checksum);
    let refinement = refinement.zip(hyperparameters.steps);
    let refinement = refinement.map(|(refinement, hyperparameters)| {
        let steps = refinement.learned(values.initial, hyperparameters, &all.virtual_readings);
        LearnedRefinement {
            steps,
            shape,
            start_net: values.start_net,
        }
    });
    Ok(LearnedRecipe {
        pattern,
        fit: LearnedFit::Ridge {
            net: Some(net),
            ridge,
            refinement,
        },
        loss_predictor: LossPredictor::new(&held_out.complete, FOLDS).map(|predictor| {
            let counts = options.source_shares.iter().map(|each| each.materials);
            predictor
                .with_sources(&held_out.complete, &counts.collect::<Vec<_>>())
                .with_partial(&held_out.partial, options.samples)
        }),
        basis,
        expected_loss: Some(expected_loss),
        materials: identities,
    })
}

/// Returns the number of components of the correction, K.
fn corrected_components(options: &Options) -> usize {
    match options.model == ModelKind::Linear && options.samples > MAX_DEVICE_SAMPLES {
        true => MAX_CORRECTED_COMPONENTS,
        false => COMPONENTS,
    }
}

/// Returns the mean held-out loss of plain materials, or the loss on all training materials without folds.
fn validated_loss(training_loss: LossEstimate, held_out_losses: &[HeldOutLoss]) -> ValidatedLoss {
    let plain = held_out_losses
        .iter()
        .filter(|each| each.origin.is_training_material());
    let losses: Vec<f64> = plain.map(|each| f64::from(each.loss)).collect();
    if losses.is_empty() {
        return ValidatedLoss {
            estimate: training_loss,
            split: ValidationSplit::Training,
        };
    }
    let mean = losses.iter().sum::<f64>() / losses.len() as f64;
    ValidatedLoss {
        estimate: LossEstimate::new(mean as f32, losses.iter().copied()),
        split: ValidationSplit::Folds,
    }
}

/// Returns the dataset of `materials` and of procedural materials.
pub(super) fn dataset(mut materials: Vec<Box<dyn Material>>, options: &Options) -> Dataset {
    let completion_options = &options.completion_options;
    let training_count = materials.len();
    let sources = match &options.source_shares[..] {
        [] => vec![(training_count, 1.0)],
        source_shares => source_shares
            .iter()
            .map(|each| (each.materials, each.share))
            .collect(),
    };
    let mut groups = Vec::new();
    let mut classes = Vec::new();
    let mut first = 0;
    for (materials, share) in sources {
        groups.push(MaterialGroup {
            materials: (first..first + materials).collect(),
            share: share * (1.0 - completion_options.procedural),
        });
        first += materials;
    }
    if completion_options.procedural > 0.0 {
        let (count, seed) = CompletionOptions::PROCEDURAL_SET;
        let set = Procedural::set(count, seed);
        classes.extend(set.iter().map(Procedural::class_index));
        let set = set.into_iter();
        materials.extend(set.map(|each| Box::new(each) as Box<dyn Material>));
        groups.push(MaterialGroup {
            materials: (training_count..materials.len()).collect(),
            share: completion_options.procedural,
        });
    }
    let augmentation_options = AugmentationOptions {
        missing_share: completion_options.missing,
        noise: completion_options.noise(),
        ..AugmentationOptions::default()
    };
    let size = pool_size(training_count, augmentation_options.warps.len());
    let mut dataset = Dataset::new(
        materials,
        training_count,
        groups,
        augmentation_options,
        size,
        options.seed,
    );
    dataset.classes = classes;
    dataset
}

/// Returns the number of directions of the training and the validation pool. It is halved until the values of both
/// pools, with all warps, fit into [`MAX_POOL_BYTES`].
fn pool_size(materials: usize, warps: usize) -> usize {
    const MIN_SIZE: usize = 512;
    let mut size = MAX_POOL_SIZE;
    while size > MIN_SIZE && materials * (warps + 1) * size * size_of::<[f32; 3]>() > MAX_POOL_BYTES
    {
        size /= 2;
    }
    size
}

/// The materials of a fold.
struct Fold {
    materials: Vec<usize>,
    /// [`HeldOutOrigin::Source`] if the fold is a whole source, otherwise [`HeldOutOrigin::Material`].
    origin: HeldOutOrigin,
}

/// Returns the folds. The list is empty for too few materials. With several sources, the smallest one is a fold of its own
/// if it has at least [`MIN_SOURCE`] materials and at most a quarter of all: its losses are those of materials of another
/// origin.
fn folds(materials: usize, sources: &[SourceShare], seed: u64) -> Vec<Fold> {
    if materials < MIN_MATERIALS_FOR_FOLDS {
        return Vec::new();
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(u64::MAX);
    let smallest = sources.iter().map(|source| source.materials).min();
    let smallest = smallest
        .filter(|count| sources.len() > 1 && (MIN_SOURCE..=materials / FOLDS).contains(count));
    let mut first = 0;
    let mut source = 0..0;
    for each in sources {
        if Some(each.materials) == smallest {
            source = first..first + each.materials;
        }
        first += each.materials;
    }
    let mut order: Vec<usize> = (0..materials)
        .filter(|material| !source.contains(material))
        .collect();
    order.shuffle(&mut random);
    let count = match source.is_empty() {
        true => FOLDS,
        false => FOLDS - 1,
    };
    let fold = |first| Fold {
        materials: order.iter().copied().skip(first).step_by(count).collect(),
        origin: HeldOutOrigin::Material,
    };
    let mut folds: Vec<Fold> = (0..count).map(fold).collect();
    if !source.is_empty() {
        folds.push(Fold {
            materials: source.collect(),
            origin: HeldOutOrigin::Source,
        });
    }
    folds
}

/// Several runs that are reported to the observer as one run.
struct Session<'s, 'o> {
    options: &'s Options,
    identity: RunIdentity,
    refinement: Option<&'s dyn Refinement>,
    dataset: &'s Dataset,
    /// The number of outer steps of all runs.
    total: usize,
    /// The number of completed outer steps.
    done: usize,
    observer: &'s mut Observer<'o>,
}

impl<'s> Session<'s, '_> {
    /// Returns the objective of a run on a subset.
    fn objective<'a>(
        &self,
        subset: &'a Subset,
        earlier: Option<&'a Values>,
    ) -> CompletionObjective<'a>
    where
        's: 'a,
    {
        let parameters = self
            .refinement
            .map_or(0, |refinement| refinement.model().parameters().unwrap_or(0));
        CompletionObjective {
            dataset: self.dataset,
            subset,
            shape: Shape {
                samples: self.options.samples,
                components: COMPONENTS.min(subset.basis.components()),
                hidden: HIDDEN_UNITS,
                units: if parameters > 0 { INIT_NET_UNITS } else { 0 },
                parameters,
            },
            streams: RandomStreams {
                seed: self.options.seed,
            },
            refinement: self.refinement,
            auxiliary_weight: AUXILIARY_WEIGHT,
            reach: Reach {
                limits: self.options.completion_options.limits,
                fixed: &self.options.fixed,
            },
            motion: self.options.motion(),
            earlier,
        }
    }

    fn run<'a>(
        &mut self,
        objective: &'a CompletionObjective<'a>,
        phases: fn(&'a CompletionObjective<'a>, Effort) -> Vec<Phase<'a>>,
        stage: usize,
    ) -> Result<Values, RunError> {
        let phases = phases(objective, self.options.effort);
        let permute = |values, order: &[usize]| objective.permute_samples(values, order);
        let outer_loop = OuterLoop {
            initial: objective.initial_values(0),
            phases: &phases,
            path: objective.motion.as_ref().map(|motion| PathOfSamples {
                motion,
                permute: &permute,
            }),
            identity: self.identity,
            checkpoints: self.options.checkpoints.as_ref(),
            stage,
        };
        let (done_before, total) = (self.done, self.total);
        let observer = &mut *self.observer;
        let mut combined = |progress: &Progress| -> ControlFlow<()> {
            observer(&Progress {
                done: done_before + progress.done,
                total,
                ..*progress
            })
        };
        let values = match outer_loop.run(&mut combined) {
            Err(RunError::Stopped(done)) => Err(RunError::Stopped(done_before + done)),
            result => result,
        }?;
        self.done += phases.iter().map(|phase| phase.steps).sum::<usize>();
        Ok(values)
    }
}

#[cfg(test)]
mod tests {
    use glimpse_materials::Source;

    use super::*;

    #[test]
    fn pool_shrinks_for_thousands_of_materials() {
        let sizes = [1, 100, 4_096, 4_097, 10_000, 1_000_000].map(|count| pool_size(count, 7));
        assert_eq!(sizes, [8_192, 8_192, 8_192, 4_096, 2_048, 512]);
    }

    /// The smallest of several sources is a fold, unless it is too small or too large.
    #[test]
    fn smallest_source_is_a_fold() {
        let sources = |counts: &[usize]| -> Vec<SourceShare> {
            let source = |materials: &usize| SourceShare {
                materials: *materials,
                ..SourceShare::single(&Source("a".to_owned()), 1)
            };
            counts.iter().map(source).collect()
        };
        for (counts, expected) in [
            (&[100, 12][..], Some(100..112)),
            (&[12, 100], Some(0..12)),
            (&[100, 4], None),
            (&[60, 50], None),
            (&[110], None),
            (&[20, 200, 20], Some(220..240)),
        ] {
            let count = counts.iter().sum();
            let folds = folds(count, &sources(counts), 3);
            assert_eq!(folds.len(), FOLDS);
            let source = folds
                .iter()
                .find(|fold| fold.origin == HeldOutOrigin::Source);
            let source = source.map(|fold| fold.materials.clone());
            assert_eq!(source, expected.map(Iterator::collect), "{counts:?}");
            let mut all: Vec<usize> = folds.into_iter().flat_map(|fold| fold.materials).collect();
            all.sort_unstable();
            assert!(all.into_iter().eq(0..count), "{counts:?}");
        }
        assert!(folds(MIN_MATERIALS_FOR_FOLDS - 1, &[], 0).is_empty());
    }
}
