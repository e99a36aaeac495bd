//! Calibration recovers the BRDF from the counts of a simulated sensor.

use std::f32::consts::PI;

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::geometry::Directions;
use glimpse_core::gonio::{Calibration, Footprint, Quantity, Reading};
use proptest::prelude::*;

use super::{at, close};

const DARK: [f32; 3] = [96.0, 101.0, 99.5];
const GAIN: [f32; 3] = [9000.0, 11_000.0, 7000.0];
const WHITE: [f32; 3] = [0.99, 0.985, 0.97];

/// The counts of a sensor for the BRDF `brdf`.
fn counts(brdf: [f32; 3], at: &Directions<f32>, footprint: Footprint) -> [f32; 3] {
    let cosine = match footprint {
        Footprint::LightLarger => at.incoming[2],
        Footprint::SensorLarger => at.outgoing[2],
        footprint => panic!("{footprint:?}"),
    };
    std::array::from_fn(|c| DARK[c] + GAIN[c] * brdf[c] * cosine)
}

fn calibration(at: &Directions<f32>, footprint: Footprint) -> Calibration {
    let white = counts(WHITE.map(|r| r / PI), at, footprint);
    Calibration::new(DARK, white, WHITE).expect("a white brighter than dark")
}

proptest! {
    #[test]
    fn converts_counts_to_brdf(
        theta_i in 0.0..75f32, theta_o in 0.0..75f32, phi in 0.0..180f32,
        // Noise may be negative.
        r in -0.1..2f32, g in -0.1..2f32, b in -0.1..2f32, light in any::<bool>(),
    ) {
        let footprint = if light { Footprint::LightLarger } else { Footprint::SensorLarger };
        let directions = at([theta_i, 0.0, theta_o, phi]);
        let read = counts([r, g, b], &directions, footprint);
        // Cosines cancel for both footprints.
        let same_directions = calibration(&directions, footprint).reading(read).expect("finite");
        let reference = at([0.0, 0.0, 45.0, 0.0]);
        let from_reference = calibration(&reference, footprint).read_once_at(&reference, footprint).expect("above the horizon");
        let from_reference = from_reference.reading(read, &directions).expect("finite");
        for actual in [same_directions, from_reference] {
            prop_assert!(!actual.saturated);
            for (actual, expected) in actual.brdf.into_iter().zip([r, g, b]) {
                // Counts of several thousand have a rounding error of about 1e-3.
                prop_assert!((actual - expected).abs() < 5e-6 * (1.0 + expected) / directions.incoming[2].min(directions.outgoing[2]));
            }
        }
    }

    #[test]
    fn quantity_round_trip(theta_i in 0.0..85f32, theta_o in 0.0..85f32, f in 0.0..10f32) {
        let directions = at([theta_i, 0.0, theta_o, 50.0]);
        let expected = [
            (Quantity::Brdf, f),
            (Quantity::BrdfTimesCosThetaI, f * directions.incoming[2]),
            (Quantity::BrdfTimesCosThetaO, f * directions.outgoing[2]),
            (Quantity::ReflectanceFactor, f * PI),
        ];
        for (quantity, expected) in expected {
            let [value, ..] = quantity.of_brdf([f; 3], &directions).expect("above the horizon");
            prop_assert!(close(value, expected), "{quantity}");
            let [back, ..] = quantity.to_brdf([value; 3], &directions).expect("above the horizon");
            prop_assert!(close(back, f), "{quantity}");
        }
    }
}

#[test]
fn flags_saturation_in_any_channel() {
    let directions = at([0.0, 0.0, 30.0, 90.0]);
    let calibration = calibration(&directions, Footprint::LightLarger);
    let is_saturated =
        |calibration: &Calibration, read| calibration.reading(read).expect("finite").saturated;
    let saturating = calibration
        .saturating_at(4095.0)
        .expect("the white reading is not saturated");
    for channel in 0..3 {
        for (count, saturated) in [(4094.9, false), (4095.0, true), (4096.0, true)] {
            let mut read = [1000.0; 3];
            read[channel] = count;
            assert_eq!(is_saturated(&saturating, read), saturated, "{count}");
            assert!(!is_saturated(&calibration, read), "without a level");
        }
    }
    let from_reference = saturating.read_once_at(&directions, Footprint::LightLarger);
    let from_reference = from_reference
        .expect("above the horizon")
        .reading([4095.0; 3], &directions);
    assert!(from_reference.expect("finite").saturated);
}

