//! What a device has found by itself, and sent.

use std::path::{Path, PathBuf};

use glimpse_core::geometry::Angles;
use glimpse_core::gonio::Repeated;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Residual;
use glimpse_materials::basis::widened;
use glimpse_materials::untrusted::{escaped, in_short, read_at_most};
use serde::Deserialize;

use super::fit::{Fit, ReadingStatus, examine};
use super::matching::Arms;
use super::measured::Measured;

/// How far the directions that a device asked for may be from its recipe's, radians: rounding.
const ROUNDING: f64 = 1e-3;
/// The longest file that is read: many times what the longest scan leaves.
const MOST_BYTES: u64 = 1 << 26;

/// What a device has found, as `trainer virtual-scanner --out` writes it.
#[derive(Clone, Debug, Deserialize)]
pub struct DeviceReport {
    /// The name of the model.
    pub model: String,
    /// The checksum of the recipe, eight digits of hex.
    pub recipe: String,
    /// A model's parameters in its order, or Linear's coefficients, m for red, m for green, m for
    /// blue.
    pub values: Vec<f32>,
    /// What it read; may be left out.
    #[serde(default)]
    readings: Vec<DeviceReading>,
    /// How well the values explain that; may be left out.
    #[serde(default)]
    residual: Option<Residual>,
}

/// A reading: angles in radians, the BRDF in linear RGB, sr^-1.
#[derive(Clone, Copy, Debug, Deserialize)]
struct DeviceReading {
    theta_h: f64,
    theta_d: f64,
    phi_d: f64,
    brdf: [f32; 3],
    #[serde(default)]
    saturated: bool,
}

/// Why what a device sent cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum DeviceError {
    /// The operating system refuses.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// It is not what `trainer virtual-scanner --out` writes.
    #[error(
        "{}: it is not what a device sent ({}): expected JSON with model, recipe (a \
         checksum), values, and perhaps readings and residual, as `trainer virtual-scanner --out` \
         writes it", path.display(), in_short(source)
    )]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Why.
        source: serde_json::Error,
    },
    /// It was fitted by another recipe.
    #[error(
        "{}: it was fitted by the recipe {found}, and this one is {expected}: give the recipe \
         that the device has", path.display()
    )]
    Recipe {
        /// The file.
        path: PathBuf,
        /// The checksum of the recipe that is there.
        expected: String,
        /// The one that is named.
        found: String,
    },
    /// A number is too large to be one.
    #[error(
        "{}: number {index} (from 0) of its {field} is beyond what 32-bit floats hold; send it again",
        path.display()
    )]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// The entry of the JSON.
        field: &'static str,
        /// Which number.
        index: usize,
    },
    /// A reading is not of the recipe's pattern, or no number.
    #[error(
        "{}: reading {reading} (from 0) is none of the recipe's samples: {what}; give the recipe \
         that the device has, or leave the reading out", path.display()
    )]
    Reading {
        /// The file.
        path: PathBuf,
        /// Which one.
        reading: usize,
        /// What is wrong with it.
        what: String,
    },
}

impl DeviceReport {
    /// Reads a file, and makes sure that it is a recipe's.
    ///
    /// # Errors
    /// If it cannot be read, or is of another recipe.
    pub fn read(path: &Path, recipe: &Recipe<'_>) -> Result<Self, DeviceError> {
        let bytes = read_at_most(path, MOST_BYTES).map_err(|source| DeviceError::Read {
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
                found: format!(
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

    /// What it read, by the samples of the recipe, and what it found.
    ///
    /// # Errors
    /// [`DeviceError::Reading`]
    pub fn fit(self, path: &Path, recipe: &Recipe<'_>) -> Result<(Measured, Fit), DeviceError> {
        let pattern = recipe.pattern().map(|angles| Arms::of(widened(&angles)));
        let pattern: Vec<Arms> = pattern.collect();
        let mut measured = Measured {
            samples: vec![Repeated::new(); pattern.len()],
            rows: self.readings.len(),
            furthest: None,
        };
        for (reading, taken) in self.readings.iter().enumerate() {
            let none = |what: String| DeviceError::Reading {
                path: path.into(),
                reading,
                what,
            };
            let place = Arms::of(Angles {
                theta_h: taken.theta_h,
                theta_d: taken.theta_d,
                phi_d: taken.phi_d,
            });
            let nearest = place.nearest(&pattern);
            let sample = nearest.filter(|(_, far)| far.largest <= ROUNDING);
            let (sample, _) = sample.ok_or_else(|| {
                none(format!(
                    "none is within {ROUNDING} radians of theta_h {:.4}, theta_d {:.4}, phi_d {:.4}",
                    taken.theta_h, taken.theta_d, taken.phi_d
                ))
            })?;
            let added = measured.samples[sample].add(taken.brdf, taken.saturated);
            added.map_err(|error| none(error.to_string()))?;
        }
        let fates = measured
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
            predicted_loss: None,
            fates,
            examined: examine(recipe, &measured),
        };
        Ok((measured, fit))
    }
}
