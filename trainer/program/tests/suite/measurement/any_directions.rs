//! Readings at any directions, and recipes that cannot be made for them.

use std::f64::consts::FRAC_PI_2;

use glimpse_core::geometry::Angles;
use glimpse_core::model::ModelKind;
use glimpse_fitting::measurement::{
    AngleArgs, AngleConvention, AngleUnit, AngularDistance, FitFailure, LabReading, MaterialFit,
    Multiple, NamedRecipe, ReadingQuantity, ReadingRows, Readings,
};
use glimpse_fitting::recipe::RecipeDefect;
use glimpse_fitting::route::arms_in_degrees;

use super::{error_message, pattern, recipe, rows};
use crate::common::assert_names;

#[test]
fn recipe_at_directions_names_its_defect() {
    let any = NamedRecipe::any(ModelKind::Neural);
    let with_pattern = any.at(&pattern(), &[]).expect("valid directions");
    let many = vec![pattern()[0]; 4097];
    let defect = |recipe: &NamedRecipe, directions: &[Angles<f32>]| {
        recipe.at(directions, &[]).expect_err("a defect")
    };
    assert_eq!(defect(&with_pattern, &pattern()), RecipeDefect::NotAny);
    assert_eq!(defect(&any, &many), RecipeDefect::TooManyDirections(4097));
    let below = Angles {
        theta_h: 1.5,
        theta_d: 1.5,
        phi_d: 0.0,
    };
    assert!(matches!(defect(&any, &[below]), RecipeDefect::Recipe(_)));
}

/// The same directions by other columns, units and conventions.
#[test]
fn conventions_agree() {
    use AngleConvention::{Elevation, FromMirror, Signed};

    let read = |convention: &[AngleConvention], unit, text: &str| {
        let args = AngleArgs {
            unit,
            convention: convention.to_vec(),
        };
        let rows = rows(text, &args).expect("the file is read");
        let any = NamedRecipe::any(ModelKind::Linear);
        let readings = Readings::new(&any, rows, ReadingQuantity::of(Multiple::Brdf));
        let pattern = readings.expect("valid readings").pattern();
        let arms = pattern.into_iter().map(arms_in_degrees);
        arms.collect::<Vec<_>>()
    };
    let in_plane = "theta_i,theta_o,value\n45,60,1\n45,-30,1\n30,0,1\n";
    let expected = read(&[], None, in_plane);
    assert_eq!(expected.len(), 3);
    // A row without a reading is ignored.
    let relative = "theta_i,theta_o,phi,value\n45,60,180,1\n45,30,0,1\n12,77,0,\n30,0,180,1\n";
    let from_mirror = "theta_i,theta_o,phi,value\n45,60,0,1\n45,30,180,1\n30,0,0,1\n";
    let elevation = "theta_i,theta_o,phi,value\n45,30,180,1\n45,60,0,1\n60,90,180,1\n";
    let signed =
        "theta_i,phi_i,theta_o,phi_o,value\n-45,180,60,180,1\n-45,180,-30,180,1\n-30,180,0,180,1\n";
    let radians = "theta_i,theta_o,value\n0.785398163,1.047197551,1\n0.785398163,-0.523598776,1\n0.523598776,0,1\n";
    for (convention, unit, text) in [
        (&[][..], None, relative),
        (&[FromMirror], None, from_mirror),
        (&[Elevation], None, elevation),
        (&[Signed], None, signed),
        (&[], Some(AngleUnit::Radians), radians),
    ] {
        let actual = read(convention, unit, text);
        assert_eq!(actual.len(), expected.len(), "{text}");
        for (actual, expected) in actual.iter().zip(&expected) {
            let distance = AngularDistance::between(actual, expected);
            assert!(distance.degrees < 1e-6_f64.to_degrees(), "{text}");
        }
    }
}

#[test]
fn million_directions_are_refused_at_once() {
    let reading = |line: u32| LabReading {
        line: line as usize,
        angles: Some(Angles {
            theta_h: FRAC_PI_2 / 2.0 * f64::from(line) / 1e6,
            theta_d: 0.1,
            phi_d: 0.0,
        }),
        numbers: vec![0.1; 3],
        ..LabReading::default()
    };
    let rows = ReadingRows::from_array("a.csv", Vec::new(), (0..1_000_000).map(reading).collect());
    let any = NamedRecipe::any(ModelKind::Linear);
    let refused = Readings::new(&any, rows, ReadingQuantity::of(Multiple::Brdf));
    assert_names(&error_message(refused), &["4096"]);
}

#[test]
fn bands_are_refused_before_the_fit() {
    let file = recipe("paper/cook-torrance-n8.recipe");
    let given = NamedRecipe::new("cook-torrance-n8".to_owned(), file.into(), None);
    // Another error would end the fit.
    let rows =
        rows("index,400nm,500nm\n0,0.1,0.2\n", &AngleArgs::default()).expect("the file is read");
    let quantity = ReadingQuantity::of(Multiple::Brdf);
    let readings = Readings::new(&given, rows, quantity).expect("valid readings");
    let failure = MaterialFit::new(readings, "a".to_owned(), false).expect_err("a failure");
    assert_eq!(failure, FitFailure::Bands(ModelKind::CookTorrance));
}
