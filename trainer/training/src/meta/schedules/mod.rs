//! Schedules: which phases there are, one file each.

mod changes;
mod doubling;
mod joint;
mod linear;
mod paper;
mod prior;
mod small;

use glimpse_core::model::ModelKind;

use super::plan::{Effort, Plan, Schedule};

impl Plan {
    /// The plan for a model and a number of samples; `tasks` is the number of materials.
    #[must_use]
    pub fn new(
        schedule: Schedule,
        effort: Effort,
        model: ModelKind,
        samples: usize,
        tasks: usize,
    ) -> Self {
        match schedule {
            Schedule::Joint if model == ModelKind::Linear => linear::plan(effort, samples, tasks),
            Schedule::Joint if model == ModelKind::Neural => joint::plan(effort, samples, tasks),
            Schedule::Joint => small::plan(effort, samples, tasks),
            Schedule::Paper => paper::plan(effort, model, samples, tasks),
            Schedule::Prior => prior::plan(effort, model, samples, tasks),
        }
    }

    /// The plan for a completion of a fold: at a pattern that stays, for others to be judged by.
    #[must_use]
    pub fn of_a_fold(effort: Effort, model: ModelKind, samples: usize, tasks: usize) -> Self {
        prior::fold(effort, model, samples, tasks)
    }
}

#[cfg(test)]
mod tests {
    use super::doubling::UNDOUBLED;
    use super::*;
    use crate::meta::phase::{InnerSamples, Selection, Start};
    use crate::meta::plan::PretrainedInit;

    #[test]
    fn the_paper_s_stages() {
        let tasks = 80;
        let plan = Plan::new(Schedule::Paper, Effort::Long, ModelKind::Neural, 5, tasks);
        let [first, guesses, patterns @ ..] = &plan.phases[..] else {
            panic!("{plan:?}");
        };
        assert_eq!(
            (first.steps, first.inner),
            (800_000, InnerSamples::Fresh(512))
        );
        assert_eq!((guesses.steps, guesses.samples), (50 * tasks, 1));
        let samples: Vec<_> = patterns.iter().map(|phase| phase.samples).collect();
        assert_eq!(samples, [1, 2, 4, 5]);
        for phase in patterns {
            assert_eq!(
                (phase.start, phase.keep),
                (Start::Best, Selection::BestEpoch)
            );
            assert_eq!(phase.steps, 500 * tasks);
            assert!(phase.rates_at(0).pattern == 5e-4);
            // Meta and Ours have the same start and step sizes.
            assert!(phase.rates.initial == 0.0 && phase.rates.hyperparameters == 0.0);
            let last = phase.rates_at(phase.steps).pattern;
            assert!((last - 1e-4).abs() < 1e-9, "{last}");
        }
        let at = |done| plan.at(done).map(|at| (at.number, at.step));
        assert_eq!(at(0), Some((0, 0)));
        assert_eq!(at(800_000), Some((1, 0)));
        assert_eq!(at(plan.steps() - 1), Some((5, 500 * tasks - 1)));
        assert_eq!(at(plan.steps()), None);
        assert_eq!(plan.clone().without_pattern(5).phases.len(), 1);

        // Both stages once more: the first one on the pattern, and no guesses.
        let [.., again, pattern] = &plan.clone().twice().phases[..] else {
            panic!("{plan:?}");
        };
        assert_eq!(
            (again.start, again.inner),
            (Start::Best, InnerSamples::Pattern)
        );
        assert_eq!((again.steps, again.samples), (800_000, 5));
        assert!(again.rates.initial > 0.0 && again.rates.pattern == 0.0);
        assert_eq!(
            (pattern.start, pattern.keep),
            (Start::Best, Selection::BestEpoch)
        );
        assert!(pattern.rates.initial == 0.0 && pattern.rates.pattern > 0.0);

        let known = PretrainedInit {
            initial: vec![1.0],
            step_sizes: vec![0.5],
        };
        let alone = plan.pattern_only(known);
        assert_eq!(alone.phases.len(), 5);
        assert!(alone.phases.iter().all(|phase| phase.rates.initial == 0.0));

        // Nothing of Linear is learned but the pattern; a tenth of the steps.
        let plan = Plan::new(
            Schedule::Paper,
            Effort::Standard,
            ModelKind::Linear,
            1,
            tasks,
        );
        let steps: Vec<_> = plan.phases.iter().map(|phase| phase.steps).collect();
        assert_eq!(steps, [50 * tasks, 50 * tasks]);
    }

    #[test]
    fn many_samples_of_neural_come_from_doubling() {
        let plan = Plan::new(Schedule::Joint, Effort::Quick, ModelKind::Neural, 100, 64);
        let few = Plan::new(
            Schedule::Joint,
            Effort::Quick,
            ModelKind::Neural,
            UNDOUBLED,
            64,
        );
        let samples: Vec<_> = plan.phases.iter().map(|phase| phase.samples).collect();
        let (same, doubled) = samples.split_at(few.phases.len());
        assert!(same.iter().all(|samples| *samples == UNDOUBLED));
        assert_eq!(doubled, [32, 64, 100]);
        assert!(few.phases.iter().all(|phase| phase.samples == UNDOUBLED));
    }
}
