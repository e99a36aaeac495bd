//! Mapping and unmapping are inverse functions.

use glimpse_core::model::linear::{EPSILON, map, unmap};
use proptest::prelude::*;

proptest! {
    #[test]
    fn unmap_inverts_map(
        brdf in prop_oneof![Just(0.0), 0.0..1.0, 1.0..1e4],
        weight in 1e-3..1.0,
    ) {
        // The error is relative to the argument of the mapping's logarithm, divided by its weight.
        let scale: f64 = brdf + EPSILON / weight;
        let mapped = map(brdf as f32, weight as f32);
        let back = f64::from(unmap(mapped, weight as f32));
        let tolerance = if cfg!(feature = "micromath") { 2e-2 } else { 2e-6 };
        prop_assert!((back - brdf).abs() < tolerance * scale, "{brdf} became {back}");
    }

    #[test]
    fn unmap_is_not_negative(mapped in -80.0..80.0f32, weight in 0.0..1.0f32) {
        let brdf = unmap(mapped, weight);
        prop_assert!(brdf >= 0.0, "{brdf}");
        prop_assert!(unmap(mapped, 0.0) >= 0.0);
    }
}

/// The sign bit of a NaN depends on the machine.
#[test]
fn unmap_keeps_nan() {
    for mapped in [f32::NAN, -f32::NAN] {
        for weight in [0.0, 0.5] {
            assert!(unmap(mapped, weight).is_nan());
        }
    }
    assert_eq!(unmap(-1e30, 0.5), 0.0);
}
