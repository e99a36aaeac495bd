//! Options of readings: their angles, and their quantity, which is the BRDF, a multiple of it, or counts.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use clap::Args;
use glimpse_core::gonio::Footprint;
use glimpse_fitting::measurement::{
    CountCalibration, LargerSpot, MaterialFit, Multiple, NamedRecipe, ReadingQuantity, ReadingRows,
    Readings, TableArgs, TableError,
};
use glimpse_materials::{COLOR_BANDS, Illuminant, Observer, Viewing, have_color};

use super::super::numbers::{channels, finite, number, reflectances};

/// Options of readings.
#[derive(Args)]
pub(crate) struct ReadingArgs {
    #[command(flatten)]
    table: TableArgs,
    /// Quantity of the readings: the BRDF, sr^-1; the BRDF times cos(theta_i), the radiance under a lamp
    /// that lights the sensor's whole spot; the BRDF times cos(theta_o), also called brdf-cos, ASTM's
    /// cosine-corrected BSDF; the BRDF times both cosines; or pi times the BRDF, the radiance relative to
    /// that of a white tile, also in percent or encoded as sRGB [default: the column quantity, or else brdf]
    #[arg(long, value_enum, conflicts_with_all = ["white", "dark", "saturation", "footprint"])]
    quantity: Option<Multiple>,
    /// CSV file of counts on a white tile, if the readings are counts: at the same directions, or in a
    /// single row with --footprint
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) white: Option<PathBuf>,
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
    #[arg(long, value_enum, requires = "white")]
    footprint: Option<LargerSpot>,
    /// Standard deviation of each reading's noise, relative to the reading, 0 to 1, at any directions
    /// [default: the column noise, or else from repeated readings, or else 0.02]
    #[arg(long, value_name = "S", value_parser = number(0.0..=1.0_f32))]
    noise: Option<f32>,
    /// Accept readings that are unlikely to come from a material, or more likely if they are read otherwise
    #[arg(long)]
    accept_implausible: bool,
}

/// Options for colors of bands, and of readings in CIELAB.
#[derive(Args)]
pub(super) struct ViewingArgs {
    /// With bands or readings in CIELAB: its illuminant [default: d65]
    #[arg(long, value_enum)]
    illuminant: Option<Illuminant>,
    /// With bands or readings in CIELAB: its observer, degrees [default: 2 of bands, 10 of readings]
    #[arg(long, value_enum)]
    observer: Option<Observer>,
}

impl ReadingArgs {
    /// Returns true if an option was given.
    pub(crate) fn is_given(&self) -> bool {
        self.quantity.is_some()
            || self.white.is_some()
            || self.noise.is_some()
            || self.accept_implausible
            || self.table != TableArgs::default()
    }

    /// Reads a file of readings.
    pub(crate) fn rows(&self, path: &Path) -> Result<ReadingRows, TableError> {
        let mut rows = ReadingRows::read(path, &self.table)?;
        rows.noise = self.noise;
        Ok(rows)
    }

    /// Reads a file of readings of several materials, one for each text of a column.
    pub(super) fn rows_by(&self, path: &Path, by: &str) -> Result<Vec<ReadingRows>, TableError> {
        let mut all = ReadingRows::read_by(path, &self.table, by)?;
        all.iter_mut().for_each(|rows| rows.noise = self.noise);
        Ok(all)
    }

    /// Fits the rows of a file. The material has its name.
    pub(crate) fn fit(
        &self,
        given: &NamedRecipe,
        rows: ReadingRows,
        keep_all: bool,
    ) -> anyhow::Result<MaterialFit> {
        let (path, name) = (rows.path.display().to_string(), rows.name.clone());
        for name in &self.table.ignore {
            ensure!(
                rows.summary.ignores(name),
                "{path}: --ignore {name} has no effect, because the file has no such column: remove it"
            );
        }
        let quantity = self.quantity(&rows)?;
        let readings = Readings::new(given, rows, quantity)?;
        let fit = MaterialFit::new(readings, name, keep_all).with_context(|| path.clone())?;
        if let (false, Err(failure)) = (self.accept_implausible, fit.check_plausible()) {
            bail!("{path}: {failure}, or --accept-implausible to fit the readings as they are");
        }
        Ok(fit)
    }

    /// Returns the quantity of these options, or else that of the file. Reads the file of --white.
    fn quantity(&self, rows: &ReadingRows) -> anyhow::Result<ReadingQuantity> {
        if let Some(white) = &self.white {
            return Ok(ReadingQuantity::Counts(CountCalibration {
                dark: self.dark,
                reflectance: self.white_reflectance,
                saturation: self.saturation,
                white: self.rows(white)?,
                footprint: self.footprint.map(Footprint::from),
            }));
        }
        let quantity = ReadingQuantity::of_values(self.quantity, self.white_reflectance, rows);
        quantity.context(
            "--white-reflectance needs --white, or it is one number, and --quantity is a reflectance factor",
        )
    }
}

impl ViewingArgs {
    /// Returns the viewing of colors, and makes it that of readings in CIELAB.
    ///
    /// # Errors
    /// If an option was given, but the rows have neither CIELAB nor bands with a color.
    pub(super) fn viewing(&self, rows: &mut ReadingRows) -> anyhow::Result<Viewing> {
        let is_given = self.illuminant.is_some() || self.observer.is_some();
        ensure!(
            !is_given || rows.cielab.is_some() || have_color(&rows.wavelengths),
            "{}: --illuminant and --observer have no effect without CIELAB or {COLOR_BANDS}: remove them",
            rows.path.display()
        );
        let default = rows.cielab.unwrap_or_default();
        let viewing = Viewing {
            illuminant: self.illuminant.unwrap_or(default.illuminant),
            observer: self.observer.unwrap_or(default.observer),
        };
        rows.cielab = rows.cielab.map(|_| viewing);
        Ok(viewing)
    }
}
