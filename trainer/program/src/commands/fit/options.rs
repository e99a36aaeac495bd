//! Options for the quantity of readings: the BRDF, a multiple of it, or counts.

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use glimpse_core::geometry::Angles;
use glimpse_core::gonio::Footprint;
use glimpse_fitting::measurement::{
    AngleArgs, CountCalibration, FOOTPRINTS, Multiple, QUANTITIES, ReadingQuantity, Rows,
    WhiteReference,
};

use super::super::choice::choice;
use super::super::numbers::{channels, finite, reflectances};

/// Options for the quantity of readings.
#[derive(Args)]
pub(crate) struct QuantityArgs {
    /// Quantity of the readings: the BRDF, sr^-1; the BRDF times cos(theta_i), the radiance under a lamp
    /// that lights the sensor's whole spot; the BRDF times cos(theta_o), also called brdf-cos, ASTM's
    /// cosine-corrected BSDF; or pi times the BRDF, the radiance relative to that of a white tile, also in
    /// percent [default: the column quantity, or else brdf]
    #[arg(long, value_parser = choice(&QUANTITIES, &[("brdf-cos", "brdf-cos-o")]), conflicts_with_all = ["white", "dark", "saturation", "footprint"])]
    quantity: Option<Multiple>,
    /// CSV file of counts on a white tile, if the readings are counts: at the same directions, or in a
    /// single row with --footprint
    #[arg(long, value_name = "FILE.csv")]
    white: Option<PathBuf>,
    /// With --white: count without light, one for all channels or one for each [default: 0]
    #[arg(long, value_name = "V[,V,V]", requires = "white", value_parser = channels)]
    dark: Option<[f32; 3]>,
    /// Reflectance of the tile, above 0 and at most 2 [default: 0.99 with --white, 1 for reflectance
    /// factors]
    #[arg(long, value_name = "R[,R,R]", value_parser = reflectances)]
    white_reflectance: Option<[f32; 3]>,
    /// With --white: smallest count of a saturated sensor [default: none]
    #[arg(long, value_name = "LEVEL", requires = "white", value_parser = finite)]
    saturation: Option<f32>,
    /// With --white of a single row: spot on the material that is larger at all angles. The light's spot
    /// covers all that the sensor sees, or the sensor's spot covers all that is lit. It determines the
    /// cosine in the counts
    #[arg(long, value_parser = choice(&FOOTPRINTS, &[]), requires = "white")]
    footprint: Option<Footprint>,
}

impl QuantityArgs {
    /// Returns true if an option was given.
    pub(crate) fn is_given(&self) -> bool {
        self.quantity.is_some() || self.white.is_some()
    }

    /// Returns the path of --white.
    pub(crate) fn white(&self) -> Option<&Path> {
        self.white.as_deref()
    }

    /// Returns the quantity of these options, or else that of the file. Reads the file of --white.
    pub(crate) fn read(
        &self,
        pattern: &[Angles<f32>],
        angles: &AngleArgs,
        rows: &Rows,
    ) -> anyhow::Result<ReadingQuantity> {
        let Some(white) = &self.white else {
            let stated = ReadingQuantity::stated(rows);
            let quantity = self
                .quantity
                .map(|multiple| ReadingQuantity::Values(multiple, 1.0));
            let quantity = quantity.unwrap_or(stated);
            let Some(reflectance) = self.white_reflectance else {
                return Ok(quantity);
            };
            let relative = quantity.relative_to(reflectance);
            return relative.context(
                "--white-reflectance needs --white, or it is one number, and --quantity is a reflectance factor",
            );
        };
        Ok(ReadingQuantity::Counts(CountCalibration::new(
            WhiteReference::read(white, angles, pattern, self.footprint)?,
            self.dark,
            self.white_reflectance,
            self.saturation,
        )))
    }
}
