//! Fits that a device computed and sent.

use std::path::{Path, PathBuf};

use glimpse_core::geometry::Angles;
use glimpse_core::gonio::Repeated;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Residual;
use glimpse_materials::basis::angles_to_f64;
use glimpse_materials::untrusted::{escaped, escaped_json_error, read_at_most};
use serde::Deserialize;

use super::fit::{Fit, ReadingStatus, find_outliers};
use super::matching::IsotropicAngles;
use super::measurements::Measurements;

/// The maximum distance of a reading's directions from the recipe's, in radians. It allows for rounding by the device.
const ROUNDING_TOLERANCE: f64 = 1e-3;
/// The maximum size of a report in bytes, many times larger than the report of the longest scan.
const MAX_BYTES: u64 = 1 << 26;

/// A device's fit, as `trainer virtual-scanner --out` writes it.
#[derive(Clone, Debug, Deserialize)]
pub struct DeviceReport {
    /// The model's name.
    pub model: String,
    /// The recipe's checksum, eight hexadecimal digits.
    pub recipe: String,
    /// The model's parameters in its order. For Linear, they are the coefficients: m for red, then m for green, then m
    /// for blue, with m components.
    pub values: Vec<f32>,
    /// The readings; optional.
    #[serde(default)]
    readings: Vec<DeviceReading>,
    /// The residual of the fit at the readings; optional.
    #[serde(default)]
    residual: Option<Residual>,
}

/// A reading: angles in radians and the BRDF in linear RGB, sr^-1, not times the cosine.
#[derive(Clone, Copy, Debug, Deserialize)]
struct DeviceReading {
    theta_h: f64,
    theta_d: f64,
    phi_d: f64,
    brdf: [f32; 3],
    #[serde(default)]
    saturated: bool,
}

/// An error of a device's report.
#[derive(Debug, thiserror::Error)]
pub enum DeviceError {
    /// The operating system cannot read the file.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// The content does not have the format that `trainer virtual-scanner --out` writes.
    #[error(
        "{}: the file is not a device's report ({}); give JSON with model, recipe (a checksum), values, and optionally \
         readings and residual, as `trainer virtual-scanner --out` writes it", path.display(), escaped_json_error(source)
    )]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The error of the JSON parser.
        source: serde_json::Error,
    },
    /// The device used another recipe.
    #[error(
        "{}: the device used recipe {actual}, but the given recipe is {expected}; give the recipe that the device has",
        path.display()
    )]
    Recipe {
        /// The file.
        path: PathBuf,
        /// The checksum of the given recipe.
        expected: String,
        /// The recipe and the model in the report.
        actual: String,
    },
    /// A number is beyond the range of a 32-bit float.
    #[error(
        "{}: {field}[{index}] is beyond the range of a 32-bit float; scan again",
        path.display()
    )]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// The JSON key.
        field: &'static str,
        /// The index of the number, from 0.
        index: usize,
    },
    /// A reading does not match the recipe's pattern or is not finite.
    #[error(
        "{}: readings[{reading}]: {reason}; give the recipe that the device has, or remove the reading",
        path.display()
    )]
    Reading {
        /// The file.
        path: PathBuf,
        /// The index of the reading, from 0.
        reading: usize,
        /// The mismatch, or the error of the reading's value.
        reason: String,
    },
}

impl DeviceReport {
    /// Reads a file and checks that it belongs to a recipe.
    ///
    /// # Errors
    /// If the file cannot be read or belongs to another recipe.
    pub fn read(path: &Path, recipe: &Recipe<'_>) -> Result<Self, DeviceError> {
        let bytes = read_at_most(path, MAX_BYTES).map_err(|source| DeviceError::Read {
            path: path.into(),
            source,
        })?;
        let report: Self =
            serde_json::from_slice(&bytes).map_err(|source| DeviceError::Damaged {
                path: path.into(),
                source,
            })?;
        let expected = format!("{:08x}", recipe.checksum());
        if report.recipe != expected || report.model != recipe.model().name() {
            return Err(DeviceError::Recipe {
                path: path.into(),
                expected,
                actual: format!(
                    "{} of the model {}",
                    escaped(&report.recipe),
                    escaped(&report.model)
                ),
            });
        }
        let residual = report
            .residual
            .map(|residual| vec![residual.mean, residual.worst]);
        for (field, numbers) in [
            ("values", &report.values),
            ("residual", &residual.unwrap_or_default()),
        ] {
            if let Some(index) = numbers.iter().position(|number| !number.is_finite()) {
                return Err(DeviceError::NotFinite {
                    path: path.into(),
                    field,
                    index,
                });
            }
        }
        Ok(report)
    }

    /// Converts the report to measurements and a fit, both in the order of the recipe's samples.
    ///
    /// # Errors
    /// [`DeviceError::Reading`] if a reading does not match the pattern or is not finite.
    pub fn fit(self, path: &Path, recipe: &Recipe<'_>) -> Result<(Measurements, Fit), DeviceError> {
        let pattern: Vec<IsotropicAngles> = recipe
            .pattern()
            .map(|angles| IsotropicAngles::from_angles(angles_to_f64(&angles)))
            .collect();
        let mut measurements = Measurements {
            samples: vec![Repeated::new(); pattern.len()],
            rows: self.readings.len(),
            max_distance: None,
        };
        for (index, reading) in self.readings.iter().enumerate() {
            let error = |reason: String| DeviceError::Reading {
                path: path.into(),
                reading: index,
                reason,
            };
            let angles = IsotropicAngles::from_angles(Angles {
                theta_h: reading.theta_h,
                theta_d: reading.theta_d,
                phi_d: reading.phi_d,
            });
            let nearest = angles.nearest(&pattern);
            let sample = nearest.filter(|(_, distance)| distance.radians <= ROUNDING_TOLERANCE);
            let (sample, _) = sample.ok_or_else(|| {
                error(format!(
                    "no sample is within {ROUNDING_TOLERANCE} radians of theta_h {:.4}, theta_d {:.4}, phi_d {:.4}",
                    reading.theta_h, reading.theta_d, reading.phi_d
                ))
            })?;
            measurements.samples[sample]
                .add(reading.brdf, reading.saturated)
                .map_err(|cause| error(cause.to_string()))?;
        }
        let statuses = measurements
            .samples
            .iter()
            .map(|sample| match sample.count() {
                0 => ReadingStatus::Missing,
                _ if sample.saturated() && recipe.tolerates_missing() => ReadingStatus::Saturated,
                _ => ReadingStatus::Used,
            })
            .collect();
        let fit = Fit {
            values: self.values,
            residual: self.residual,
            prediction: None,
            statuses,
            partial_scans: Vec::new(),
            outlier_report: find_outliers(recipe, &measurements),
        };
        Ok((measurements, fit))
    }
}
