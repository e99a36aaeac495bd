//! Cross-validation: the folds, and the losses of materials that were held out of training, which are the data of the loss
//! predictor.

use glimpse_fitting::recipe::options::TrainingOptions;
use glimpse_materials::SourceShare;
use glimpse_materials::sampling::random_stream;
use rand::seq::SliceRandom;

use super::dataset::{Dataset, LossDirections};
use super::objective::PriorObjective;
use crate::loss_predictor::{HeldOutLoss, HeldOutOrigin, LossEvidence};
use crate::outer::MetaValues;
use crate::tasks::task::{Dropout, MaterialGroup, TrainingTask};

/// The number of folds.
pub(super) const FOLDS: usize = 4;
/// The minimum number of materials of a source that is a fold.
const MIN_SOURCE: usize = 5;
/// The minimum number of materials to form folds.
const MIN_MATERIALS_FOR_FOLDS: usize = 10;

/// The materials of a fold.
pub(super) struct Fold {
    pub(super) materials: Vec<usize>,
    /// [`HeldOutOrigin::Source`] if the fold is a whole source, otherwise [`HeldOutOrigin::Material`].
    pub(super) origin: HeldOutOrigin,
}

/// Returns the folds. The list is empty for too few materials. With several sources, the smallest one is a fold of its own
/// if it has at least [`MIN_SOURCE`] materials and at most a quarter of all: its losses are those of materials of another
/// origin.
pub(super) fn folds(materials: usize, sources: &[SourceShare], seed: u64) -> Vec<Fold> {
    if materials < MIN_MATERIALS_FOR_FOLDS {
        return Vec::new();
    }
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
    order.shuffle(&mut random_stream(seed, u64::MAX));
    let count = FOLDS - usize::from(!source.is_empty());
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

/// The number of rough tasks per fold.
const ROUGH_TASKS: usize = 1_024;
/// The number of outer samples of each rough task.
const ROUGH_OUTER_SAMPLES: usize = 1_024;
/// The maximum number of measured prefixes.
const MAX_PARTIAL_COUNTS: usize = 16;
/// The stride of the validation octets for scans that end early. A subset is accurate enough.
const PARTIAL_OCTET_STRIDE: usize = 4;

/// The objective and the values of a run.
type Trained<'t> = (&'t PriorObjective<'t>, &'t MetaValues);

/// A fold, and the run without its materials.
pub(super) struct TrainedFold<'t> {
    /// The index of the fold.
    pub(super) index: usize,
    /// The run on all materials.
    pub(super) full: Trained<'t>,
    /// The shorter run without the fold's materials.
    pub(super) fold: Trained<'t>,
    /// The training materials of the fold.
    pub(super) materials: &'t [usize],
    /// The origin of these materials.
    pub(super) origin: HeldOutOrigin,
    /// The materials of procedural classes that are left out with the fold.
    pub(super) classes: &'t [usize],
}

/// The losses of held-out materials.
pub(super) struct HeldOut<'t> {
    dataset: &'t Dataset,
    options: &'t TrainingOptions,
    /// The losses of the full run and of the shorter runs of folds, summed over materials that both train on.
    sums: [f32; 2],
    /// Scans with all readings, rough materials included.
    pub(super) complete: Vec<HeldOutLoss>,
    /// Scans that end early, by their number of readings, without rough materials. Empty if the recipe needs all readings.
    pub(super) partial: Vec<(usize, Vec<HeldOutLoss>)>,
}

impl<'t> HeldOut<'t> {
    pub(super) fn new(dataset: &'t Dataset, options: &'t TrainingOptions) -> Self {
        let counts = partial_counts(options.samples).into_iter();
        let counts = counts.filter(|_| options.missing() > 0.0);
        Self {
            dataset,
            options,
            sums: [0.0; 2],
            complete: Vec::new(),
            partial: counts.map(|count| (count, Vec::new())).collect(),
        }
    }

    /// Adds the losses of a fold's materials.
    pub(super) fn add(&mut self, trained: &TrainedFold<'_>) {
        let ((full, values), (fold, _)) = (trained.full, trained.fold);
        let others: Vec<usize> = (0..self.dataset.training_count)
            .filter(|material| !trained.materials.contains(material))
            .collect();
        let plain = full.plain_tasks(&others, 1);
        let both = [trained.full, trained.fold];
        let both = both.map(|run| measure(run, &plain, &run.0.subset.validation));
        for (sum, measured) in self.sums.iter_mut().zip(&both) {
            *sum += measured.iter().map(|task| task.loss).sum::<f32>();
        }
        let factors = evidence_factors(&both);
        let held_out = |tasks: &[TrainingTask], origin| -> Vec<HeldOutLoss> {
            let directions = match origin {
                HeldOutOrigin::Rough => &fold.subset.training,
                _ => &fold.subset.validation,
            };
            let coefficients = full.map_tasks(values, tasks, |completed, index| {
                completed.mean_coefficients(index)
            });
            let results = measure(trained.fold, tasks, directions);
            let results = results.into_iter().zip(coefficients).zip(tasks);
            let results = results.map(|((measured, coefficients), task)| HeldOutLoss {
                material: task.material,
                coefficients,
                evidence: LossEvidence {
                    innovation: measured.evidence.innovation * factors.innovation,
                    residual: measured.evidence.residual * factors.residual,
                },
                loss: measured.loss,
                origin,
                fold: trained.index,
            });
            results.collect()
        };
        let plain_materials = [
            (trained.materials, trained.origin),
            (trained.classes, HeldOutOrigin::Class),
        ];
        let rough_tasks = self.rough_tasks(trained);
        let complete = &mut self.complete;
        for (materials, origin) in plain_materials {
            complete.extend(held_out(&fold.plain_tasks(materials, 1), origin));
        }
        complete.extend(held_out(&rough_tasks, HeldOutOrigin::Rough));
        for (count, losses) in &mut self.partial {
            for (materials, origin) in plain_materials {
                let tasks = fold
                    .plain_tasks(materials, PARTIAL_OCTET_STRIDE)
                    .into_iter();
                let tasks: Vec<TrainingTask> =
                    tasks.map(|task| task.ending_after(*count)).collect();
                losses.extend(held_out(&tasks, origin));
            }
        }
    }

