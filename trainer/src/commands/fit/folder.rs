//! The files of a fit.

use std::path::Path;

use anyhow::Context;
use glimpse_core::geometry::Angles;
use glimpse_core::gonio::Quantity;
use glimpse_materials::basis::angles_to_f64;
use glimpse_materials::{BasisFile, FittedMaterial, Material};
use glimpse_trainer::measurement::{
    Fit, IsotropicAngles, Measurements, ReadingQuantity, coefficient_of_variation,
};
use glimpse_trainer::render::{Environment, render_sphere};
use glimpse_trainer::report::{Lobe, lobe, lobe_svg};

use super::super::output::write_file;
use super::report::FitReport;

/// Width and height of the rendered sphere, pixels.
const SPHERE_SIZE: usize = 256;
/// Polar angles of the light in the plot of lobes, degrees.
const LOBE_THETA_I: [f32; 3] = [15.0, 45.0, 75.0];

/// The content of a fit's folder.
pub(super) struct FitFolder<'a> {
    pub(super) material: FittedMaterial,
    pub(super) pattern: &'a [Angles<f32>],
    pub(super) measured: Measurements,
    pub(super) fit: Fit,
    pub(super) report: FitReport,
}

impl FitFolder<'_> {
    /// The names of all files.
    pub(super) const FILES: [&'static str; 4] =
        ["material.json", "sphere.png", "lobe.svg", "readings.csv"];

    /// Writes all files into a folder.
    pub(super) fn write(
        &self,
        folder: &Path,
        basis: Option<&BasisFile>,
        force: bool,
    ) -> anyhow::Result<()> {
        let sphere = render_sphere(
            &self.material as &dyn Material,
            &Environment::studio(),
            SPHERE_SIZE,
        );
        let contents = [
            self.material.to_json(basis, &self.report)?.into_bytes(),
            sphere.tone_map().to_png()?,
            self.lobes().into_bytes(),
            self.readings().context("cannot write the readings")?,
        ];
        for (name, bytes) in Self::FILES.iter().zip(contents) {
            write_file(&folder.join(name), &bytes, force)?;
        }
        Ok(())
    }

    fn lobes(&self) -> String {
        let lobes = LOBE_THETA_I.map(|degrees| {
            let theta_i = degrees.to_radians();
            Lobe {
                name: format!("{}, light at {degrees}\u{b0}", self.material.name()),
                theta_i,
                curve: lobe(&self.material as &dyn Material, theta_i),
                dashed: None,
            }
        });
        lobe_svg(&lobes)
    }

    /// Returns readings.csv, with a row for each sample of the pattern. It can be corrected and fitted again.
    fn readings(&self) -> anyhow::Result<Vec<u8>> {
        let mut csv = csv::Writer::from_writer(Vec::new());
        csv.write_record([
            "index",
            "theta_i",
            "phi_i",
            "theta_o",
            "phi_o",
            "r",
            "g",
            "b",
            "quantity",
            "saturated",
            "times",
            "spread",
            "fitted_r",
            "fitted_g",
            "fitted_b",
            "expected_r",
            "expected_g",
            "expected_b",
            "z",
            "fate",
        ])?;
        for (index, angles) in self.pattern.iter().enumerate() {
            let arms = IsotropicAngles::from_angles(angles_to_f64(angles));
            let degrees = |angle: f64| format!("{:.5}", angle.to_degrees());
            let sample = &self.measured.samples[index];
            let prediction = self.fit.outlier_report.predictions[index];
            let rgb = |rgb: Option<[f32; 3]>| match rgb {
                Some(rgb) => rgb.map(|value| value.to_string()),
                None => Default::default(),
            };
            let mut row = vec![
                index.to_string(),
                degrees(arms.theta_i),
                "0".to_owned(),
                degrees(arms.theta_o),
                degrees(arms.phi.rem_euclid(std::f64::consts::TAU)),
            ];
            row.extend(rgb(sample.mean()));
            row.push(ReadingQuantity::Values(Quantity::Brdf).name().to_owned());
            row.push(u8::from(sample.saturated()).to_string());
            row.push(sample.count().to_string());
            row.push(
                coefficient_of_variation(sample)
                    .map_or_else(String::new, |spread| format!("{spread:.4}")),
            );
            row.extend(rgb(Some(self.material.brdf(*angles))));
            row.extend(rgb(prediction.map(|prediction| prediction.expected)));
            row.push(
                prediction.map_or_else(String::new, |prediction| format!("{:.2}", prediction.z)),
            );
            row.push(self.fit.statuses[index].name().to_owned());
            csv.write_record(row)?;
        }
        Ok(csv.into_inner().map_err(|error| error.into_error())?)
    }
}
