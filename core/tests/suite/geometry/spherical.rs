//! Conversions between arms and directions; angles between directions.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glimpse_core::geometry::{ArmAngles, Directions, HalfDifference, Spherical};
use proptest::prelude::*;

/// The rounding of three products, or the error of micromath's square root.
const ROUNDING: f64 = by_math!(8e-7, 4e-6);

/// The largest difference between the lengths of two directions.
const LENGTHS: f64 = by_math!(2.4e-7, 2e-6);

fn arm(theta: f64, phi: f64) -> Spherical {
    Spherical {
        theta: theta as f32,
        phi: phi as f32,
    }
}

prop_compose! {
    fn arms()(theta_i in 0.0..FRAC_PI_2, phi_i in -PI..PI, theta_o in 0.0..FRAC_PI_2, phi_o in -PI..PI)
        -> ArmAngles {
        ArmAngles { incoming: arm(theta_i, phi_i), outgoing: arm(theta_o, phi_o) }
    }
}

/// The unit vector in f64 of the angles in f32.
fn exact(arm: Spherical) -> [f64; 3] {
    let (theta, phi) = (f64::from(arm.theta), f64::from(arm.phi));
    [
        theta.sin() * phi.cos(),
        theta.sin() * phi.sin(),
        theta.cos(),
    ]
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
        for (actual, arm) in [(directions.incoming, arms.incoming), (directions.outgoing, arms.outgoing)] {
            for (actual, expected) in actual.into_iter().zip(exact(arm)) {
                prop_assert!((f64::from(actual) - expected).abs() < 3e-7);
            }
            let back = Spherical::from_direction(actual);
            prop_assert!(f64::from((back.theta - arm.theta).abs()) < ROUNDING);
            // The error of the azimuth is inversely proportional to the sine of theta.
            let scaled_error = angle_error(back.phi.into(), arm.phi.into()) * f64::from(arm.theta.sin());
            prop_assert!(scaled_error < ROUNDING, "{arm:?} {back:?}");
        }
        if arms.incoming.theta.max(arms.outgoing.theta) < 1.57 {
            prop_assert_eq!(directions.check(), Ok(()));
        }
    }

    #[test]
    fn negative_theta_equals_opposite_azimuth(theta in 0.0..FRAC_PI_2, phi in -PI..PI) {
        let here = arm(-theta, phi).direction();
        let there = arm(theta, phi + PI).direction();
        for (a, b) in here.into_iter().zip(there) {
            prop_assert!((a - b).abs() < 5e-7);
        }
    }

    #[test]
    fn separation_is_twice_theta_d(arms in arms()) {
        let directions = arms.directions();
        let separation = f64::from(directions.separation());
        prop_assert!((separation - angle(exact(arms.incoming), exact(arms.outgoing))).abs() < ROUNDING);
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
        let by = by.exp();
        let near = ArmAngles { incoming: arm(theta, phi), outgoing: arm(theta + by, phi) };
        let expected = f64::from(near.outgoing.theta) - f64::from(near.incoming.theta);
        prop_assert!((f64::from(near.directions().separation()) - expected).abs() < 5e-7);
    }

    #[test]
    fn out_of_plane_is_angle_of_nearer_direction(arms in arms()) {
        let ArmAngles { incoming, outgoing } = arms;
        let nearer = f64::from(incoming.theta.min(outgoing.theta)).sin();
        let turn = f64::from(incoming.phi) - f64::from(outgoing.phi);
        let sin = nearer * turn.sin().abs();
        // Near a right angle, the error of the arc sine is the square root of rounding.
        let tolerance = ROUNDING / (1.0 - sin * sin).sqrt().max(1e-3);
        let actual = f64::from(arms.directions().out_of_plane());
        prop_assert!((actual - sin.asin()).abs() < 2.0 * tolerance, "{actual} {}", sin.asin());
    }
}

#[test]
fn azimuth_along_normal_is_0() {
    let up = Spherical::from_direction([0.0, 0.0, 1.0]);
    assert_eq!(up, Spherical::default());
    assert_eq!(Spherical::from_direction([-0.0, 0.0, 1.0]), up);
    let both = ArmAngles::default().directions();
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
    assert!(Spherical::from_direction(broken.incoming).theta.is_nan());
}
