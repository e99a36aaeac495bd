//! What a fitted material answers, and where it does not.

mod common;

use common::{linear, neural, write, write_linear};
use glimpse_core::fit::{AnyModel, Linear, linear_words};
use glimpse_core::geometry::Directions;
use glimpse_core::model::Neural;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Memory, Reading, Scan};

/// Asks a material that Neural fitted.
fn with_fitted(check: impl Fn(&dyn Fn(Directions<f32>) -> Option<[f32; 3]>)) {
    let bytes = write(&neural()).unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    let mut memory = Memory::<Neural, 8>::new();
    let mut scan = Scan::new(recipe, &mut memory).unwrap();
    for index in 0..8 {
        scan.record(index, Reading::new([0.3, 0.2, 0.1])).unwrap();
    }
    let mut fit = scan.fit().unwrap();
    assert!(fit.advance(u32::MAX).is_complete());
    let fitted = fit.finish().unwrap();
    check(&|directions| fitted.brdf(&directions));
}

const UP: [f32; 3] = [0.0, 0.0, 1.0];
const SLANTED: [f32; 3] = [0.6, 0.0, 0.8];

fn pair(incoming: [f32; 3], outgoing: [f32; 3]) -> Directions<f32> {
    Directions { incoming, outgoing }
}

#[test]
fn a_material_answers_above_the_horizon() {
    with_fitted(|brdf| {
        for directions in [
            pair(UP, UP),
            pair(SLANTED, UP),
            pair(UP, SLANTED),
            pair(SLANTED, [-0.6, 0.0, 0.8]),
            pair(SLANTED, SLANTED),
        ] {
            let found = brdf(directions).unwrap();
            assert!(
                found.iter().all(|f| f.is_finite() && *f >= 0.0),
                "{found:?}"
            );
        }
    });
}

/// In version 0.1 it was black there.
#[test]
fn below_the_horizon_there_is_no_brdf() {
    let below = [0.6, 0.0, -0.8];
    let at_it = [1.0, 0.0, 0.0];
    with_fitted(|brdf| {
        for other in [UP, SLANTED] {
            for low in [below, at_it, [0.0, 0.0, -1.0]] {
                assert_eq!(brdf(pair(low, other)), None);
                assert_eq!(brdf(pair(other, low)), None);
            }
        }
        assert_eq!(brdf(pair(below, below)), None);
    });
}

#[test]
fn of_what_is_no_direction_there_is_no_brdf() {
    with_fitted(|brdf| {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for place in 0..3 {
                let mut wrong = UP;
                wrong[place] = bad;
                assert_eq!(brdf(pair(wrong, UP)), None);
                assert_eq!(brdf(pair(SLANTED, wrong)), None);
            }
        }
        assert_eq!(brdf(pair([0.0; 3], [0.0; 3])), None);
    });
}

/// In version 0.1 it was 1e19 for some.
#[test]
fn of_vectors_that_are_not_unit_there_is_no_brdf() {
    with_fitted(|brdf| {
        for length in [0.0, 0.5, 0.9, 1.1, 2.0, 1e3, 1e19] {
            let long = SLANTED.map(|x| x * length);
            assert_eq!(brdf(pair(long, UP)), None, "{length}");
            assert_eq!(brdf(pair(UP, long)), None, "{length}");
            assert_eq!(brdf(pair(long, long)), None, "{length}");
        }
    });
}

/// Where the caller's own rounding is all that is wrong, it is a direction still.
#[test]
fn rounding_leaves_a_direction_unit() {
    with_fitted(|brdf| {
        for scale in [1.0 - 1e-6, 1.0 + 1e-6] {
            let nearly = SLANTED.map(|x| x * scale);
            assert!(brdf(pair(nearly, UP)).is_some());
        }
    });
}

#[test]
fn linear_without_a_basis_has_no_brdf() {
    const WORDS: usize = linear_words(8, 5);
    let bytes = write_linear(&linear()).unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    let mut of_linear = Memory::<Linear<WORDS>, 8>::new();
    let mut of_any = Memory::<AnyModel<WORDS>, 8>::new();
    let mut linear = Scan::new(recipe, &mut of_linear).unwrap();
    let mut any = Scan::new(recipe, &mut of_any).unwrap();
    for index in 0..8 {
        let reading = Reading::new([0.3, 0.2, 0.1]);
        linear.record(index, reading).unwrap();
        any.record(index, reading).unwrap();
    }
    let (mut of_linear, mut of_any) = (linear.fit().unwrap(), any.fit().unwrap());
    assert!(of_linear.advance(u32::MAX).is_complete());
    assert!(of_any.advance(u32::MAX).is_complete());
    let (linear, any) = (of_linear.finish().unwrap(), of_any.finish().unwrap());
    assert!(linear.values().eq(any.values()));
    assert_eq!(linear.brdf(&pair(UP, SLANTED)), None);
    assert_eq!(any.brdf(&pair(UP, SLANTED)), None);
}
