//! Repeated readings, compared with the two-pass formulas in f64.

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::gonio::Repeated;
use proptest::prelude::*;

#[test]
fn first_readings() {
    let mut repeated = Repeated::default();
    assert_eq!((repeated.mean(), repeated.variance()), (None, None));
    assert_eq!((repeated.count, repeated.saturated), (0, false));
    repeated.add([1.0, -2.0, 3.0], false).expect("finite");
    assert_eq!(repeated.mean(), Some([1.0, -2.0, 3.0]));
    assert_eq!(repeated.variance(), None);
    // One saturated reading marks the mean.
    for (saturated, count) in [(true, 2), (false, 3)] {
        repeated.add([2.0; 3], saturated).expect("finite");
        assert_eq!((repeated.count, repeated.saturated), (count, true));
    }
}

#[test]
fn rejects_non_finite_readings() {
    let mut repeated = Repeated::default();
    repeated.add([1.0, 2.0, 3.0], false).expect("finite");
    let before = repeated;
    for (channel, broken) in (0..3_u32).zip([f32::NAN, f32::INFINITY, f32::NEG_INFINITY]) {
        let mut reading = [1.0; 3];
        reading[channel as usize] = broken;
        let error = Error::with(ErrorCode::ChannelNonFinite, [channel, 0]);
        assert_eq!(repeated.add(reading, true), Err(error));
        assert_eq!(repeated, before);
    }
    // The square overflows.
    let error = repeated.add([1.0, 1.0, f32::MAX], false);
    assert_eq!(error, Err(Error::with(ErrorCode::ChannelNonFinite, [2, 0])));
    assert_eq!(repeated, before);
}

proptest! {
    #[test]
    fn matches_two_pass_formulas(
        offset in -1e4..1e4f32,
        readings in prop::collection::vec(prop::array::uniform3(-100.0..100f32), 2..200),
    ) {
        let mut repeated = Repeated::default();
        let readings: Vec<_> = readings.iter().map(|r| r.map(|value| value + offset)).collect();
        for reading in &readings {
            repeated.add(*reading, false).expect("finite");
        }
        let count = readings.len() as f64;
        let (means, variances) = (repeated.mean, repeated.variance().expect("at least two readings"));
        for channel in 0..3 {
            let values = || readings.iter().map(|r| f64::from(r[channel]));
            let mean = values().sum::<f64>() / count;
            let variance = values().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
            let scale = f64::from(offset.abs()) + 100.0;
            prop_assert!((f64::from(means[channel]) - mean).abs() < 1e-6 * scale);
            // A naive sum of squares would lose all digits at an offset of 1e4.
            let error = (f64::from(variances[channel]) - variance).abs();
            prop_assert!(error < 1e-5 * variance + 1e-5 * scale * variance.sqrt(), "{error} of {variance}");
        }
    }
}
