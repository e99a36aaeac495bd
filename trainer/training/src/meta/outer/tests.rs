//! Tests of the outer loop with a scripted objective.

use std::sync::Mutex;

use glimpse_core::model::ModelKind;

use super::*;
use crate::meta::plan::TrainedParts;
use crate::meta::plan::{Effort, Schedule};

/// An objective with scripted losses per phase and step, and a constant gradient of the pattern.
struct ScriptedObjective {
    losses: [&'static [f32]; 2],
    /// The patterns at which the gradient was evaluated, one per step.
    patterns: Mutex<Vec<Vec<f32>>>,
}

impl MetaObjective for ScriptedObjective {
    fn initial_values(&self, _: u64) -> Groups<Vec<f32>> {
        Groups {
            pattern: vec![-1.0; 3],
            ..Groups::default()
        }
    }
    fn gradient(
        &self,
        values: &Groups<Vec<f32>>,
        outer_step: OuterStep<'_>,
    ) -> (f32, Groups<Vec<f32>>) {
        self.patterns.lock().unwrap().push(values.pattern.clone());
        let gradient = Groups {
            pattern: vec![1.0; values.pattern.len()],
            ..Groups::default()
        };
        (
            self.losses[outer_step.phase_index][outer_step.step],
            gradient,
        )
    }
    fn fitness(&self, values: &Groups<Vec<f32>>, _: &Phase) -> f32 {
        self.validation_loss(values)
    }
    fn validation_loss(&self, _: &Groups<Vec<f32>>) -> f32 {
        0.5
    }
    fn expected_loss(&self, values: &Groups<Vec<f32>>) -> LossEstimate {
        LossEstimate::new(self.validation_loss(values), [0.0; 2].into_iter())
    }
}

const IDENTITY: RunIdentity = RunIdentity {
    model: ModelKind::Linear,
    samples: 2,
    schedule: Schedule::Paper,
    effort: Effort::Long,
    parts: TrainedParts::All,
    seed: 0,
    materials: 2,
    options_digest: 0,
    materials_digest: 0,
};

/// Runs two phases of `steps` steps each. The first phase has one sample, the second one two.
fn run(
    objective: &ScriptedObjective,
    steps: usize,
    mut observe: impl FnMut(&Progress) + Send,
) -> Outcome {
    let mut plan = Plan::new(Schedule::Paper, Effort::Long, ModelKind::Linear, 2, 2);
    plan.phases.remove(0);
    for phase in &mut plan.phases {
        phase.steps = steps;
    }
    let outer_loop = OuterLoop {
        objective,
        plan: &plan,
        identity: IDENTITY,
        seed: 0,
        checkpoints: None,
        stage: 0,
    };
    let outcome = outer_loop.run(&mut |progress| {
        observe(progress);
        ControlFlow::Continue(())
    });
    outcome.unwrap()
}

#[test]
fn best_epoch_initializes_next_phase() {
    let objective = ScriptedObjective {
        losses: [
            &[3.0, 3.0, 1.0, 1.5, 0.0, 4.0],
            &[9.0, 9.0, 5.0, 5.0, 6.0, 6.0],
        ],
        patterns: Mutex::default(),
    };
    let mut best_losses = Vec::new();
    let outcome = run(&objective, 6, |progress| best_losses.push(progress.best));
    let patterns = objective.patterns.into_inner().unwrap();
    // An epoch has two steps. The best values of phase 1 initialize phase 2.
    assert_eq!(patterns[6][..3], patterns[4]);
    assert_eq!(patterns[6].len(), 6);
    assert_eq!(outcome.values.pattern, patterns[10]);
    assert_eq!(outcome.expected_loss.loss, 0.5);
    // The barrier of these patterns is 0.
    assert_eq!(best_losses[..4], [None, Some(3.0), Some(3.0), Some(1.25)]);
    assert_eq!(best_losses[6..8], [None, Some(9.0)]);
    assert_eq!(best_losses[11], Some(5.0));
}

#[test]
fn nan_losses_are_excluded_from_smoothed_loss() {
    let objective = ScriptedObjective {
        losses: [&[f32::NAN, 3.0, f32::NAN, 4.0], &[4.0, f32::NAN, 4.0, 4.0]],
        patterns: Mutex::default(),
    };
    let mut losses = Vec::new();
    let outcome = run(&objective, 4, |progress| losses.push(progress.loss));
    assert_eq!(losses[..3], [0.0, 3.0, 3.0]);
    assert!(losses[3..].iter().all(|loss| (3.0..4.0).contains(loss)));
    // An epoch with a NaN loss is not selected.
    assert_eq!(outcome.values.pattern.len(), 6);
}
