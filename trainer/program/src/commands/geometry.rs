//! The option `--geometry`: directions for a recipe without a pattern.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, ensure};
use clap::Args;
use glimpse_core::geometry::Angles;
use glimpse_fitting::measurement::{AngleArgs, AngleTable, Geometry, NamedRecipe, ReadingSet};
use glimpse_fitting::recipe::RecipeFile;

use super::{read_recipe, require_pattern};

/// Directions for a recipe of `train --samples any`.
#[derive(Args)]
pub(crate) struct GeometryArgs {
    /// Directions for a recipe of `train --samples any`: those of an instrument (multi-angle: light at 45
    /// degrees and six aspecular angles; multi-angle-gloss: and gloss at 20, 60 and 80; in-plane: a line at
    /// theta_i = 45; five-lines), or of a CSV file, in degrees
    #[arg(long, value_name = "INSTRUMENT|FILE.csv")]
    geometry: Option<PathBuf>,
}

impl GeometryArgs {
    /// Reads a recipe like [`read`](Self::read), without its basis if it has a pattern.
    pub(crate) fn read_file(&self, path: &Path) -> anyhow::Result<Arc<RecipeFile>> {
        if self.geometry.is_some() {
            return Ok(self.read(path)?.file);
        }
        let file = NamedRecipe::read_file(path)?;
        require_pattern(&file, &path.display().to_string())?;
        Ok(file)
    }

    /// Reads a recipe. One without a pattern gets that of --geometry.
    pub(crate) fn read(&self, path: &Path) -> anyhow::Result<NamedRecipe> {
        let Some(geometry) = &self.geometry else {
            return read_recipe(path);
        };
        let named = NamedRecipe::read(path)?;
        ensure!(
            named.is_any(),
            "--geometry has no effect, because {} has directions of its own: remove it",
            named.name
        );
        let recipe = named.at_geometries(&geometries(geometry)?);
        recipe.context("--geometry")
    }
}

/// Returns the readings of instruments, or else the directions of a file.
fn geometries(geometry: &Path) -> anyhow::Result<Vec<Geometry>> {
    let name = geometry.to_str().unwrap_or_default();
    if let Some(sets) = ReadingSet::parse(name) {
        return Ok(ReadingSet::geometries(&sets, 0.0));
    }
    let directions = read_directions(geometry).context("--geometry names a file")?;
    Ok(directions.into_iter().map(Geometry::exact).collect())
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
    ensure!(
        !directions.is_empty(),
        "{}: it has no rows; add directions",
        path.display()
    );
    Ok(directions)
}
