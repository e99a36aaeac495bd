//! Tests of the optimizer's steps and order.

use glimpse_optimizer::{Groups, Optimizer};

fn groups(value: f32) -> Groups<Vec<f32>> {
    Groups {
        initial: vec![value; 5],
        hyperparameters: vec![2.0 * value; 5],
        pattern: vec![-value; 3],
        coefficient_net: vec![0.5 * value; 4],
        start_net: Vec::new(),
    }
}

const RATES: Groups<f64> = Groups {
    initial: 1e-2,
    hyperparameters: 1e-3,
    pattern: 0.0,
    coefficient_net: 2e-3,
    start_net: 1e-3,
};

#[test]
fn step_changes_groups_with_a_rate() {
    let mut optimizer = Optimizer::new(groups(0.3));
    optimizer.step(groups(0.7), &RATES);
    assert!(optimizer.is_valid());
    assert_eq!(optimizer.values.pattern, groups(0.3).pattern);
    // The first step of Adam is the rate, against the gradient's sign.
    for value in optimizer.values.initial {
        assert!((value - 0.29).abs() < 1e-6, "{value}");
    }
}

#[test]
fn rearranged_optimizer_steps_like_rearranged_original() {
    let reversed =
        |groups: Groups<Vec<f32>>| groups.map(|list| list.iter().rev().copied().collect());
    let ramp =
        |scale: f32| groups(1.0).map(|list| (0..list.len()).map(|i| scale * i as f32).collect());
    let mut original = Optimizer::new(ramp(0.1));
    original.step(ramp(0.7), &RATES);
    let mut rearranged = Optimizer::new(ramp(0.1));
    rearranged.step(ramp(0.7), &RATES);
    rearranged.rearrange(reversed);
    assert_eq!(rearranged.values, reversed(original.values.clone()));
    assert_ne!(rearranged.values, original.values);
    original.step(ramp(-0.3), &RATES);
    rearranged.step(reversed(ramp(-0.3)), &RATES);
    assert_eq!(rearranged.values, reversed(original.values.clone()));
}
