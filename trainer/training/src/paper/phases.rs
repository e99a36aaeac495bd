//! The phases of schedule paper: the two stages of the paper.

use glimpse_core::model::ModelKind;
use glimpse_fitting::recipe::options::{TrainedParts, TrainingOptions};
use glimpse_materials::sampling::{sobol_valid, uniform_valid};
use glimpse_optimizer::Groups;
use rayon::prelude::*;

use super::objective::{InnerSamples, LossSamples, PaperObjective};
use crate::outer::{Criterion, MetaValues, OuterStep, Phase, PhaseStart};
use crate::pattern::Reach;

/// The number of random patterns of one sample; the best one starts stage 2.
const RANDOM_PATTERNS: usize = 50;
/// The index that selects the random numbers of their losses.
const RANDOM_PATTERNS_PHASE: usize = 0xFF;
/// The samples of stage 1.
const PARAMETER_SAMPLES: LossSamples = LossSamples {
    inner: InnerSamples::Fresh(512),
    outer: 512,
};
/// The samples of stage 2.
const PATTERN_SAMPLES: LossSamples = LossSamples {
    inner: InnerSamples::Pattern,
    outer: 25_000,
};

/// Returns the phases of the paper, with one task per step. `tasks` is the number of materials.
///
/// Stage 1 trains initial parameters and step sizes for 10,000 epochs; Linear has none. Stage 2 trains the pattern. It
/// starts from the best random pattern of one sample, and doubles it up to the requested n, with 500 epochs for each n.
/// [`TrainedParts::AllTwice`] appends both stages again: stage 1 on the trained pattern (paper, "Convergence").
#[must_use]
pub(super) fn phases<'a>(
    objective: &'a dyn PaperObjective,
    options: &TrainingOptions,
    tasks: usize,
) -> Vec<Phase<'a>> {
    let (samples, seed) = (options.samples, options.seed);
    let has_parameters = options.model != ModelKind::Linear;
    let divisor = options.effort.paper_step_divisor();
    let parameters = |start, loss_samples| Phase {
        name: "initial parameters and step sizes",
        samples,
        start,
        gradient: Box::new(move |values: &_, step| objective.gradient(values, step, loss_samples)),
        selection: Criterion::Last,
        steps: 10_000 / divisor * tasks,
        batch: 1,
        rates: Groups {
            initial: 1e-4,
            hyperparameters: 1e-4,
            ..Groups::default()
        },
        final_rate_ratio: 1.0,
        warm_up_steps: 0,
        max_gradient_norm: f32::INFINITY,
        weight_decay: 1e-6,
        initial_allowance: 1.0,
    };
    let pattern = |samples, start| {
        let (rate, final_rate_ratio) = match has_parameters {
            true => (5e-4, 0.2),
            false => (1e-3, 0.5),
        };
        Phase {
            name: "pattern",
            samples,
            selection: Criterion::BestEpoch(tasks),
            steps: 500 / divisor * tasks,
            rates: Groups {
                pattern: rate,
                ..Groups::default()
            },
            final_rate_ratio,
            weight_decay: 0.0,
            ..parameters(Some(start), PATTERN_SAMPLES)
        }
    };
    let best = || -> PhaseStart<'a> { Box::new(|best| best) };

    let mut phases = Vec::new();
    if has_parameters && !matches!(options.parts, TrainedParts::PatternOnly(_)) {
        phases.push(parameters(None, PARAMETER_SAMPLES));
    }
    let random: PhaseStart<'a> =
        Box::new(move |values| best_random_pattern(objective, &values, tasks, seed));
    phases.push(pattern(1, random));
    for count in doubled(samples) {
        let add = move |values| with_added_samples(values, count, seed);
        phases.push(pattern(count, Box::new(add)));
    }
    if options.parts == TrainedParts::AllTwice {
        if has_parameters {
            let loss_samples = LossSamples {
                inner: InnerSamples::Pattern,
                ..PARAMETER_SAMPLES
            };
            phases.push(parameters(Some(best()), loss_samples));
        }
        phases.push(pattern(samples, best()));
    }
    phases
}

/// Returns the number of samples after each doubling of one sample, up to `target`.
fn doubled(target: usize) -> impl Iterator<Item = usize> {
    let next = move |n: &usize| (*n < target).then_some((2 * n).min(target));
    std::iter::successors(Some(1), next).skip(1)
}

