//! The plans of the training schedules, one module per schedule.

mod doubling;
mod joint_linear;
mod joint_neural;
mod joint_small;
mod paper;
mod prior;
mod variants;

use glimpse_core::model::ModelKind;

use super::plan::{Effort, Plan, Schedule};

impl Plan {
    /// Returns the plan of a schedule. `tasks` is the number of materials.
    #[must_use]
    pub fn new(
        schedule: Schedule,
        effort: Effort,
        model: ModelKind,
        samples: usize,
        tasks: usize,
    ) -> Self {
        match schedule {
            Schedule::Joint if model == ModelKind::Linear => {
                joint_linear::plan(effort, samples, tasks)
            }
            Schedule::Joint if model == ModelKind::Neural => {
                joint_neural::plan(effort, samples, tasks)
            }
            Schedule::Joint => joint_small::plan(effort, samples, tasks),
            Schedule::Paper => paper::plan(effort, model, samples, tasks),
            Schedule::Prior => prior::plan(effort, model, samples, tasks),
        }
    }

    /// Returns the plan of one cross-validation fold of schedule prior, at a fixed pattern. The resulting losses on the
    /// fold's materials, which the run does not train on, estimate the loss on unseen materials.
    #[must_use]
    pub fn for_fold(effort: Effort, model: ModelKind, samples: usize, tasks: usize) -> Self {
        prior::fold(effort, model, samples, tasks)
    }
}

#[cfg(test)]
mod tests {
    use super::doubling::MAX_UNDOUBLED;
    use super::*;
    use crate::meta::phase::{Initialization, InnerSamples, Selection};
    use crate::meta::plan::PretrainedInit;

    #[test]
    fn paper_schedule_has_stages_of_paper() {
        let tasks = 80;
        let plan = Plan::new(Schedule::Paper, Effort::Long, ModelKind::Neural, 5, tasks);
        let [first, guesses, patterns @ ..] = &plan.phases[..] else {
            panic!("{plan:?}");
        };
        assert_eq!(
            (first.steps, first.inner_samples),
            (800_000, InnerSamples::Fresh(512))
        );
        assert_eq!((guesses.steps, guesses.samples), (50 * tasks, 1));
        let samples: Vec<_> = patterns.iter().map(|phase| phase.samples).collect();
        assert_eq!(samples, [1, 2, 4, 5]);
        for phase in patterns {
            assert_eq!(
                (phase.initialization, phase.selection),
                (Initialization::Best, Selection::BestEpoch)
            );
            assert_eq!(phase.steps, 500 * tasks);
            assert!(phase.rates_at(0).pattern == 5e-4);
            // The paper's methods Meta and Ours share initial parameters and step sizes.
            assert!(phase.rates.initial == 0.0 && phase.rates.hyperparameters == 0.0);
            let last = phase.rates_at(phase.steps).pattern;
            assert!((last - 1e-4).abs() < 1e-9, "{last}");
        }
        let position = |index| {
            let outer_step = plan.outer_step(index)?;
            Some((outer_step.phase_index, outer_step.step))
        };
        assert_eq!(position(0), Some((0, 0)));
        assert_eq!(position(800_000), Some((1, 0)));
        assert_eq!(position(plan.steps() - 1), Some((5, 500 * tasks - 1)));
        assert_eq!(position(plan.steps()), None);
        assert_eq!(plan.clone().without_pattern(5).phases.len(), 1);

        // `twice` repeats both stages, the first one on the pattern, but not the random patterns.
        let [.., first, pattern] = &plan.clone().twice().phases[..] else {
            panic!("{plan:?}");
        };
        assert_eq!(
            (first.initialization, first.inner_samples),
            (Initialization::Best, InnerSamples::Pattern)
        );
        assert_eq!((first.steps, first.samples), (800_000, 5));
        assert!(first.rates.initial > 0.0 && first.rates.pattern == 0.0);
        assert_eq!(
            (pattern.initialization, pattern.selection),
            (Initialization::Best, Selection::BestEpoch)
        );
        assert!(pattern.rates.initial == 0.0 && pattern.rates.pattern > 0.0);

        let pretrained = PretrainedInit {
            initial: vec![1.0],
            step_sizes: vec![0.5],
        };
        let pattern_only = plan.pattern_only(Some(pretrained));
        assert_eq!(pattern_only.phases.len(), 5);
        assert!(
            pattern_only
                .phases
                .iter()
                .all(|phase| phase.rates.initial == 0.0)
        );

        // Linear has no first stage. Effort standard has a tenth of the paper's steps.
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
    fn neural_doubles_large_patterns() {
        let plan = Plan::new(Schedule::Joint, Effort::Quick, ModelKind::Neural, 100, 64);
        let undoubled_plan = Plan::new(
            Schedule::Joint,
            Effort::Quick,
            ModelKind::Neural,
            MAX_UNDOUBLED,
            64,
        );
        let samples: Vec<_> = plan.phases.iter().map(|phase| phase.samples).collect();
        let (undoubled, doubled) = samples.split_at(undoubled_plan.phases.len());
        assert!(undoubled.iter().all(|samples| *samples == MAX_UNDOUBLED));
        assert_eq!(doubled, [32, 64, 100]);
        assert!(
            undoubled_plan
                .phases
                .iter()
                .all(|phase| phase.samples == MAX_UNDOUBLED)
        );
    }
}
