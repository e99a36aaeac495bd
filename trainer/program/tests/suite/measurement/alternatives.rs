//! Files that another reading explains better.

use std::f64::consts::PI;

use glimpse_core::model::ModelKind;
use glimpse_fitting::measurement::{
    Alternative, AngleConvention, AngleUnit, FitFailure, MaterialFit, Multiple, NamedRecipe,
    ReadingQuantity, Readings, TableArgs,
};

use super::rows;

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

/// Returns the angles and the numbers of a row, of a pair of angles and its BRDF.
type Row = fn([f64; 2], [f64; 3]) -> (Vec<f64>, [f64; 3]);

/// Fits a file.
fn fit(angles: &str, (alpha, pairs): (f64, &[[f64; 2]]), row: Row) -> MaterialFit {
    let rows_of_file = pairs.iter().map(|pair| {
        let (angles, numbers) = row(*pair, brdf(alpha, *pair));
        let cells = angles.iter().chain(&numbers);
        let cells: Vec<String> = cells.map(|cell| format!("{cell:.5}")).collect();
        cells.join(",") + "\n"
    });
    let text = format!("{angles},r,g,b\n{}", rows_of_file.collect::<String>());
    let rows = rows(&text, &TableArgs::default()).expect("the file is read");
    let any = NamedRecipe::any(ModelKind::Linear);
    let readings = Readings::new(&any, rows, ReadingQuantity::of(Multiple::Brdf));
    MaterialFit::new(readings.expect("valid readings"), "a".to_owned(), false).expect("a fit")
}

#[test]
fn alternative_explains_a_misread_file() {
    const SENSOR: [f64; 10] = [75.0, 60.0, 50.0, 45.0, 40.0, 30.0, 20.0, 0.0, -30.0, -60.0];
    /// The azimuth of the sensor in degrees.
    fn phi(theta_o: f64) -> f64 {
        if theta_o > 0.0 { 180.0 } else { 0.0 }
    }
    let plane = SENSOR.map(|theta_o| [45.0, theta_o]);
    let (in_plane, all) = ("theta_i,theta_o", "theta_i,phi_i,theta_o,phi_o");
    let opposite = Some(Alternative::Convention(AngleConvention::FromMirror));
    let radians = Some(Alternative::Unit(AngleUnit::Radians));
    let encoded = Some(Alternative::Quantity(Multiple::Srgb));
    let files: [(&str, f64, Row, Option<Alternative>); 5] = [
        (in_plane, 0.08, |[i, o], f| (vec![i, o], f), None),
        (in_plane, 0.08, |[i, o], f| (vec![i, -o], f), opposite),
        (
            all,
            0.08,
            |[i, o], f| (vec![i, 180.0, o.abs(), phi(o)], f),
            opposite,
        ),
        (
            all,
            0.08,
            |[i, o], f| (vec![i.to_radians(), 0.0, o.abs().to_radians(), phi(o)], f),
            radians,
        ),
        (
            in_plane,
            0.25,
            |[i, o], f| (vec![i, o], f.map(|f| (PI * f).powf(1.0 / 2.2))),
            encoded,
        ),
    ];
    for (angles, alpha, row, expected) in files {
        let fit = fit(angles, (alpha, &plane), row);
        let doubt = fit.doubt;
        assert_eq!(doubt.map(|doubt| doubt.alternative), expected);
        let is_misread = matches!(fit.check_plausible(), Err(FitFailure::Misread(_)));
        assert_eq!(is_misread, doubt.is_some_and(|doubt| doubt.is_refused));
    }
}

/// The highlight of a lobe of 3 degrees says nothing about the albedo.
#[test]
fn narrow_lobe_near_the_normal_is_plausible() {
    let pairs = [1.5, 1.0, 0.5, 0.0, -0.5, -1.0, -1.5].map(|theta_o| [1.0, theta_o]);
    let angles = "theta_i (deg),theta_o (deg)";
    let fit = fit(angles, (0.05, &pairs), |[i, o], f| (vec![i, o], f));
    assert_eq!(fit.doubt, None);
    assert_eq!(fit.check_plausible(), Ok(()));
}