/// Returns values with the random pattern of one sample that has the smallest mean loss over an epoch.
fn best_random_pattern(
    objective: &dyn PaperObjective,
    values: &MetaValues,
    tasks: usize,
    seed: u64,
) -> MetaValues {
    let candidates = (0..RANDOM_PATTERNS).into_par_iter().map(|index| {
        let pattern = uniform_valid(1, seed.wrapping_add((index as u64 + 1) << 32));
        let values = MetaValues {
            pattern: pattern
                .into_iter()
                .flat_map(|at| Reach::ANY.logits(at))
                .collect(),
            ..values.clone()
        };
        let losses = (0..tasks).map(|task| {
            let outer_step = OuterStep {
                phase_index: RANDOM_PATTERNS_PHASE,
                step: index * tasks + task,
                batch: 1,
            };
            objective.gradient(&values, outer_step, PATTERN_SAMPLES).0
        });
        let barrier = Reach::ANY.pattern(&values.pattern).barrier();
        (losses.sum::<f32>() / tasks as f32 + barrier, values)
    });
    let candidates: Vec<(f32, MetaValues)> = candidates.collect();
    let best = candidates.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or_else(|| values.clone(), |(_, values)| values)
}

/// Returns values with points of a Sobol sequence as additional samples.
fn with_added_samples(mut values: MetaValues, samples: usize, seed: u64) -> MetaValues {
    let existing = values.pattern.len() / 3;
    let added = sobol_valid(samples, seed as u32).into_iter().skip(existing);
    values
        .pattern
        .extend(added.flat_map(|at| Reach::ANY.logits(at)));
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use glimpse_fitting::recipe::expected_loss::LossEstimate;
    use glimpse_fitting::recipe::options::{Effort, Schedule};

    /// The loss of a pattern is that of its first logit.
    struct FirstLogit;

    impl PaperObjective for FirstLogit {
        fn initial_values(&self) -> MetaValues {
            MetaValues::default()
        }
        fn gradient(&self, values: &MetaValues, _: OuterStep, _: LossSamples) -> (f32, MetaValues) {
            (values.pattern[0], MetaValues::default())
        }
        fn expected_loss(&self, _: &MetaValues) -> LossEstimate {
            LossEstimate::of(&[])
        }
    }

    const TASKS: usize = 80;

    fn phases_of(
        effort: Effort,
        model: ModelKind,
        samples: usize,
        parts: TrainedParts,
    ) -> Vec<Phase<'static>> {
        let options = TrainingOptions {
            parts,
            ..TrainingOptions::new(model, samples, Schedule::Paper, effort, 0)
        };
        phases(&FirstLogit, &options, TASKS)
    }

    #[test]
    fn stages_are_those_of_the_paper() {
        let all = phases_of(Effort::Long, ModelKind::Neural, 5, TrainedParts::AllTwice);
        let [first, patterns @ .., again, pattern_again] = &all[..] else {
            panic!("{} phases", all.len());
        };
        for parameters in [first, again] {
            assert_eq!((parameters.steps, parameters.samples), (800_000, 5));
            assert!(parameters.rates.initial > 0.0 && parameters.rates.pattern == 0.0);
            assert!(matches!(parameters.selection, Criterion::Last));
        }
        let samples: Vec<_> = patterns.iter().map(|phase| phase.samples).collect();
        assert_eq!(samples, [1, 2, 4, 5]);
        for phase in patterns.iter().chain([pattern_again]) {
            assert!(matches!(phase.selection, Criterion::BestEpoch(TASKS)));
            assert_eq!(phase.steps, 500 * TASKS);
            assert!(phase.rates_at(0).pattern == 5e-4);
            // Meta and the paper's method share initial parameters and step sizes.
            assert!(phase.rates.initial == 0.0 && phase.rates.hyperparameters == 0.0);
            let last = phase.rates_at(phase.steps).pattern;
            assert!((last - 1e-4).abs() < 1e-9, "{last}");
        }
        let counts = [(TrainedParts::All, 5), (TrainedParts::PatternOnly(None), 4)];
        for (parts, count) in counts {
            let phases = phases_of(Effort::Long, ModelKind::Neural, 5, parts);
            assert_eq!(phases.len(), count);
        }
        // Linear has no first stage. Effort standard has a tenth of the paper's steps.
        let linear = phases_of(Effort::Standard, ModelKind::Linear, 1, TrainedParts::All);
        let steps: Vec<_> = linear.iter().map(|phase| phase.steps).collect();
        assert_eq!(steps, [50 * TASKS]);
    }

    #[test]
    fn pattern_starts_from_best_random_one_and_grows() {
        let phases = phases_of(Effort::Long, ModelKind::Linear, 2, TrainedParts::All);
        let start = |index: usize, values| phases[index].start.as_ref().map(|start| start(values));
        let best = start(0, MetaValues::default()).expect("random patterns");
        let random = (1..=RANDOM_PATTERNS as u64).map(|index| {
            let angles = uniform_valid(1, index << 32);
            Reach::ANY.logits(angles[0])[0]
        });
        assert_eq!(best.pattern[0], random.fold(f32::INFINITY, f32::min));
        let grown = start(1, best.clone()).expect("a larger pattern");
        assert_eq!(grown.pattern.len(), 6);
        assert_eq!(grown.pattern[..3], best.pattern);
    }
}
