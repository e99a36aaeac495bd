//! Conversions between arms and directions; angles between directions.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glimpse_core::geometry::{Arms, Directions, HalfDifference};
use proptest::prelude::*;

/// The rounding of three products, or the error of micromath's square root.
const ROUNDING: f64 = by_math!(8e-7, 4e-6);

/// The largest difference between the lengths of two directions.
const LENGTHS: f64 = by_math!(2.4e-7, 2e-6);

prop_compose! {
    fn arms()(theta_i in 0.0..FRAC_PI_2, phi_i in -PI..PI, theta_o in 0.0..FRAC_PI_2, phi_o in -PI..PI) -> Arms {
        Arms::from_array([theta_i, phi_i, theta_o, phi_o].map(|angle| angle as f32))
    }
}

/// The unit vectors in f64 of the angles in f32.
fn exact(arms: Arms) -> [[f64; 3]; 2] {
    let [theta_i, phi_i, theta_o, phi_o] = arms.to_array().map(f64::from);
    [(theta_i, phi_i), (theta_o, phi_o)].map(|(theta, phi)| {
        let sin = theta.sin();
        [sin * phi.cos(), sin * phi.sin(), theta.cos()]
    })
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The angle between unit vectors in f64, by Kahan's formula.
fn angle(a: [f64; 3], b: [f64; 3]) -> f64 {
    let difference = std::array::from_fn(|i| a[i] - b[i]);
    let sum = std::array::from_fn(|i| a[i] + b[i]);
    2.0 * length(difference).atan2(length(sum))
}

fn angle_error(a: f64, b: f64) -> f64 {
    (a - b).rem_euclid(TAU).min((b - a).rem_euclid(TAU))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 10_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn angles_round_trip(arms in arms()) {
        let directions = arms.directions();
        let actual = [directions.incoming, directions.outgoing].concat();
        for (actual, expected) in actual.into_iter().zip(exact(arms).concat()) {
            prop_assert!((f64::from(actual) - expected).abs() < 3e-7);
        }
        let back = Arms::from_directions(&directions);
        for (theta, phi, back_theta, back_phi) in [
            (arms.theta_i, arms.phi_i, back.theta_i, back.phi_i),
            (arms.theta_o, arms.phi_o, back.theta_o, back.phi_o),
        ] {
            prop_assert!(f64::from((back_theta - theta).abs()) < ROUNDING);
            // The error of the azimuth is inversely proportional to the sine of theta.
            let scaled_error = angle_error(back_phi.into(), phi.into()) * f64::from(theta.sin());
            prop_assert!(scaled_error < ROUNDING, "{arms:?} {back:?}");
        }
        if arms.theta_i.max(arms.theta_o) < 1.57 {
            prop_assert_eq!(directions.check(), Ok(()));
        }
    }

    #[test]
    fn negative_theta_equals_opposite_azimuth(theta in 0.0..FRAC_PI_2, phi in -PI..PI) {
        let [theta, phi, opposite] = [theta, phi, phi + PI].map(|angle| angle as f32);
        let pair = Arms::from_array([-theta, phi, theta, opposite]).directions();
        for (a, b) in pair.incoming.into_iter().zip(pair.outgoing) {
            prop_assert!((a - b).abs() < 5e-7);
        }
    }

    #[test]
    fn separation_is_twice_theta_d(arms in arms()) {
        let directions = arms.directions();
        let separation = f64::from(directions.separation());
        let [incoming, outgoing] = exact(arms);
        prop_assert!((separation - angle(incoming, outgoing)).abs() < ROUNDING);
        let at = HalfDifference::from_directions(&directions)
            .ok_or_else(|| TestCaseError::fail("no half vector"))?;
        let theta_d = f64::from(at.dx.hypot(at.dy)).atan2(f64::from(at.dz));
        // For nearly opposite directions, the difference of their lengths determines the half vector.
        let tolerance = 4.0 * ROUNDING + LENGTHS / f64::from(at.dz);
        prop_assert!((separation - 2.0 * theta_d).abs() < tolerance, "{separation} {theta_d}");
    }

    /// An arc cosine of a dot product could not resolve angles below 3e-4.
    #[test]
    fn small_separations_are_accurate(theta in 0.0..1.4f64, phi in -PI..PI, by in -9.0..-2.0f64) {
        let near = Arms::from_array([theta, phi, theta + by.exp(), phi].map(|angle| angle as f32));
        let expected = f64::from(near.theta_o) - f64::from(near.theta_i);
        prop_assert!((f64::from(near.directions().separation()) - expected).abs() < 5e-7);
    }

    #[test]
    fn out_of_plane_is_angle_of_nearer_direction(arms in arms()) {
        let nearer = f64::from(arms.theta_i.min(arms.theta_o)).sin();
        let turn = f64::from(arms.phi_i) - f64::from(arms.phi_o);
        let sin = nearer * turn.sin().abs();
        // Near a right angle, the error of the arc sine is the square root of rounding.
        let tolerance = ROUNDING / (1.0 - sin * sin).sqrt().max(1e-3);
        let actual = f64::from(arms.directions().out_of_plane());
        prop_assert!((actual - sin.asin()).abs() < 2.0 * tolerance, "{actual} {}", sin.asin());
    }
}

#[test]
fn azimuth_along_normal_is_0() {
    let both = Directions {
        incoming: [0.0, 0.0, 1.0],
        outgoing: [-0.0, 0.0, 1.0],
    };
    assert_eq!(Arms::from_directions(&both), Arms::NORMAL);
    let both = Arms::NORMAL.directions();
    assert_eq!((both.separation(), both.out_of_plane()), (0.0, 0.0));
}

#[test]
fn non_finite_directions_give_nan() {
    let broken = Directions {
        incoming: [f32::NAN, 0.0, 1.0],
        outgoing: [0.6, 0.0, 0.8],
    };
    assert!(broken.separation().is_nan());
    assert!(broken.out_of_plane().is_nan());
    assert!(Arms::from_directions(&broken).theta_i.is_nan());
}
