//! Raw counts, wrong units and outliers end in an error or in finite numbers.
//!
//! In version 0.1, readings times 16,777,215 gave 219 NaN parameters, a finite residual and black (on x86). One reading
//! of `f32::MAX` gave NaN coefficients and a residual of 87.9. Counts of 12 or 16 bits gave a finished fit.

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::gonio::Reading;
use glimpse_core::recipe::Recipe;

use super::SCAN_RECIPES;
use crate::recipes::parsed;
use crate::scanning::*;

/// A synthetic recipe of each model, and the recipes of the examples, which have large step sizes.
fn recipes() -> Vec<Recipe<'static>> {
    let learned = SCAN_RECIPES.map(|bytes| parsed(bytes.to_vec()));
    [learned, MODELS.map(recipe_for)].concat()
}

fn outcomes(reading: impl Fn(u16) -> Reading) -> Vec<Outcome> {
    let recipes = recipes().into_iter();
    recipes.map(|recipe| full_scan(recipe, &reading)).collect()
}

/// Readings of a Lambertian material with a highlight, from 0.06 to 3 sr^-1.
fn plausible(index: u16) -> [f32; 3] {
    let highlight = if index == 2 { 2.5 } else { 0.0 };
    [0.30 + highlight, 0.12 + highlight, 0.06 + highlight]
        .map(|f| f * (1.0 + 0.01 * f32::from(index)))
}

#[test]
fn rejects_counts_and_wrong_units() {
    let check_rejected = |reading: &dyn Fn(u16) -> Reading| {
        for outcome in outcomes(reading) {
            assert_eq!(outcome, Outcome::TooLarge);
        }
    };
    check_rejected(&|index| Reading::new(plausible(index).map(|f| f * 16_777_215.0)));
    check_rejected(&|_| Reading::monochrome(f32::MAX));
    // A perfect white, 0.32 sr^-1, is at 70 % of the range.
    for white in [4_095.0_f32, 65_535.0] {
        let count = |f: f32| (f / 0.32 * 0.7 * white).min(white).round();
        check_rejected(&|index| Reading {
            brdf: plausible(index).map(count),
            saturated: index == 2,
        });
        // A stuck sensor.
        check_rejected(&|_| Reading::monochrome(white));
    }
    for outcome in outcomes(|index| Reading::new(plausible(index))) {
        assert!(matches!(outcome, Outcome::Fitted(..)), "{outcome:?}");
    }
}

/// Real materials are shiny. Nickel is above 10 sr^-1 at 12 of the 24 readings of Neural's pattern, whose theta_d are
/// large. Its lower quartile is below 1. The lower quartile of every material of MERL and RGL is at most 1.2, with any
/// of the demo's four patterns.
#[test]
fn accepts_metal_at_grazing_angles() {
    for mut scan in empty_scans() {
        record(&mut scan, 0..6, |_| Reading::new([60.0, 50.0, 40.0]));
        record(&mut scan, 6..8, |_| Reading::new([0.9; 3]));
        assert!(scan.fit().is_ok());
        scan.record(6, Reading::new([0.9, 11.0, 0.9])).unwrap();
        assert_eq!(
            scan.fit().err(),
            Some(Error::with(ErrorCode::ReadingsTooLarge, [10, 0]))
        );
    }
}
