//! Invalid pairs of directions, and the rule at the pole.

use std::f32::consts::PI;

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::geometry::{Arms, Directions, HalfDifference};

const UP: [f32; 3] = [0.0, 0.0, 1.0];

/// Pairs with the same fault in either direction, and errors that name the arm: 0 for light, 1 for sensor.
fn in_either_direction(broken: [f32; 3]) -> [(Error, Directions<f32>); 2] {
    let error = |arm| Error::with(ErrorCode::Directions, [arm, 0]);
    let pair = |incoming, outgoing| Directions { incoming, outgoing };
    [(error(0), pair(broken, UP)), (error(1), pair(UP, broken))]
}

#[test]
fn rejects_pairs_without_half_vector() {
    for (incoming, outgoing, is_rejected) in [
        (UP, UP, false),
        ([1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], true),
        // Opposite, but of different lengths.
        ([1.0, 0.0, 0.0], [-0.9991, 0.0, 0.0], true),
        ([0.6, 0.0, 0.8], [-0.6, 0.0, -0.8], true),
        ([1.0, 0.0, 0.0], [-1.0, 0.0, 1e-3], false),
    ] {
        let pair = Directions { incoming, outgoing };
        let actual = HalfDifference::from_directions(&pair);
        assert_eq!(actual.is_none(), is_rejected, "{pair:?}");
    }
}

/// An earlier version returned a BRDF of 1e19 for vectors of other lengths.
#[test]
fn rejects_non_unit_vectors() {
    let mut broken = Vec::new();
    for number in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        broken.extend([[number, 0.0, 1.0], [0.0, number, 1.0], [0.0, 0.0, number]]);
    }
    for length in [0.0, 1e-30, 0.5, 0.9989, 1.0011, 2.0, 1e10, 1e19, f32::MAX] {
        let directions = [UP, [0.6, 0.0, 0.8], [0.48, -0.64, 0.6]];
        broken.extend(directions.map(|direction| direction.map(|x| x * length)));
    }
    for (error, pair) in broken.into_iter().flat_map(in_either_direction) {
        assert!(HalfDifference::from_directions(&pair).is_none(), "{pair:?}");
        assert_eq!(pair.check(), Err(error));
    }
    for length in [0.9991, 1.0, 1.0009] {
        for (_, pair) in in_either_direction([0.48, -0.64, 0.6].map(|x| x * length)) {
            assert_eq!(pair.check(), Ok(()));
            let at = HalfDifference::from_directions(&pair).expect("a half vector");
            // Half and difference vectors still have unit length.
            let half = at.hx.hypot(at.hz);
            let difference = at.dx.hypot(at.dy).hypot(at.dz);
            let is_valid = (half - 1.0).abs() < 5e-6 && (difference - 1.0).abs() < 5e-6;
            assert!(is_valid, "{at:?}");
        }
    }
}

#[test]
fn rejects_directions_at_or_below_horizon() {
    for low in [[1.0, 0.0, 0.0], [1.0, 0.0, -0.0], [0.6, 0.0, -0.8]] {
        for (error, pair) in in_either_direction(low) {
            assert_eq!(pair.check(), Err(error));
            // The pair has a half vector, and its cosines show the fault.
            let at = HalfDifference::from_directions(&pair).expect("a half vector");
            assert!(at.cos_theta_i().min(at.cos_theta_o()) < 1e-6);
        }
    }
}

/// Arms that are off by 0.01 degrees still yield the half vector of a mirror pair, at any azimuth.
#[test]
fn arm_errors_keep_half_vector_at_pole() {
    let theta = 30_f32.to_radians();
    for turn in (0..360).map(|degrees| (degrees as f32).to_radians()) {
        let error = turn.sin() * 1e-4;
        let near = [theta + error, turn, theta - error, PI + error + turn];
        let directions = Arms::from_array(near).directions();
        let at = HalfDifference::from_directions(&directions).expect("a half vector");
        assert_eq!((at.hx, at.dy), (0.0, 0.0));
        assert!((at.dz - theta.cos()).abs() < 1e-4);
    }
}

/// Near grazing angles, the half vector may be the normal within rounding although a direction is below the horizon.
/// The pole's rule must not move it above.
#[test]
fn pole_rule_excludes_pairs_below_horizon() {
    let pair = Directions {
        incoming: [1.0, 0.0, -1e-4],
        outgoing: [-1.0, 0.0, 3e-4],
    };
    let at = HalfDifference::from_directions(&pair).expect("a half vector");
    assert!(!at.is_valid(), "{at:?}");
}