    /// Returns the losses, corrected for the shorter runs of folds.
    pub(super) fn finish(mut self) -> Self {
        let [full, fold] = self.sums;
        let ratio = if fold > 0.0 { full / fold } else { 1.0 };
        let partial = self.partial.iter_mut().flat_map(|(_, list)| list);
        for held_out in self.complete.iter_mut().chain(partial) {
            held_out.loss *= ratio;
        }
        self
    }

    /// Draws augmented, rough tasks of a fold's materials and procedural classes, in equal shares. All readings are
    /// present.
    fn rough_tasks(&self, trained: &TrainedFold<'_>) -> Vec<TrainingTask> {
        let held_out = [trained.materials, trained.classes].into_iter();
        let groups: Vec<&[usize]> = held_out.filter(|materials| !materials.is_empty()).collect();
        let groups: Vec<MaterialGroup> = groups
            .iter()
            .map(|materials| MaterialGroup {
                materials: materials.to_vec(),
                share: 1.0 / groups.len() as f32,
            })
            .collect();
        let stream = u64::MAX - 1 - trained.index as u64;
        let mut random = random_stream(self.options.seed, stream);
        let samples = self.options.samples;
        let counts = [samples, ROUGH_OUTER_SAMPLES];
        let draw = |_| {
            let task = (self.dataset).draw_task(&groups, counts, Dropout::TailOrFew, &mut random);
            task.with_roughness(&mut random).ending_after(samples)
        };
        (0..ROUGH_TASKS).map(draw).collect()
    }
}

/// The loss of a task, and the evidence of its readings.
struct Measured {
    loss: f32,
    evidence: LossEvidence,
}

/// Returns the losses of tasks at some directions, and the evidence of their readings.
fn measure(
    (objective, values): Trained<'_>,
    tasks: &[TrainingTask],
    directions: &LossDirections<'_>,
) -> Vec<Measured> {
    objective.map_tasks(values, tasks, |completed, index| Measured {
        loss: completed.loss(index, objective.refinement, directions).loss,
        evidence: completed.evidence(index, objective.refinement),
    })
}

/// Returns the factors between the evidence of the full run and that of a fold's shorter run: means of logarithms over
/// materials that both runs train on. The evidence of held-out materials is multiplied by them.
fn evidence_factors([full, fold]: &[Vec<Measured>; 2]) -> LossEvidence {
    let mean = |list: &[Measured], value: fn(&LossEvidence) -> f32| {
        let sum: f32 = list.iter().map(|task| value(&task.evidence)).sum();
        sum / list.len().max(1) as f32
    };
    let factor = |value| (mean(full, value) - mean(fold, value)).exp();
    LossEvidence {
        innovation: factor(LossEvidence::log_innovation),
        residual: factor(LossEvidence::log_residual),
    }
}

/// Returns the numbers of readings below `samples` at which scans that end early are measured, in ascending order: all
/// for few samples, otherwise a geometric sequence from 1 to `samples` - 1.
fn partial_counts(samples: usize) -> Vec<usize> {
    if samples <= MAX_PARTIAL_COUNTS {
        return (1..samples).collect();
    }
    let ratio = (samples as f64 - 1.0).ln() / (MAX_PARTIAL_COUNTS - 1) as f64;
    let counts = (0..MAX_PARTIAL_COUNTS).map(|index| (ratio * index as f64).exp().round() as usize);
    let mut counts: Vec<usize> = counts.collect();
    counts.dedup();
    counts
}

#[cfg(test)]
mod tests {
    use glimpse_materials::Source;

    use super::*;

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

    #[test]
    fn partial_counts_include_one_and_ascend() {
        assert_eq!(partial_counts(1), [0; 0]);
        assert_eq!(partial_counts(5), [1, 2, 3, 4]);
        for samples in [17, 64, 512, 4_096] {
            let counts = partial_counts(samples);
            assert!(counts.len() <= MAX_PARTIAL_COUNTS && counts[0] == 1);
            assert!(counts.is_sorted_by(|one, next| one < next));
            assert!(counts.last().is_some_and(|last| *last < samples));
        }
    }
}
