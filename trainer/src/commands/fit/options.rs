//! What the numbers of a file are, by options.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use glimpse_core::geometry::Angles;
use glimpse_core::gonio::{Footprint, Quantity};
use glimpse_trainer::measurement::{Counts, Meaning, White};

use super::super::numbers::{channels, finite, reflectances};

/// What numbers are, as named on the command line.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum QuantityName {
    /// The BRDF, sr^-1.
    Brdf,
    /// The BRDF times cos(theta_i): radiance under a lamp that lights all that is seen.
    BrdfCosI,
    /// The BRDF times cos(theta_o), ASTM's cosine-corrected BSDF.
    #[value(alias = "brdf-cos")]
    BrdfCosO,
    /// pi times the BRDF: relative to a white of reflectance 1.
    ReflectanceFactor,
}

/// Whose spot on the sample is the larger, as named on the command line.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum FootprintName {
    /// The light's: all that the sensor sees is lit.
    Light,
    /// The sensor's: it sees all that is lit.
    Sensor,
}

/// What the numbers of a file are.
#[derive(Args)]
pub(super) struct MeaningArgs {
    /// What the numbers are [default: brdf]
    #[arg(long, value_enum, conflicts_with_all = ["white", "values"])]
    quantity: Option<QuantityName>,
    /// The numbers are counts, and here are those of a white tile: at the same directions, or one row
    /// and --footprint
    #[arg(long, value_name = "FILE.csv", conflicts_with = "values")]
    white: Option<PathBuf>,
    /// With --white: counts without light, of all channels or of each [default: 0]
    #[arg(long, value_name = "V[,V,V]", requires = "white", conflicts_with = "values", value_parser = channels)]
    dark: Option<[f32; 3]>,
    /// With --white: the tile's reflectance, above 0, at most 2 [default: 0.99]
    #[arg(long, value_name = "R[,R,R]", requires = "white", conflicts_with = "values", value_parser = reflectances)]
    white_reflectance: Option<[f32; 3]>,
    /// With --white: the count at and above which the sensor is saturated [default: none]
    #[arg(long, value_name = "LEVEL", requires = "white", conflicts_with = "values", value_parser = finite)]
    saturation: Option<f32>,
    /// With --white of one row: whose spot on the sample is the larger at all angles, which tells
    /// by which cosine counts go
    #[arg(long, value_enum, requires = "white", conflicts_with = "values")]
    footprint: Option<FootprintName>,
}

impl MeaningArgs {
    /// The file of white readings.
    pub(super) fn white(&self) -> Option<&Path> {
        self.white.as_deref()
    }

    /// Reads what is needed.
    pub(super) fn read(&self, pattern: &[Angles<f32>], tolerance: f64) -> anyhow::Result<Meaning> {
        let Some(white) = &self.white else {
            return Ok(Meaning::Values(match self.quantity {
                None | Some(QuantityName::Brdf) => Quantity::Brdf,
                Some(QuantityName::BrdfCosI) => Quantity::BrdfTimesCosThetaI,
                Some(QuantityName::BrdfCosO) => Quantity::BrdfTimesCosThetaO,
                Some(QuantityName::ReflectanceFactor) => Quantity::ReflectanceFactor,
            }));
        };
        let footprint = self.footprint.map(|footprint| match footprint {
            FootprintName::Light => Footprint::LightLarger,
            FootprintName::Sensor => Footprint::SensorLarger,
        });
        Ok(Meaning::Counts(Counts {
            dark: self.dark.unwrap_or([0.0; 3]),
            reflectance: self.white_reflectance.unwrap_or([0.99; 3]),
            saturation: self.saturation,
            white: White::read(white, pattern, tolerance, footprint)?,
        }))
    }
}
