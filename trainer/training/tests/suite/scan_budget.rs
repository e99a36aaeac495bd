//! Tests of the budget for the time of a scan: the gradient of a path's time, and trained patterns within a budget.

use std::f64::consts::PI;
use std::ops::ControlFlow;

use glimpse_core::geometry::Angles;
use glimpse_core::gonio::Limits;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;
use glimpse_training::meta::options::{Effort, OptionsError, Schedule, TrainingOptions};
use glimpse_training::meta::pattern::{Pattern, logits_from_reachable};
use glimpse_training::meta::run::{TrainError, train};
use glimpse_training::meta::scan_budget::{Motion, ScanBudgetError};
use glimpse_training::recipe::pack_recipe;
use glimpse_training::route::{Axes, LimitArgs, Machine, Order, Route, SpeedArgs, stops};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::support::procedural;

const SPEEDS: [f64; 4] = [10.0, 15.0, 8.0, 12.0];
/// The number of samples of a path.
const SAMPLES: usize = 6;

fn motion(seconds: f64, settle: f64, limits: Limits, samples: usize) -> Motion {
    let machine = Machine {
        speeds: Axes::from_array(SPEEDS),
        settle,
        limits,
        ..Machine::default()
    };
    Motion::new(seconds, machine, samples)
}

fn random_angles(random: &mut ChaCha8Rng) -> Vec<Angles<f32>> {
    let mut draw = || Angles {
        theta_h: random.random_range(0.05..0.6_f32),
        theta_d: random.random_range(0.1..0.8_f32),
        phi_d: random.random_range(0.1..3.0_f32),
    };
    (0..SAMPLES).map(|_| draw()).collect()
}

/// Returns the position of the arms in degrees, by rotations of the light's direction and of its mirror image: theta_i,
/// theta_o, and the difference of the azimuths.
fn arms([theta_h, theta_d, phi_d]: [f64; 3]) -> [f64; 3] {
    let turned = |phi: f64| {
        let (sin_d, cos_d) = theta_d.sin_cos();
        let [x, y, z] = [sin_d * phi.cos(), sin_d * phi.sin(), cos_d];
        let (sin_h, cos_h) = theta_h.sin_cos();
        [x * cos_h + z * sin_h, y, z * cos_h - x * sin_h]
    };
    let [[ix, iy, iz], [ox, oy, oz]] = [turned(phi_d), turned(phi_d + PI)];
    [
        iz.acos(),
        oz.acos(),
        (ix * oy - iy * ox).atan2(ix * ox + iy * oy),
    ]
    .map(f64::to_degrees)
}

/// Returns the durations of the three axes' moves along a path.
fn moves(path: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let [theta_i, phi_i, theta_o, phi_o] = SPEEDS;
    let mut position = [0.0, 0.0, 180.0];
    let mut moves = Vec::new();
    for angles in path {
        let next = arms(*angles);
        let turn = (next[2] - position[2]).rem_euclid(360.0);
        moves.push([
            (next[0] - position[0]).abs() / theta_i,
            (next[1] - position[1]).abs() / theta_o,
            turn.min(360.0 - turn) / (phi_i + phi_o),
        ]);
        position = next;
    }
    moves
}

fn seconds(path: &[[f64; 3]]) -> f64 {
    let moves = moves(path);
    moves
        .iter()
        .map(|[one, two, three]| one.max(*two).max(*three))
        .sum()
}

