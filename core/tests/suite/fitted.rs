//! The BRDF of a fitted material, and directions without a BRDF.

use glimpse_core::fit::{Linear, ScanModel};
use glimpse_core::geometry::Directions;
use glimpse_core::model::{ModelKind, Neural};
use glimpse_core::scan::Fitted;

use crate::scanning::{Any, fit, new_scan, recipe_for, record, synthetic_reading};

const UP: [f32; 3] = [0.0, 0.0, 1.0];
const SLANTED: [f32; 3] = [0.6, 0.0, 0.8];

/// Calls `check` with a material that `K` fitted.
fn with_fitted<K: ScanModel + 'static>(model: ModelKind, check: impl FnOnce(Fitted<'_, K>)) {
    let mut scan = new_scan::<K>(recipe_for(model));
    record(&mut scan, 0..8, synthetic_reading);
    fit(&mut scan, &[u32::MAX]);
    check(scan.fitted().unwrap());
}

/// In version 0.1, the BRDF was black below the horizon, and 1e19 for some vectors that are not unit vectors.
#[test]
fn brdf_only_for_unit_vectors_above_horizon() {
    let scaled = |factor: f32| SLANTED.map(|x| x * factor);
    let valid = [
        UP,
        SLANTED,
        [-0.6, 0.0, 0.8],
        // Rounding by the caller.
        scaled(1.0 - 1e-6),
        scaled(1.0 + 1e-6),
    ];
    let mut invalid = vec![[0.6, 0.0, -0.8], [0.0, 0.0, -1.0]];
    invalid.extend([0.0, 0.5, 0.9, 1.1, 2.0, 1e3, 1e19].map(scaled));
    for number in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for coordinate in 0..3 {
            let mut broken = UP;
            broken[coordinate] = number;
            invalid.push(broken);
        }
    }
    with_fitted::<Neural>(ModelKind::Neural, |fitted| {
        let brdf = |incoming, outgoing| fitted.brdf(&Directions { incoming, outgoing });
        for incoming in valid {
            for outgoing in valid {
                let actual = brdf(incoming, outgoing).unwrap();
                let is_valid = |f: &f32| f.is_finite() && *f >= 0.0;
                assert!(actual.iter().all(is_valid), "{actual:?}");
            }
        }
        for invalid_direction in invalid {
            assert_eq!(
                brdf(invalid_direction, invalid_direction),
                None,
                "{invalid_direction:?}"
            );
            for valid_direction in valid {
                assert_eq!(
                    brdf(invalid_direction, valid_direction),
                    None,
                    "{invalid_direction:?}"
                );
                assert_eq!(
                    brdf(valid_direction, invalid_direction),
                    None,
                    "{invalid_direction:?}"
                );
            }
        }
        // At the horizon. For other pairs there, rounding determines the result.
        for valid_direction in [UP, SLANTED] {
            assert_eq!(brdf([1.0, 0.0, 0.0], valid_direction), None);
            assert_eq!(brdf(valid_direction, [1.0, 0.0, 0.0]), None);
        }
    });
}

#[test]
fn linear_without_basis_has_no_brdf() {
    let pair = Directions {
        incoming: UP,
        outgoing: SLANTED,
    };
    with_fitted::<Linear>(ModelKind::Linear, |fitted| {
        assert_eq!(fitted.brdf(&pair), None);
    });
    with_fitted::<Any>(ModelKind::Linear, |fitted| {
        assert_eq!(fitted.brdf(&pair), None);
    });
}
