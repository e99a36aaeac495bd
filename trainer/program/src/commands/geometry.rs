//! The option `--geometry`: directions for a recipe without a pattern.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, ensure};
use clap::Args;
use glimpse_core::geometry::Angles;
use glimpse_fitting::measurement::{
    AngleArgs, AngleTable, Geometry, NamedRecipe, PlannedReading, ReadingSet,
};
use glimpse_fitting::recipe::RecipeFile;

use super::{read_recipe, require_pattern};

/// Directions for a recipe of `train --samples any`.
#[derive(Args)]
pub(crate) struct GeometryArgs {
    /// Readings for a recipe of `train --samples any`, separated by commas: those of instruments (gloss-20,
    /// gloss-60, gloss-85, sci, sce, 45:0, 0:45, multi-angle at six aspecular angles, or paint-lab for all
    /// but 45:0 and 0:45), in-plane (a line at theta_i = 45), five-lines, or those of a CSV file, in degrees;
    /// or photo (of a ball, for plan and next)
    #[arg(long, value_name = "INSTRUMENT,...|FILE.csv")]
    pub(super) geometry: Option<PathBuf>,
}

impl GeometryArgs {
    /// Returns true for photographs of a ball.
    pub(crate) fn is_photo(&self) -> bool {
        self.geometry.as_deref() == Some(Path::new("photo"))
    }

    /// Returns the readings of --geometry, if those of an instrument are among them.
    pub(crate) fn of_instruments(&self) -> Option<Vec<PlannedReading>> {
        let sets = ReadingSet::parse(self.geometry.as_ref()?.to_str()?)?;
        let has_instrument = sets.iter().any(|set| matches!(set, ReadingSet::Of(_)));
        let readings = sets.into_iter().flat_map(ReadingSet::readings);
        has_instrument.then(|| readings.collect())
    }

    /// Reads a recipe like [`read`](Self::read), without its basis if it has a pattern. All readings are at exact directions.
    pub(crate) fn read_file(&self, path: &Path) -> anyhow::Result<Arc<RecipeFile>> {
        if self.geometry.is_some() {
            let named = self.read(path)?;
            ensure!(
                named.apertures.iter().all(Option::is_none),
                "--geometry: devices read exact directions, and these instruments have apertures; give a file of directions"
            );
            return Ok(named.file);
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