#[test]
fn monochrome_fills_all_channels() {
    let calibration = Calibration::monochrome(100.0, 1100.0, 0.5).expect("valid");
    let actual = calibration.reading([600.0; 3]).expect("finite");
    assert_eq!(actual, Reading::monochrome(actual.brdf[0]));
    assert!(close(actual.brdf[0], 0.25 / PI));
}

#[test]
fn errors_name_the_channel() {
    for channel in 0..3_u32 {
        let with = |mut values: [f32; 3], value| {
            values[channel as usize] = value;
            values
        };
        let white = [3000.0; 3];
        let new =
            |dark, white, reflectance| Calibration::new(dark, white, reflectance).unwrap_err();
        for broken in [f32::NAN, f32::INFINITY] {
            let error = Error::with(ErrorCode::ChannelNonFinite, [channel, 0]);
            assert_eq!(new(with(DARK, broken), white, WHITE), error);
            assert_eq!(new(DARK, with(white, broken), WHITE), error);
            let valid = Calibration::new(DARK, white, WHITE).expect("valid");
            assert_eq!(valid.reading(with(white, broken)), Err(error));
        }
        let error = Error::with(ErrorCode::WhiteNotBrighter, [channel, 0]);
        assert_eq!(new(with(DARK, 3000.0), white, WHITE), error);
        assert_eq!(new(DARK, with(white, 10.0), WHITE), error);
        for broken in [f32::NAN, 0.0, -0.5, 99.0, f32::INFINITY] {
            let error = Error::with(ErrorCode::WhiteReflectance, [channel, 0]);
            assert_eq!(new(DARK, white, with(WHITE, broken)), error);
        }
        let valid = Calibration::new(DARK, with(white, 3500.0), WHITE).expect("valid");
        let error = Err(Error::with(ErrorCode::WhiteSaturated, [channel, 0]));
        assert_eq!(valid.saturating_at(3500.0), error);
        assert!(valid.saturating_at(3501.0).is_ok());
        assert!(valid.saturating_at(f32::NAN).is_err());
    }
    // A quotient that overflows is not a BRDF.
    let dim = Calibration::monochrome(0.0, 1e-30, 1.0).expect("valid");
    let error = Err(Error::with(ErrorCode::ChannelNonFinite, [0, 0]));
    assert_eq!(dim.reading([1e30; 3]), error);
}

#[test]
fn errors_name_the_arm_below_horizon() {
    let above = at([0.0, 0.0, 45.0, 0.0]);
    let below = |z| Directions {
        incoming: [0.6, 0.0, z],
        outgoing: [0.6, 0.0, z],
    };
    let valid = Calibration::monochrome(0.0, 1.0, 1.0).expect("valid");
    for (footprint, arm) in [(Footprint::LightLarger, 0), (Footprint::SensorLarger, 1)] {
        let from_reference = valid
            .read_once_at(&above, footprint)
            .expect("above the horizon");
        for z in [0.0, -0.8, f32::NAN, f32::INFINITY] {
            let error = Error::with(ErrorCode::Directions, [arm, 0]);
            assert_eq!(valid.read_once_at(&below(z), footprint), Err(error));
            assert_eq!(from_reference.reading([1.0; 3], &below(z)), Err(error));
        }
    }
    for (quantity, arm) in [
        (Quantity::BrdfTimesCosThetaI, 0),
        (Quantity::BrdfTimesCosThetaO, 1),
    ] {
        let error = Err(Error::with(ErrorCode::Directions, [arm, 0]));
        assert_eq!(quantity.to_brdf([1.0; 3], &below(-0.8)), error);
        assert_eq!(quantity.of_brdf([1.0; 3], &below(0.0)), error);
    }
}
