//! Readings at any directions, and recipes that cannot be made for them.

use std::f64::consts::FRAC_PI_2;

use glimpse_core::geometry::Angles;
use glimpse_core::model::ModelKind;
use glimpse_fitting::measurement::{
    AngleArgs, AngleConvention, AngleUnit, AngularDistance, FitFailure, FitReport, LabReading,
    MaterialFit, Multiple, NamedRecipe, NoiseSource, ReadingQuantity, ReadingRows, Readings,
    TableArgs, TableError,
};
use glimpse_fitting::recipe::RecipeDefect;
use glimpse_fitting::route::arms_in_degrees;
use glimpse_materials::Viewing;

use super::{error_message, pattern, recipe, rows};
use crate::common::assert_names;

#[test]
fn recipe_at_directions_names_its_defect() {
    let any = NamedRecipe::any(ModelKind::Neural);
    let with_pattern = any.at(&pattern()).expect("valid directions");
    let many = vec![pattern()[0]; 4097];
    let defect = |recipe: &NamedRecipe, directions: &[Angles<f32>]| {
        recipe.at(directions).expect_err("a defect")
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
    use AngleConvention::{Elevation, Exchanged, FromMirror, Signed, Travel};

    let read = |convention: &[AngleConvention], unit, text: &str| {
        let angles = AngleArgs {
            unit,
            convention: convention.to_vec(),
            ..AngleArgs::default()
        };
        let args = TableArgs {
            angles,
            ..TableArgs::default()
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
    let opposite = "theta_i,theta_o,value\n45,-60,1\n45,30,1\n30,0,1\n";
    let exchanged = "theta_i,theta_o,value\n60,45,1\n-30,45,1\n0,30,1\n";
    let travel =
        "theta_i,phi_i,theta_o,phi_o,value\n135,180,60,180,1\n135,180,30,0,1\n150,180,0,0,1\n";
    let travel_in_plane = "theta_i,theta_o,value\n135,60,1\n135,-30,1\n150,0,1\n";
    let surface_and_travel = "theta_i,theta_o,phi,value\n-45,30,0,1\n-45,60,180,1\n-60,90,0,1\n";
    let mixed = "theta_i [rad],theta_o (deg),phi,value\n0.785398163,60,180,1\n0.785398163,30,0,1\n0.523598776,0,180,1\n";
    let azimuths =
        "theta_i,theta_o,phi (rad),value\n45,60,3.14159265359,1\n45,30,0,1\n30,0,1.5,1\n";
    for (convention, unit, text) in [
        (&[][..], None, relative),
        (&[FromMirror], None, opposite),
        (&[Exchanged], None, exchanged),
        (&[Travel], None, travel),
        (&[Travel], None, travel_in_plane),
        (&[Elevation, Travel, Signed], None, surface_and_travel),
        (&[], None, mixed),
        (&[], None, azimuths),
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
        rows("index,400nm,500nm\n0,0.1,0.2\n", &TableArgs::default()).expect("the file is read");
    let quantity = ReadingQuantity::of(Multiple::Brdf);
    let readings = Readings::new(&given, rows, quantity).expect("valid readings");
    let failure = MaterialFit::new(readings, "a".to_owned(), false).expect_err("a failure");
    assert_eq!(failure, FitFailure::Bands(ModelKind::CookTorrance));
}

/// Reads rows of a given noise.
fn read_with_noise(
    given: &NamedRecipe,
    text: &str,
    noise: Option<f32>,
) -> Result<Readings, TableError> {
    let mut rows = rows(text, &TableArgs::default())?;
    rows.noise = noise;
    Readings::new(given, rows, ReadingQuantity::of(Multiple::Brdf))
}

#[test]
fn noise_is_stated_repeated_or_assumed() {
    use NoiseSource::{Default, Repeated, Stated};

    let any = NamedRecipe::any(ModelKind::Linear);
    let half = 0.5_f32.sqrt();
    let equal = "theta_i,theta_o,value\n45,30,0.2\n45,30,0.2\n30,0,9\n";
    let varied = "theta_i,theta_o,value\n45,30,0.2\n45,30,0.22\n30,0,9\n30,0,9.9\n30,0,9\n30,0,9.9\n10,0,1\n";
    let column = "theta_i,theta_o,value,noise\n45,30,0.2,0.3\n45,30,0.2,0.3\n30,0,9,0\n10,0,1,\n";
    for (text, option, source, expected) in [
        (equal, None, Default, [0.02 * half, 0.02]),
        (equal, Some(0.1), Stated, [0.1 * half, 0.1]),
        (column, None, Default, [0.3 * half, 1e-3]),
        // Medians of chi squared: each deviation is about 0.06 to 0.1 of the mean.
        (varied, None, Repeated, [0.1 * half, 0.05]),
    ] {
        let readings = read_with_noise(&any, text, option).expect("valid readings");
        assert_eq!(readings.noise.map(|noise| noise.source), Some(source));
        for (sample, expected) in readings.samples.iter().zip(expected) {
            let ratio = sample.noise / expected;
            assert!((0.6..1.6).contains(&ratio), "{source:?}: {ratio}");
            assert!(source == Repeated || (ratio - 1.0).abs() < 1e-4, "{ratio}");
        }
    }
    let with_pattern = any.at(&pattern()).expect("valid directions");
    let refused = read_with_noise(&with_pattern, "index,value\n0,1\n", Some(0.1));
    assert_names(&error_message(refused), &["noise", "any"]);
    let all_stated = "theta_i,theta_o,value,noise\n45,30,0.2,0.3\n";
    let refused = read_with_noise(&any, all_stated, Some(0.1));
    assert_names(&error_message(refused), &["noise"]);
}

#[test]
fn report_names_gaps_of_the_readings() {
    let gaps = |given: &NamedRecipe, text: &str| {
        let readings = read_with_noise(given, text, None).expect("valid readings");
        let fit = MaterialFit::new(readings, "a".to_owned(), true).expect("a fit");
        let report = FitReport::new(&fit, Viewing::default());
        let losses = report.expected_loss.map(|expected| expected.loss);
        assert!(losses.is_some_and(|loss| f64::from(loss) < report.loss_scale.black));
        (report.gaps, losses.expect("a loss"))
    };
    let any = NamedRecipe::any(ModelKind::Linear);
    let six = "45,60,0.3\n45,30,0.3\n45,20,0.2\n45,0,0.2\n45,-30,0.2\n45,-65,0.2\n";
    let (found, loss) = gaps(&any, &format!("theta_i,theta_o,value\n{six}"));
    let gloss = found.gloss.expect("a gap");
    assert!((gloss.nearest - 15.0).abs() < 1e-3 && !gloss.read.is_empty());
    let from = found.extrapolated_from.expect("an angle");
    assert!((from - 65.0).abs() < 1e-3 && found.is_monochrome);
    assert!(found.next.is_some_and(|next| next.expected_loss < loss));
    let rgb = six.replace('\n', ",0.2,0.2\n") + "60,60,0.5,0.5,0.5\n";
    let (found, _) = gaps(&any, &format!("theta_i,theta_o,r,g,b\n{rgb}"));
    assert!(found.gloss.is_none() && !found.is_monochrome);
    let with_pattern = any.at(&pattern()).expect("valid directions");
    let (found, _) = gaps(&with_pattern, "index,value\n0,1\n1,0.3\n2,0.3\n");
    assert!(found.gloss.is_none() && found.next.is_none() && found.is_monochrome);
}
