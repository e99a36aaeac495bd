//! `Limits` reports the exceeded limit and the excess.

use std::f32::consts::{FRAC_PI_2, PI};

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::gonio::{Limits, Machine};
use proptest::prelude::*;

use super::{arms, at};

fn limits() -> Limits {
    Limits {
        max_theta_i: 60f32.to_radians(),
        max_theta_o: 75f32.to_radians(),
        min_separation: 12f32.to_radians(),
        in_plane: false,
    }
}

#[test]
fn reports_limit_and_excess() {
    let limits = limits();
    assert_eq!(limits.validate(), Ok(()));
    assert_eq!(limits.check(&at([59.0, 0.0, 74.0, 90.0])), Ok(()));
    let in_plane = Limits {
        in_plane: true,
        ..limits
    };
    let near = ErrorCode::MinSeparation;
    for (limits, angles, code, by) in [
        (limits, [62.0, 0.0, 0.0, 0.0], ErrorCode::MaxThetaI, 2.0),
        (limits, [0.0, 0.0, 75.5, 0.0], ErrorCode::MaxThetaO, 0.5),
        (limits, [40.0, 20.0, 30.0, 20.0], near, 2.0),
        (limits, [0.0, 0.0, 0.0, 0.0], near, 12.0),
        (in_plane, [10.0, 0.0, 40.0, 90.0], ErrorCode::InPlane, 10.0),
    ] {
        let error = limits.check(&at(angles)).unwrap_err();
        assert_eq!(error.code, code);
        let excess = f32::from_bits(error.details[0]).to_degrees();
        assert!((excess - by).abs() < 1e-3, "{error}");
    }
    for azimuth in [0.0, 180.0, 180.05, -179.95] {
        let actual = in_plane.check(&at([20.0, 30.0, 40.0, 30.0 + azimuth]));
        assert_eq!(actual, Ok(()));
    }
}

/// A pattern on a limit is accepted despite rounding.
#[test]
fn accepts_the_limit_itself() {
    let limits = limits();
    for azimuth in 0..360 {
        let azimuth = azimuth as f32;
        let pair = at([60.0, azimuth, 75.0, azimuth + 120.0]);
        assert_eq!(limits.check(&pair), Ok(()));
        assert_eq!(limits.check(&at([30.0, azimuth, 42.0, azimuth])), Ok(()));
    }
}

/// Axes that a machine lacks limit its reach.
#[test]
fn missing_axes_limit_reach() {
    let machine = |change: &dyn Fn(&mut Machine)| {
        let mut machine = Machine::new(limits());
        machine.fixed = arms([45.0, 0.0, 30.0, 90.0]);
        change(&mut machine);
        machine
    };
    let in_reach = at([45.0, 0.0, 30.0, 90.0]);
    let missing = Err(Error::new(ErrorCode::MissingAxis));
    for speed in [0.0, -1.0, f32::NAN] {
        let lacks_theta_i = machine(&|machine| machine.speeds.theta_i = speed);
        assert_eq!(lacks_theta_i.check(&in_reach), Ok(()));
        assert_eq!(lacks_theta_i.check(&at([44.0, 0.0, 30.0, 90.0])), missing);
        let lacks_azimuths = machine(&|machine| {
            (machine.speeds.phi_i, machine.speeds.phi_o) = (speed, speed);
        });
        assert_eq!(lacks_azimuths.check(&in_reach), Ok(()));
        // Only the difference of the azimuths matters.
        assert_eq!(lacks_azimuths.check(&at([20.0, 70.0, 60.0, 160.0])), Ok(()));
        assert_eq!(lacks_azimuths.check(&at([45.0, 0.0, 30.0, 91.0])), missing);
        let lacks_phi_i = machine(&|machine| machine.speeds.phi_i = speed);
        assert_eq!(lacks_phi_i.check(&at([45.0, 10.0, 30.0, 200.0])), Ok(()));
    }
    let beyond = at([70.0, 0.0, 30.0, 90.0]);
    let error = machine(&|_| {}).check(&beyond).unwrap_err();
    assert_eq!(error.code, ErrorCode::MaxThetaI);
}

/// A limit that is NaN was no limit.
#[test]
fn names_fields_out_of_range() {
    const INVALID: [f32; 5] = [f32::NAN, 0.0, -0.1, 1.6, f32::INFINITY];
    type Set = fn(&mut Limits, f32);
    let fields: [(&str, Set, [f32; 5]); 3] = [
        ("limits.max_theta_i", |l, x| l.max_theta_i = x, INVALID),
        ("limits.max_theta_o", |l, x| l.max_theta_o = x, INVALID),
        // 2.4 exceeds the sum of the largest polar angles.
        (
            "limits.min_separation",
            |l, x| l.min_separation = x,
            [f32::NAN, -0.1, 2.4, 3.2, f32::INFINITY],
        ),
    ];
    for (name, set, invalid) in fields {
        for x in invalid {
            let mut limits = limits();
            set(&mut limits, x);
            let error = limits.validate().unwrap_err();
            assert_eq!((error.code, error.field), (ErrorCode::Limits, name));
            let reaches = limits.check(&at([30.0, 0.0, 40.0, 180.0])).is_ok();
            assert!(!(x.is_nan() && reaches), "{name}");
        }
    }
    let widest = Limits {
        max_theta_i: FRAC_PI_2,
        max_theta_o: FRAC_PI_2,
        min_separation: PI,
        in_plane: true,
    };
    assert_eq!(widest.validate(), Ok(()));
    assert_eq!(Limits::NONE.validate(), Ok(()));
}

proptest! {
    #[test]
    fn unlimited_arms_reach_hemisphere(
        theta_i in 0.0..89.9f32, phi_i in -180.0..180f32, theta_o in 0.0..89.9f32, phi_o in -180.0..180f32,
    ) {
        let pair = at([theta_i, phi_i, theta_o, phi_o]);
        prop_assert_eq!(Limits::NONE.check(&pair), Ok(()));
    }
}
