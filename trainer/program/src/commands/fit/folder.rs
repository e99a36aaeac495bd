//! The files of a fit.

use crate::report::{Lobe, lobe, lobe_directions, lobe_svg, luminance};
use glimpse_core::geometry::Angles;
use glimpse_evaluation::evaluation::SPHERE_SIZE;
use glimpse_evaluation::render::render_sphere;
use glimpse_fitting::measurement::{Fit, IsotropicAngles, coefficient_of_variation};
use glimpse_materials::basis::angles_to_f64;
use glimpse_materials::{BasisFile, Brdf, Material, angles_of};

use super::report::FitReport;

/// Polar angles of the light in the plot of lobes, degrees.
const LOBE_THETA_I: [f32; 3] = [15.0, 45.0, 75.0];

/// The names of all files.
pub(super) const FILES: [&str; 6] = [
    "material.json",
    "sphere.png",
    "lobe.svg",
    "readings.csv",
    "bands.csv",
    "bands.svg",
];

/// Returns the contents of [`FILES`]; without bands, of the first four.
pub(super) fn contents(
    fit: &Fit,
    pattern: &[Angles<f32>],
    basis: Option<&BasisFile>,
    report: &FitReport,
) -> anyhow::Result<Vec<(&'static str, Vec<u8>)>> {
    let material = &fit.material;
    let sphere = render_sphere(material as &dyn Material, SPHERE_SIZE);
    let bands = report.spectrum.iter();
    let bands =
        bands.flat_map(|spectrum| [spectrum.to_csv(), spectrum.to_svg()].map(String::into_bytes));
    let contents = [
        material.to_json(basis, report)?.into_bytes(),
        sphere.tone_map().to_png()?,
        lobes(fit).into_bytes(),
        readings(fit, pattern).into_bytes(),
    ];
    Ok(FILES
        .into_iter()
        .zip(contents.into_iter().chain(bands))
        .collect())
}

fn lobes(fit: &Fit) -> String {
    let material = &fit.material;
    let lobes = LOBE_THETA_I.map(|degrees| {
        let theta_i = degrees.to_radians();
        let (_, directions) = lobe_directions(theta_i);
        let angles = directions.iter().map(angles_of).collect();
        let deviations = fit
            .selection
            .posterior
            .deviations(material.fitted(), angles);
        Lobe {
            name: format!("{}, light at {degrees}\u{b0}", material.name()),
            theta_i,
            curve: lobe(material as &dyn Material, theta_i),
            dashed: None,
            deviations: deviations.into_iter().map(luminance).collect(),
        }
    });
    lobe_svg(&lobes)
}

/// Returns readings.csv, with a row for each sample of the pattern. It can be corrected and fitted again.
fn readings(fit: &Fit, pattern: &[Angles<f32>]) -> String {
    let mut csv = "index,theta_i,phi_i,theta_o,phi_o,r,g,b,quantity,saturated,times,spread,fitted_r,fitted_g,fitted_b,\
                   deviation_r,deviation_g,deviation_b,expected_r,expected_g,expected_b,z,status\n"
        .to_owned();
    let deviations = fit
        .selection
        .posterior
        .deviations(fit.material.fitted(), pattern.to_vec());
    for (index, angles) in pattern.iter().enumerate() {
        let arms = IsotropicAngles::from_angles(angles_to_f64(angles));
        let phi = arms.phi.rem_euclid(std::f64::consts::TAU);
        let [theta_i, theta_o, phi] = [arms.theta_i, arms.theta_o, phi].map(f64::to_degrees);
        let sample = &fit.selection.measurements.samples[index];
        let spread = coefficient_of_variation(sample);
        let prediction = fit.selection.outlier_report.predictions[index];
        let rgb = |rgb: Option<[f32; 3]>| match rgb {
            Some([r, g, b]) => format!("{r},{g},{b}"),
            None => ",,".to_owned(),
        };
        csv += &format!(
            "{index},{theta_i:.5},0,{theta_o:.5},{phi:.5},{},brdf,{},{},{},{},{},{},{},{}\n",
            rgb(sample.mean()),
            u8::from(sample.saturated()),
            sample.count(),
            spread.map_or_else(String::new, |spread| format!("{spread:.4}")),
            rgb(Some(fit.material.at_angles(*angles))),
            rgb(Some(deviations[index])),
            rgb(prediction.map(|prediction| prediction.expected)),
            prediction.map_or_else(String::new, |prediction| format!("{:.2}", prediction.z)),
            fit.selection.statuses[index].name(),
        );
    }
    csv
}
