//! The option `--geometry`: directions for a recipe without a pattern.

use std::convert::Infallible;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;

use anyhow::{Context, bail, ensure};
use clap::{Args, ValueEnum};
use glimpse_core::geometry::Angles;
use glimpse_fitting::measurement::{AngleArgs, AngleTable, ChosenRecipe, Instrument, NamedRecipe};
use glimpse_training::recipe::RecipeFile;

use super::{recipe_or_bundled, require_pattern};

/// Directions of readings.
#[derive(Clone, Debug)]
enum Geometry {
    Instrument(Instrument),
    File(PathBuf),
}

impl FromStr for Geometry {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<Self, Infallible> {
        let instrument = Instrument::from_str(text, true);
        Ok(instrument.map_or_else(|_| Self::File(text.into()), Self::Instrument))
    }
}

/// Directions for a recipe of `train --samples any`.
#[derive(Args)]
pub(crate) struct GeometryArgs {
    /// Directions for a recipe of `train --samples any`: those of an instrument (multi-angle: light at 45
    /// degrees and six aspecular angles; multi-angle-gloss: and gloss at 20, 60 and 80; in-plane: a line at
    /// theta_i = 45; five-lines), or of a CSV file, in degrees
    #[arg(long, value_name = "INSTRUMENT|FILE.csv")]
    geometry: Option<Geometry>,
}

impl GeometryArgs {
    /// Reads a recipe like [`read`](Self::read), without its basis if it has a pattern.
    pub(crate) fn read_file(&self, path: Option<&Path>) -> anyhow::Result<Arc<RecipeFile>> {
        match (path, &self.geometry) {
            (Some(path), None) => read_with_pattern(path),
            _ => Ok(self.read(path)?.recipe.file),
        }
    }

    /// Reads a recipe, the bundled linear-any without a path. One without a pattern gets that of --geometry.
    pub(crate) fn read(&self, path: Option<&Path>) -> anyhow::Result<ChosenRecipe> {
        let named = recipe_or_bundled(path)?;
        let Some(geometry) = &self.geometry else {
            require_pattern(&named.file, &named.name)?;
            return named.itself().context("the program lacks linear-any");
        };
        ensure!(
            named.is_any(),
            "--geometry has no effect, because {} has directions of its own: remove it",
            named.name
        );
        let directions = geometry.directions()?;
        named.at(&directions, &[]).with_context(|| {
            format!(
                "--geometry: {} directions are too many; give at most 4096",
                directions.len()
            )
        })
    }
}

/// Reads a recipe for a command that needs a pattern.
pub(crate) fn read_with_pattern(path: &Path) -> anyhow::Result<Arc<RecipeFile>> {
    let file = NamedRecipe::read_file(path)?;
    require_pattern(&file, &path.display().to_string())?;
    Ok(file)
}

impl Geometry {
    fn directions(&self) -> anyhow::Result<Vec<Angles<f32>>> {
        match self {
            Self::Instrument(instrument) => Ok(instrument.directions(0.0)),
            Self::File(path) => read_directions(path).context("--geometry names a file"),
        }
    }
}

/// Reads a file of directions, at least one.
pub(crate) fn read_directions(path: &Path) -> anyhow::Result<Vec<Angles<f32>>> {
    let table = AngleTable::read(path, &AngleArgs::default())?;
    let rows = table.rows.into_iter().zip(1..).map(|(row, number)| {
        row.angles.with_context(|| {
            let path = path.display();
            format!("{path}: row {number} has a direction that is not above the horizon")
        })
    });
    let directions: Vec<_> = rows.collect::<anyhow::Result<_>>()?;
    match directions.is_empty() {
        true => bail!("{}: it has no rows; add directions", path.display()),
        false => Ok(directions),
    }
}
