//! Options for the quantity of readings: the BRDF, a multiple of it, or counts.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use glimpse_core::geometry::Angles;
use glimpse_core::gonio::{Footprint, Quantity};
use glimpse_trainer::measurement::{CountCalibration, ReadingQuantity, WhiteReference};

use super::super::numbers::{channels, finite, reflectances};

/// A quantity, as named on the command line.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum QuantityName {
    /// The BRDF, sr^-1.
    Brdf,
    /// The BRDF times cos(theta_i): radiance under a lamp that lights the sensor's whole spot.
    BrdfCosI,
    /// The BRDF times cos(theta_o), ASTM's cosine-corrected BSDF.
    #[value(alias = "brdf-cos")]
    BrdfCosO,
    /// pi times the BRDF: relative to a perfect white diffuser.
    ReflectanceFactor,
}

/// The larger spot on the material, as named on the command line.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum FootprintName {
    /// The light's spot: it covers all that the sensor sees.
    Light,
    /// The sensor's spot: it covers all that is lit.
    Sensor,
}

/// Options for the quantity of readings.
#[derive(Args)]
pub(super) struct QuantityArgs {
    /// Quantity of the readings [default: brdf]
    #[arg(long, value_enum, conflicts_with_all = ["white", "values"])]
    quantity: Option<QuantityName>,
    /// CSV file of counts on a white tile, if the readings are counts: at the same directions, or in a
    /// single row with --footprint
    #[arg(long, value_name = "FILE.csv", conflicts_with = "values")]
    white: Option<PathBuf>,
    /// With --white: count without light, one for all channels or one for each [default: 0]
    #[arg(long, value_name = "V[,V,V]", requires = "white", conflicts_with = "values", value_parser = channels)]
    dark: Option<[f32; 3]>,
    /// With --white: reflectance of the tile, above 0 and at most 2 [default: 0.99]
    #[arg(long, value_name = "R[,R,R]", requires = "white", conflicts_with = "values", value_parser = reflectances)]
    white_reflectance: Option<[f32; 3]>,
    /// With --white: smallest count of a saturated sensor [default: none]
    #[arg(long, value_name = "LEVEL", requires = "white", conflicts_with = "values", value_parser = finite)]
    saturation: Option<f32>,
    /// With --white of a single row: spot on the material that is larger at all angles. It determines
    /// the cosine in the counts
    #[arg(long, value_enum, requires = "white", conflicts_with = "values")]
    footprint: Option<FootprintName>,
}

impl QuantityArgs {
    /// Returns the path of --white.
    pub(super) fn white(&self) -> Option<&Path> {
        self.white.as_deref()
    }

    /// Returns the quantity of these options. Reads the file of --white, with a tolerance in radians.
    pub(super) fn read(
        &self,
        pattern: &[Angles<f32>],
        tolerance: f64,
    ) -> anyhow::Result<ReadingQuantity> {
        let Some(white) = &self.white else {
            return Ok(ReadingQuantity::Values(match self.quantity {
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
        Ok(ReadingQuantity::Counts(CountCalibration {
            dark: self.dark.unwrap_or([0.0; 3]),
            reflectance: self.white_reflectance.unwrap_or([0.99; 3]),
            saturation: self.saturation,
            white: WhiteReference::read(white, pattern, tolerance, footprint)?,
        }))
    }
}