/// Calls a function with random paths on which no two axes of a move take almost the same time.
fn for_each_path(mut function: impl FnMut(&[Angles<f32>], &[[f64; 3]])) {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut paths = 0;
    while paths < 20 {
        let angles = random_angles(&mut random);
        let path: Vec<[f64; 3]> = angles
            .iter()
            .map(|each| [each.theta_h, each.theta_d, each.phi_d].map(f64::from))
            .collect();
        let is_smooth = moves(&path).iter().all(|durations| {
            let mut sorted = *durations;
            sorted.sort_by(f64::total_cmp);
            sorted[2] - sorted[1] > 1e-3 && sorted[2] > 1e-3
        });
        if is_smooth {
            function(&angles, &path);
            paths += 1;
        }
    }
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
    for_each_path(|angles, path| {
        let logits: Vec<f32> = angles
            .iter()
            .flat_map(|angles| logits_from_reachable(*angles, &limits))
            .collect();
        let motion = motion(seconds(path), 0.0, limits, SAMPLES);
        assert!((motion.path(angles).seconds - seconds(path)).abs() < 1e-9);
        let mut weight = 0.5;
        let gradient = motion.weighted_gradient(&logits, 1.0, &mut weight);
        // The aim is slightly below the budget, so the weight rises.
        assert!((0.5..0.52).contains(&weight), "{weight}");
        let seconds_after = |index: usize, by: f32| {
            let mut moved = logits.clone();
            moved[index] += by;
            let pattern = Pattern::from_logits_within(&moved, limits);
            motion.path(pattern.angles()).seconds
        };
        let slopes: Vec<f64> = (0..logits.len())
            .map(|index| (seconds_after(index, 1e-3) - seconds_after(index, -1e-3)) / 2e-3)
            .collect();
        let norm = |list: &[f64]| list.iter().map(|x| x * x).sum::<f64>().sqrt();
        let gradient: Vec<f64> = gradient.into_iter().map(f64::from).collect();
        let products = gradient.iter().zip(&slopes).map(|(one, other)| one * other);
        let cosine = products.sum::<f64>() / (norm(&gradient) * norm(&slopes));
        assert!(cosine > 0.999, "{gradient:?} {slopes:?}");
        let ratio = norm(&gradient) / norm(&slopes);
        assert!((0.48..0.55).contains(&ratio), "{ratio}");
    });
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
    let within = |seconds| motion(seconds, 0.5, limits, 12);
    let motion = within(12.0);
    let mut logits: Vec<f32> = (0..36).map(|_| random.random_range(-2.0..2.0)).collect();
    let path = |logits: &[f32]| {
        let angles = glimpse_training::meta::pattern::reachable_angles(logits, &limits);
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

fn options(model: ModelKind, samples: usize, scan_seconds: f64) -> TrainingOptions {
    TrainingOptions {
        scan_seconds: Some(scan_seconds),
        speeds: SpeedArgs {
            speed: Some(Axes::from_array(SPEEDS)),
            settle: Some(0.5),
        },
        ..TrainingOptions::new(model, samples, Schedule::Prior, Effort::Brief, 2)
    }
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
            ..options(model, 5, 9.0)
        };
        let learned = train(&options, procedural(10, 3), None, &mut |_| {
            ControlFlow::Continue(())
        });
        let learned = learned.expect("training succeeds");
        let file = pack_recipe(&learned, &options, "procedural").expect("a recipe");
        let recipe: Recipe<'_> = file.recipe();
        let machine = file.metadata().machine();
        assert_eq!(file.metadata().options(), Some(&options));
        assert!(recipe.is_in_path_order());
        assert_eq!(machine, options.machine());
        assert_eq!(machine.speeds, Axes::from_array(SPEEDS));
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

#[test]
fn impossible_budgets_are_refused() {
    let error = |options: &TrainingOptions| {
        let result = train(options, procedural(2, 3), None, &mut |_| {
            ControlFlow::Continue(())
        });
        result.expect_err("a budget that no pattern keeps")
    };
    let linear = |seconds| options(ModelKind::Linear, 8, seconds);
    assert!(matches!(
        error(&linear(4.0)),
        TrainError::ScanBudget(ScanBudgetError::NoMotion { samples: 8, .. })
    ));
    for seconds in [-1.0, f64::NAN] {
        let error = error(&linear(seconds));
        assert!(
            matches!(error, TrainError::Options(OptionsError::Range { .. })),
            "{error}"
        );
    }
    let mut slow = linear(10.0);
    slow.speeds.speed = Some(Axes::from_array([0.0; 4]));
    let error = error(&slow);
    assert!(
        matches!(error, TrainError::Options(OptionsError::Machine(_))),
        "{error}"
    );
}
