//! Broken sensors: the fit has a result, but is implausible.

use glimpse_core::error::ErrorCode;
use glimpse_core::geometry::Directions;
use glimpse_core::gonio::Reading;

use super::SCAN_RECIPES;
use crate::recipes::parsed;
use crate::scanning::{fit, full_scan, new_scan, record};

/// Readings of a matt material by a noisy sensor.
fn matt(index: u16) -> [f32; 3] {
    let k = f32::from(index);
    [0.21, 0.13, 0.08].map(|f| f * (1.0 + 0.002 * k))
}

/// The reason why a fit of readings with a trained recipe is implausible, if it is.
fn implausible_reason(recipe: &[u8], reading: impl Fn(u16) -> Reading) -> Option<ErrorCode> {
    full_scan(parsed(recipe.to_vec()), reading)
        .residual()
        .implausible
}

/// [`matt`] with a channel that reads 0.
fn with_dead(index: u16, channel: usize) -> [f32; 3] {
    let mut brdf = matt(index);
    brdf[channel] = 0.0;
    brdf
}

/// A noisy sensor is plausible. Counts of 8 bits, divided by 255 instead of by the count of the white reference, are near
/// the full scale.
#[test]
fn implausible_readings_have_reason() {
    type Sensor = fn(u16) -> [f32; 3];
    let cases: [(Sensor, Option<ErrorCode>); 8] = [
        (matt, None),
        (|index| [matt(index)[0]; 3], None),
        (|_| [-0.9; 3], Some(ErrorCode::Dark)),
        (|_| [0.2, 0.1, 0.05], Some(ErrorCode::Repeated)),
        (|index| with_dead(index, 0), Some(ErrorCode::DeadRed)),
        (|index| with_dead(index, 1), Some(ErrorCode::DeadGreen)),
        (|index| with_dead(index, 2), Some(ErrorCode::DeadBlue)),
        (
            |index| matt(index).map(|f| (200.0 + 220.0 * f).round() / 255.0),
            Some(ErrorCode::Albedo),
        ),
    ];
    for (sensor, expected) in cases {
        for recipe in SCAN_RECIPES {
            let reason = implausible_reason(recipe, |index| Reading::new(sensor(index)));
            assert_eq!(reason, expected);
        }
    }
}

/// Readings too far below 0 are clamped for the fit; repeated readings are counted before that.
#[test]
fn repeated_readings_are_counted_before_clamping() {
    let recipe = parsed(SCAN_RECIPES[1].to_vec());
    // A descent clamps readings below -0.5 / cos(theta_i).
    let is_clamped = |directions: &Directions<f32>| directions.incoming[2] > 0.5 / 0.9;
    let clamped = recipe.directions().filter(|(_, at)| is_clamped(at)).count() as u16;
    assert!(clamped > 0);
    let mut scan = new_scan(recipe);
    record(&mut scan, 0..8, |_| Reading::monochrome(-0.9));
    for _ in 0..2 {
        let residual = fit(&mut scan, &[64]).residual();
        assert_eq!((residual.repeated, residual.clamped), (7, clamped));
    }
}

/// Readings that belong to other directions: no fit explains them.
#[test]
fn unexplained_readings_are_implausible() {
    let bytes = include_bytes!("../../../../trainer/recipes/completed/neural-n16.recipe");
    let inconsistent =
        |index: u16| Reading::monochrome([0.002, 3.0, 2.0, 0.01][usize::from(index % 4)]);
    let expected = Some(ErrorCode::Residual);
    assert_eq!(implausible_reason(bytes, inconsistent), expected);
}
