//! Tests of the predicted losses.

use super::*;

/// Held-out losses of 400 materials that depend on their coefficients, and on noise of amplitude `noise`.
fn held_out(first: usize, noise: f32) -> Vec<HeldOutLoss> {
    let wave = |index: usize, frequency: f32| (frequency * index as f32).sin();
    (first..first + 400)
        .map(|index| {
            let coefficients = vec![wave(index, 0.7), wave(index, 1.3), wave(index, 2.9)];
            let log_loss = 0.8 * coefficients[0] - 0.3 * coefficients[2] - 4.0;
            HeldOutLoss {
                material: index,
                loss: (log_loss + noise * wave(index, 37.1)).exp(),
                coefficients,
                evidence: LossEvidence {
                    innovation: 0.1,
                    residual: 0.01,
                },
                origin: match index % 4 {
                    0 => HeldOutOrigin::Material,
                    _ => HeldOutOrigin::Rough,
                },
                fold: index / 4 % 4,
            }
        })
        .collect()
}

#[test]
fn predicts_loss_determined_by_coefficients() {
    let held_out = held_out(0, 0.0);
    let predictor = LossPredictor::new(&held_out, 4).expect("there are enough materials");
    for each in &held_out {
        let ratio = predictor.loss(each) / f64::from(each.loss);
        assert!((0.97..1.03).contains(&ratio), "{ratio}");
    }
    assert!(predictor.rank_correlation > Some(0.99), "{predictor:?}");
}

#[test]
fn mean_prediction_is_unbiased_with_noise() {
    let predictor = LossPredictor::new(&held_out(0, 0.6), 4).expect("there are enough materials");
    let (mut predicted, mut actual) = (0.0, 0.0);
    // Other materials of the same distribution.
    for each in held_out(400, 0.6) {
        predicted += predictor.loss(&each);
        actual += f64::from(each.loss);
    }
    assert!(
        (predicted / actual - 1.0).abs() < 0.1,
        "{predicted} and {actual}"
    );
    let rank = predictor.rank_correlation.expect("four folds");
    assert!((0.6..0.95).contains(&rank), "{rank}");
}

#[test]
fn rejects_missing_data_and_excessive_weights() {
    let mut tiny_features = held_out(0, 0.0);
    for each in &mut tiny_features {
        each.coefficients[0] *= 1e-6;
    }
    assert_eq!(
        LossPredictor::new(&tiny_features, 4),
        None,
        "weights exceed the range of recipes"
    );
    assert_eq!(LossPredictor::new(&[], 4), None);
}

/// The order of equal numbers in a list does not matter.
#[test]
fn equal_numbers_share_their_rank() {
    assert_eq!(ranks(&[3.0, 1.0, 2.0]), [2.0, 0.0, 1.0]);
    assert_eq!(ranks(&[2.0, 1.0, 2.0, 3.0]), [1.5, 0.0, 1.5, 3.0]);
    let losses = [1.0, 2.0, 3.0, 4.0];
    assert_eq!(rank_correlation(&[7.0; 4], &losses), None);
    let one = rank_correlation(&[1.0, 5.0, 5.0, 9.0], &losses);
    let other = rank_correlation(&[1.0, 5.0, 5.0, 9.0], &[1.0, 3.0, 2.0, 4.0]);
    assert_eq!(one, other);
}

/// Losses that are twice and 1.5 times as large after 1 and 3 of 4 readings.
#[test]
fn predicts_loss_of_scans_that_end_early() {
    let complete = held_out(0, 0.2);
    let scaled = |factor: f32| {
        let scaled = complete.iter().map(|each| HeldOutLoss {
            loss: factor * each.loss,
            ..each.clone()
        });
        scaled.collect::<Vec<_>>()
    };
    let predictor = LossPredictor::new(&complete, 4).expect("there are enough materials");
    let bound = predictor.bound;
    let partial = predictor
        .with_partial(&[(1, scaled(2.0)), (3, scaled(1.5))], 4)
        .partial
        .expect("the losses are known");
    let factors: Vec<f32> = partial.loss.iter().map(|loss| loss.exp()).collect();
    for (factor, expected) in factors.iter().zip([2.0, 3.0_f32.sqrt(), 1.5, 1.0]) {
        assert!((factor / expected - 1.0).abs() < 0.05, "{factors:?}");
    }
    assert!(partial.bound.iter().all(|each| (1.0..2.0).contains(each)));
    assert_eq!(partial.bound.last(), Some(&bound));
}
