//! Tests of the budget for the time of a scan: the gradient of a path's time, and trained patterns within a budget.

use std::ops::ControlFlow;

use glimpse_core::geometry::{Angles, Arms};
use glimpse_core::gonio::Limits;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;
use glimpse_fitting::recipe::options::{Effort, Schedule, TrainingOptions};
use glimpse_fitting::route::{
    LimitArgs, Order, Route, SpeedArgs, TimedMachine, arms_in_degrees, stops,
};
use glimpse_training::pattern::Reach;
use glimpse_training::run::train;
use glimpse_training::scan_budget::{Motion, ScanBudgetError};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::support::procedural;

const SPEEDS: [f64; 4] = [10.0, 15.0, 8.0, 12.0];
/// The number of samples of a path.
const SAMPLES: usize = 6;

fn machine(settle: f64, limits: Limits) -> TimedMachine {
    TimedMachine {
        speeds: Arms::from_array(SPEEDS),
        settle,
        limits,
        ..TimedMachine::default()
    }
}

fn random_angles(random: &mut ChaCha8Rng) -> Vec<Angles<f32>> {
    let ranges = [0.05..0.6, 0.1..0.8, 0.1..3.0_f32];
    let mut draw = || ranges.clone().map(|range| random.random_range(range));
    (0..SAMPLES).map(|_| Angles::from_array(draw())).collect()
}

/// Returns the travel time of a path by the route's own computation.
fn path_seconds(angles: &[Angles<f32>]) -> f64 {
    let stops: Vec<_> = angles.iter().copied().map(arms_in_degrees).collect();
    let machine = machine(0.0, Limits::NONE);
    Route::new(&machine, &stops, Order::Progressive, 0).travel
}

/// The gradient with respect to the logits, within limits: at the budget, it is the weight times that of the seconds.
#[test]
fn weighted_gradient_matches_differences() {
    let limits = Limits {
        max_theta_i: 1.4,
        max_theta_o: 1.4,
        min_separation: 0.1,
        ..Limits::NONE
    };
    let reach = Reach { limits, fixed: &[] };
    let norm = |list: &[f64]| list.iter().map(|x| x * x).sum::<f64>().sqrt();
    let cosine = |one: &[f64], other: &[f64]| {
        let products = one.iter().zip(other).map(|(one, other)| one * other);
        products.sum::<f64>() / (norm(one) * norm(other))
    };
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut smooth_paths = 0;
    for _ in 0..60 {
        let angles = random_angles(&mut random);
        let logits: Vec<f32> = angles
            .iter()
            .flat_map(|angles| reach.logits(*angles))
            .collect();
        let seconds = |logits: &[f32]| path_seconds(&reach.pattern(logits).angles);
        let unchanged = seconds(&logits);
        let slopes = |step: f32| -> Vec<f64> {
            let mut moved = logits.clone();
            let mut slope = |index: usize| {
                moved[index] += step;
                let change = seconds(&moved) - unchanged;
                moved[index] = logits[index];
                change / f64::from(step)
            };
            (0..logits.len()).map(&mut slope).collect()
        };
        // If two axes of a move take the same time, the path has two gradients.
        let [above, below] = [1e-3, -1e-3].map(slopes);
        if cosine(&above, &below) < 0.9999 {
            continue;
        }
        smooth_paths += 1;
        let motion = Motion::new(path_seconds(&angles), machine(0.0, limits), SAMPLES);
        assert!((motion.path(&angles).seconds - path_seconds(&angles)).abs() < 1e-9);
        let mut weight = 0.5;
        let gradient = motion.weighted_gradient(&logits, 1.0, &mut weight);
        // The aim is slightly below the budget, so the weight rises.
        assert!((0.5..0.52).contains(&weight), "{weight}");
        let slopes: Vec<f64> = above
            .iter()
            .zip(below)
            .map(|(a, b)| (a + b) / 2.0)
            .collect();
        let gradient: Vec<f64> = gradient.into_iter().map(f64::from).collect();
        let cosine = cosine(&gradient, &slopes);
        assert!(cosine > 0.999, "{gradient:?} {slopes:?}");
        let ratio = norm(&gradient) / norm(&slopes);
        assert!((0.48..0.55).contains(&ratio), "{ratio}");
    }
    assert!(smooth_paths > 20, "{smooth_paths}");
}

