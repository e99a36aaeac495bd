//! Files that another reading explains better.

use std::f64::consts::PI;
use std::path::Path;

use glimpse_core::model::ModelKind;
use glimpse_fitting::measurement::{
    Alternative, AngleConvention, AngleUnit, FitFailure, MaterialFit, Multiple, NamedRecipe,
    ReadingQuantity, ReadingRows, Readings, TableArgs,
};

/// The BRDF in one plane of a diffuse reflector with a GGX lobe of roughness `alpha`; theta_o is positive on the mirror's side.
fn brdf(alpha: f64, [theta_i, theta_o]: [f64; 2]) -> [f64; 3] {
    let [i, o] = [theta_i, theta_o].map(f64::to_radians);
    let (half, difference) = (0.5 * (o - i), 0.5 * (o + i));
    let g1 =
        |cos: f64| 2.0 * cos / (cos + (alpha * alpha + (1.0 - alpha * alpha) * cos * cos).sqrt());
    let d = alpha * alpha / (PI * (half.cos().powi(2) * (alpha * alpha - 1.0) + 1.0).powi(2));
    let fresnel = 0.05 + 0.95 * (1.0 - difference.cos()).powi(5);
    let lobe = d * fresnel * g1(i.cos()) * g1(o.cos()) / (4.0 * i.cos() * o.cos());
    [0.3, 0.12, 0.05].map(|albedo| albedo / PI + lobe)
}

/// Returns rows of a file.
fn rows(
    alpha: f64,
    pairs: &[[f64; 2]],
    row: impl Fn([f64; 2], [f64; 3]) -> (Vec<f64>, [f64; 3]),
) -> String {
    let rows = pairs.iter().map(|pair| {
        let (angles, numbers) = row(*pair, brdf(alpha, *pair));
        let cells = angles
            .iter()
            .chain(&numbers)
            .map(|cell| format!("{cell:.5}"));
        cells.collect::<Vec<_>>().join(",") + "\n"
    });
    rows.collect()
}

fn fit(text: &str) -> MaterialFit {
    let rows = ReadingRows::parse(Path::new("a.csv"), text.as_bytes(), &TableArgs::default());
    let rows = rows.expect("the file is read");
    let any = NamedRecipe::any(ModelKind::Linear);
    let readings = Readings::new(&any, rows, ReadingQuantity::of(Multiple::Brdf));
    MaterialFit::new(readings.expect("valid readings"), "a".to_owned(), false).expect("a fit")
}

#[test]
fn alternative_explains_a_misread_file() {
    let plane: Vec<[f64; 2]> = [75.0, 60.0, 50.0, 45.0, 40.0, 30.0, 20.0, 0.0, -30.0, -60.0]
        .map(|theta_o| [45.0, theta_o])
        .to_vec();
    let with_azimuth = |[i, o]: [f64; 2]| [i, o.abs(), if o > 0.0 { 180.0 } else { 0.0 }];
    let (in_plane, all) = ("theta_i,theta_o", "theta_i,phi_i,theta_o,phi_o");
    let polar = Alternative::Unit(AngleUnit::Radians);
    let opposite = Alternative::Convention(AngleConvention::FromMirror);
    let encoded = Alternative::Quantity(Multiple::Srgb);
    let files = [
        (
            in_plane,
            rows(0.08, &plane, |[i, o], f| (vec![i, o], f)),
            None,
        ),
        (
            in_plane,
            rows(0.08, &plane, |[i, o], f| (vec![i, -o], f)),
            Some(opposite),
        ),
        (
            all,
            rows(0.08, &plane, |pair, f| {
                let [i, o, phi] = with_azimuth(pair);
                (vec![i, 180.0, o, phi], f)
            }),
            Some(opposite),
        ),
        (
            all,
            rows(0.08, &plane, |pair, f| {
                let [i, o, phi] = with_azimuth(pair);
                (vec![i.to_radians(), 0.0, o.to_radians(), phi], f)
            }),
            Some(polar),
        ),
        (
            in_plane,
            rows(0.25, &plane, |[i, o], f| {
                (vec![i, o], f.map(|f| (PI * f).powf(1.0 / 2.2)))
            }),
            Some(encoded),
        ),
    ];
    for (columns, rows, expected) in files {
        let fit = fit(&format!("{columns},r,g,b\n{rows}"));
        let doubt = fit.selection.readings.doubt;
        assert_eq!(
            doubt.map(|doubt| doubt.alternative),
            expected,
            "{columns}\n{rows}"
        );
        let is_misread = matches!(fit.check_plausible(), Err(FitFailure::Misread(_)));
        assert_eq!(is_misread, doubt.is_some_and(|doubt| doubt.is_refused));
    }
}

/// The highlight of a lobe of 3 degrees says nothing about the albedo.
#[test]
fn narrow_lobe_near_the_normal_is_plausible() {
    let pairs = [1.5, 1.0, 0.5, 0.0, -0.5, -1.0, -1.5].map(|theta_o| [1.0, theta_o]);
    let rows = rows(0.05, &pairs, |[i, o], f| (vec![i, o], f));
    let fit = fit(&format!("theta_i (deg),theta_o (deg),r,g,b\n{rows}"));
    assert_eq!(fit.selection.readings.doubt, None);
    assert_eq!(fit.check_plausible(), Ok(()));
}
