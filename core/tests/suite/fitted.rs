//! The BRDF of a fitted material, and directions without a BRDF.

use glimpse_core::geometry::Directions;
use glimpse_core::model::ModelKind;
use glimpse_core::scan::Scan;

use crate::scanning::{Any, fit, new_scan, recipe_for, record, synthetic_reading};

const UP: [f32; 3] = [0.0, 0.0, 1.0];
const SLANTED: [f32; 3] = [0.6, 0.0, 0.8];

/// A finished scan.
fn fitted_scan(model: ModelKind) -> Scan<'static, Any> {
    let mut scan = new_scan(recipe_for(model));
    record(&mut scan, 0..8, synthetic_reading);
    fit(&mut scan, &[u32::MAX]);
    scan
}

/// In version 0.1, the BRDF was black below the horizon, and 1e19 for some vectors that are not unit vectors.
/// `geometry/errors.rs` tests all kinds of invalid directions.
#[test]
fn brdf_only_for_unit_vectors_above_horizon() {
    let long = SLANTED.map(|x| 1.1 * x);
    let rounded = SLANTED.map(|x| (1.0 + 1e-6) * x);
    let invalid = [[0.6, 0.0, -0.8], [1.0, 0.0, 0.0], long, [f32::NAN; 3]];
    let scan = fitted_scan(ModelKind::Neural);
    let fitted = scan.fitted().unwrap();
    let brdf = |incoming, outgoing| fitted.brdf(&Directions { incoming, outgoing });
    for valid in [UP, SLANTED, rounded] {
        let actual = brdf(valid, SLANTED).unwrap();
        let is_valid = |f: &f32| f.is_finite() && *f >= 0.0;
        assert!(actual.iter().all(is_valid), "{actual:?}");
        for invalid in invalid {
            let both = [brdf(invalid, valid), brdf(valid, invalid)];
            assert_eq!(both, [None; 2], "{invalid:?}");
        }
    }
    // Linear without its basis.
    let (incoming, outgoing) = (UP, SLANTED);
    let linear = fitted_scan(ModelKind::Linear);
    let fitted = linear.fitted().unwrap();
    assert_eq!(fitted.brdf(&Directions { incoming, outgoing }), None);
}