#[test]
fn faster_order_shortens_path_and_shortened_pattern_is_within_budget() {
    let mut random = ChaCha8Rng::seed_from_u64(8);
    let limits = Limits {
        max_theta_i: 1.4,
        max_theta_o: 1.3,
        min_separation: 0.2,
        in_plane: false,
    };
    let within = |seconds| Motion::new(seconds, machine(0.5, limits), 12);
    let motion = within(12.0);
    let mut logits: Vec<f32> = (0..36).map(|_| random.random_range(-2.0..2.0)).collect();
    let path = |logits: &[f32]| {
        let angles = Reach { limits, fixed: &[] }.reachable_angles(logits);
        motion.path(&angles).seconds
    };
    let before = path(&logits);
    let order = motion.faster_order(&logits, true).expect("a faster order");
    let sorted: Vec<f32> = order
        .iter()
        .flat_map(|sample| logits[3 * sample..][..3].to_vec())
        .collect();
    assert!(path(&sorted) < before);
    assert_eq!(motion.faster_order(&sorted, true), None);
    logits = sorted;
    assert!(path(&logits) > 6.0);
    motion
        .shorten(&mut logits)
        .expect("a pattern within the budget");
    assert!(path(&logits) <= 6.0);
    let unchanged = logits.clone();
    motion
        .shorten(&mut logits)
        .expect("a pattern within the budget");
    assert_eq!(logits, unchanged);
    // The samples are at least 0.2 rad apart, and the arms start at the normal.
    let error = within(6.01)
        .shorten(&mut logits)
        .expect_err("too little time");
    assert!(matches!(error, ScanBudgetError::TooFast { reached, .. } if reached > 6.01));
}

#[test]
fn trained_recipes_of_all_models_keep_their_budget() {
    for (model, missing) in [
        (ModelKind::Linear, 0.0),
        (ModelKind::Phong, 0.5),
        (ModelKind::CookTorrance, 0.0),
        (ModelKind::Neural, 0.5),
    ] {
        let options = TrainingOptions {
            missing: Some(missing),
            limits: LimitArgs {
                max_theta_i: Some(80.0),
                ..LimitArgs::default()
            },
            scan_seconds: Some(9.0),
            speeds: SpeedArgs {
                speed: Some(Arms::from_array(SPEEDS)),
                settle: Some(0.5),
            },
            ..TrainingOptions::new(model, 5, Schedule::Prior, Effort::Brief, 2)
        };
        let learned = train(&options, "procedural", procedural(10, 3), None, &mut |_| {
            ControlFlow::Continue(())
        });
        let learned = learned.expect("training succeeds");
        let file = &learned.file;
        let recipe: Recipe<'_> = file.recipe();
        let machine = file.metadata().machine();
        assert_eq!(file.metadata().options(), Some(&options));
        assert!(recipe.is_in_path_order());
        assert_eq!(machine, options.machine());
        assert_eq!(machine.speeds, Arms::from_array(SPEEDS));
        assert_eq!(machine.limits.max_theta_i, 80_f32.to_radians());
        let stops = stops(&recipe, &machine.limits).expect("samples within reach");
        // The recipe's own order is within the budget, not only the planned one.
        let [own, planned] = [Order::Progressive, Order::Travel]
            .map(|order| Route::new(&machine, &stops, order, 0).total());
        assert!(own <= 9.0 + 1e-6, "{model}: {own}");
        assert!(
            planned <= own + 1e-9 && planned > 6.0,
            "{model}: {planned} and {own}"
        );
        assert_eq!(
            learned
                .loss_predictor
                .expect("a predictor")
                .partial
                .is_some(),
            missing > 0.0
        );
    }
}
