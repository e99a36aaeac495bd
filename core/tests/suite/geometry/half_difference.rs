//! Angles, half and difference vectors and directions, compared with independent trigonometry.

use std::f64::consts::{FRAC_PI_2, TAU};

use glimpse_core::geometry::{Angles, Directions, HalfDifference};
use proptest::prelude::*;

type Vector = [f64; 3];

/// Several rounding errors of numbers up to 2 pi.
const EXACT: f64 = 3e-15;

/// Angles in range. One direction may be below the horizon.
fn angles() -> impl Strategy<Value = Angles<f64>> {
    (0.0..FRAC_PI_2, 0.0..FRAC_PI_2, 0.0..TAU)
        .prop_map(|(theta_h, theta_d, phi_d)| Angles::from_array([theta_h, theta_d, phi_d]))
}

fn dot(a: Vector, b: Vector) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn about_y(v: Vector, angle: f64) -> Vector {
    let (sin, cos) = angle.sin_cos();
    [cos * v[0] + sin * v[2], v[1], cos * v[2] - sin * v[0]]
}

fn about_z(v: Vector, angle: f64) -> Vector {
    let (sin, cos) = angle.sin_cos();
    [cos * v[0] - sin * v[1], sin * v[0] + cos * v[1], v[2]]
}

/// w_i and w_o by Rusinkiewicz's definition: the difference vector turned by theta_h about y, and its mirror image
/// about the half vector.
fn directions(angles: Angles<f64>) -> [Vector; 2] {
    let [theta_h, theta_d, phi_d] = angles.to_array();
    let pole = [0.0, 0.0, 1.0];
    let half = about_y(pole, theta_h);
    let incoming = about_y(about_z(about_y(pole, theta_d), phi_d), theta_h);
    let twice = 2.0 * dot(half, incoming);
    [
        incoming,
        std::array::from_fn(|i| twice * half[i] - incoming[i]),
    ]
}

fn close(a: &[f64], b: &[f64], tolerance: f64) -> Result<(), TestCaseError> {
    for (x, y) in a.iter().zip(b) {
        prop_assert!((x - y).abs() <= tolerance, "{a:?} and {b:?}");
    }
    Ok(())
}

/// The largest error of half and difference vectors that are computed from f32 directions. It is inversely proportional
/// to cos(theta_d), half the length of the sum of both directions, and to sin(theta_h), because of the azimuth.
/// micromath adds the errors of three square roots.
fn rounding_error(at: &HalfDifference<f64>) -> f64 {
    let roots = by_math!(0.0, 5e-6);
    roots + 3e-7 / (at.dz * at.hx)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 10_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn directions_match_definition(angles in angles()) {
        let at = HalfDifference::from_angles(angles);
        let Angles { theta_h, theta_d, phi_d } = angles;
        let (dx, dy) = (theta_d.sin() * phi_d.cos(), theta_d.sin() * phi_d.sin());
        close(&at.to_array(), &[theta_h.sin(), theta_h.cos(), dx, dy, theta_d.cos()], EXACT)?;
        let actual = at.directions();
        let [incoming, outgoing] = directions(angles);
        close(&actual.incoming, &incoming, EXACT)?;
        close(&actual.outgoing, &outgoing, EXACT)?;
        close(&[at.cos_theta_i(), at.cos_theta_o()], &[incoming[2], outgoing[2]], EXACT)?;
        // Within rounding of the horizon, both results are correct.
        if incoming[2].abs() > 1e-6 && outgoing[2].abs() > 1e-6 {
            let rounded = HalfDifference::from_array(at.to_array().map(|value| value as f32));
            prop_assert_eq!(rounded.is_valid(), incoming[2] > 0.0 && outgoing[2] > 0.0);
        }
    }

    #[test]
    fn directions_round_trip(angles in angles(), azimuth in 0.0..TAU) {
        let at = HalfDifference::from_angles(angles);
        prop_assume!(at.hx * at.dz > 1e-3);
        // A rotation about the normal does not change half and difference vectors.
        let [incoming, outgoing] = directions(angles).map(|w| about_z(w, azimuth).map(|x| x as f32));
        let actual = HalfDifference::from_directions(&Directions { incoming, outgoing });
        let actual = actual.ok_or_else(|| TestCaseError::fail("no half vector"))?;
        close(&actual.to_array().map(f64::from), &at.to_array(), rounding_error(&at))?;
    }

    #[test]
    fn mirror_pair_has_phi_d_0(theta_d in 0.0..1.5f64, azimuth in 0.0..TAU) {
        let [x, y, z] = about_z(about_y([0.0, 0.0, 1.0], theta_d), azimuth).map(|x| x as f32);
        let pair = Directions { incoming: [x, y, z], outgoing: [-x, -y, z] };
        let actual = HalfDifference::from_directions(&pair);
        let actual = actual.ok_or_else(|| TestCaseError::fail("no half vector"))?;
        close(&actual.to_array().map(f64::from), &[0.0, 1.0, theta_d.sin(), 0.0, theta_d.cos()], 5e-6)?;
    }
}
