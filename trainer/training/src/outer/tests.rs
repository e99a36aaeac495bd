//! Tests of the outer loop with scripted losses.

use std::cell::RefCell;

use glimpse_optimizer::Groups;

use super::*;

/// The number of steps of an epoch.
const EPOCH: usize = 2;

/// Runs two phases with scripted losses and a constant gradient of the pattern. The first phase has one sample, the second
/// one two. Returns the best values, and the pattern of each step.
fn run(
    losses: &[&[f32]; 2],
    mut observe: impl FnMut(&TrainingProgress) + Send,
) -> (MetaValues, Vec<Vec<f32>>) {
    let patterns = RefCell::new(Vec::new());
    let patterns = &patterns;
    let phase = |samples: usize| Phase {
        name: "pattern",
        samples,
        start: Some(Box::new(move |mut values: MetaValues| {
            values.pattern.resize(3 * samples, -1.0);
            values
        })),
        gradient: Box::new(move |values: &MetaValues, step| {
            patterns.borrow_mut().push(values.pattern.clone());
            let gradient = MetaValues {
                pattern: vec![1.0; values.pattern.len()],
                ..MetaValues::default()
            };
            (losses[step.phase_index][step.step], gradient)
        }),
        selection: Criterion::BestEpoch(EPOCH),
        steps: losses[0].len(),
        batch: 1,
        rates: Groups {
            pattern: 1e-3,
            ..Groups::default()
        },
        final_rate_ratio: 0.5,
        warm_up_steps: 0,
        max_gradient_norm: f32::INFINITY,
        weight_decay: 0.0,
        initial_allowance: 1.0,
    };
    let identity = RunIdentity {
        options: 0,
        materials: 0,
    };
    let mut observer = |progress: &TrainingProgress| {
        observe(progress);
        ControlFlow::Continue(())
    };
    let mut session = Session::new(identity, None, &mut observer);
    let values = session.run(MetaValues::default(), &[phase(1), phase(2)], None);
    (values.unwrap(), patterns.take())
}

#[test]
fn best_epoch_initializes_next_phase() {
    let losses: [&[f32]; 2] = [
        &[3.0, 3.0, 1.0, 1.5, 0.0, 4.0],
        &[9.0, 9.0, 5.0, 5.0, 6.0, 6.0],
    ];
    let mut best_losses = Vec::new();
    let (values, patterns) = run(&losses, |progress| best_losses.push(progress.best));
    // The best values of phase 1 initialize phase 2.
    assert_eq!(patterns[6][..3], patterns[4]);
    assert_eq!(patterns[6].len(), 6);
    assert_eq!(values.pattern, patterns[10]);
    // The barrier of these patterns is 0.
    assert_eq!(best_losses[..4], [None, Some(3.0), Some(3.0), Some(1.25)]);
    assert_eq!(best_losses[6..8], [None, Some(9.0)]);
    assert_eq!(best_losses[11], Some(5.0));
}

#[test]
fn nan_losses_are_ignored() {
    let losses: [&[f32]; 2] = [&[f32::NAN, 3.0, f32::NAN, 4.0], &[4.0, f32::NAN, 4.0, 4.0]];
    let mut smoothed = Vec::new();
    let (values, patterns) = run(&losses, |progress| smoothed.push(progress.loss));
    assert!(smoothed[0].is_nan());
    assert_eq!(smoothed[1..3], [3.0, 3.0]);
    assert!(smoothed[3..].iter().all(|loss| (3.0..4.0).contains(loss)));
    // The first epoch of a phase has a NaN loss, and is not selected: the result follows the last step.
    assert_ne!(values.pattern, patterns[6]);
    assert!(values.pattern[0] < patterns[7][0]);
}
