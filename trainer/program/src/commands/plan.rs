//! `trainer plan`

use std::path::{PathBuf, absolute};

use anyhow::{Context, ensure};
use clap::{ArgGroup, Args};
use glimpse_fitting::choice::Choice;
use glimpse_fitting::linear::Posterior;
use glimpse_fitting::measurement::{Instrument, NamedRecipe, PlannedReading, ReadingSet};
use glimpse_fitting::photo::next_lamps;
use glimpse_fitting::route::{Order, PlanArgs};
use serde_json::json;

use super::geometry::GeometryArgs;
use super::{LINEAR_ANY, emit};
use crate::output::{is_same_file, refuse_recipe, write_file, write_files};
use crate::report::Table;

/// Plan a scan: positions of the arms in degrees, their order, and the duration.
///
/// All axes move at once, each at full speed: a move takes as long as its slowest axis. Then the
/// arms rest for the reading. The plan does not check for collisions, and does not include the
/// return to the start position.
///
/// The BRDF of an isotropic material depends only on the difference of the azimuths. Both azimuth
/// axes move at once to change this difference, the short way around. Each moves in proportion to
/// its speed, which takes the least time. Azimuths may exceed 180 degrees (see --no-full-turns).
/// A machine of two arms in one plane (--in-plane, or a recipe trained so) has no azimuths: plan and
/// sheet have theta_i and theta_o, which is negative on the light's side.
///
/// With instruments in --geometry, the report lists the readings to take instead of a route, and
/// the sheet of --blank has a row for each: instrument, theta_i, theta_o, r, g, b, value. Fill in
/// the displayed numbers: percent in r, g, b, or gloss units in value. `trainer fit` reads the sheet.
///
/// With --geometry photo, the report lists where to place the lamp for one to three photographs of a
/// ball, and the expected loss after each. `trainer next` goes on from readings.
///
/// If samples are out of the machine's reach, the error lists all of them, and nothing is planned.
///
/// Example: trainer plan neural-n8.recipe --speed 20,10,20,10 --settle 1.5 --blank readings.csv
///          trainer plan neural-n8.recipe --max-theta-o 85 --out plan.csv
///          trainer plan --geometry paint-lab --blank paint.csv            # hand-held instruments
///          trainer plan --geometry photo                                  # lamps around a ball
#[derive(Args)]
#[command(verbatim_doc_comment, group = ArgGroup::new("written").args(["out", "blank"]).multiple(true))]
pub(crate) struct Plan {
    /// Recipe file, or the name of a bundled recipe; linear-any needs --geometry
    #[arg(default_value = LINEAR_ANY)]
    recipe: PathBuf,
    #[command(flatten)]
    geometry: GeometryArgs,
    #[command(flatten)]
    request: PlanArgs,
    /// CSV file for the plan: index, theta_i, phi_i, theta_o, phi_o (degrees), seconds; in one plane
    /// without azimuths
    #[arg(long, short, value_name = "FILE.csv")]
    out: Option<PathBuf>,
    /// CSV file for a blank sheet of readings: index, theta_i, phi_i, theta_o, phi_o (degrees), r, g, b; in
    /// one plane without azimuths
    #[arg(long, value_name = "FILE.csv")]
    blank: Option<PathBuf>,
    /// Replace existing files that differ, such as filled-in sheets
    #[arg(long, requires = "written")]
    force: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

impl Plan {
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        self.refuse_inputs()?;
        if self.geometry.is_photo() {
            return self.list_lamps();
        }
        if let Some(readings) = self.geometry.of_instruments() {
            return self.list(&readings);
        }
        let file = self.geometry.read_file(&self.recipe)?;
        let recipe = file.recipe();
        let stated = file.metadata().machine();
        let (machine, route) = self.request.plan(&recipe, &stated, seed)?;
        if self.request.order == Some(Order::Progressive) && !recipe.tolerates_missing() {
            eprintln!(
                "note: this recipe needs all readings, so a scan cannot end early; --order travel takes \
                 less time"
            );
        }
        let sheets = [
            (&self.out, route.to_csv()),
            (&self.blank, route.blank_sheet()),
        ];
        let sheets = sheets.into_iter();
        let files = sheets.filter_map(|(path, text)| Some((path.clone()?, text.into_bytes())));
        write_files(&files.collect::<Vec<_>>(), self.force)?;
        let report = route.to_json(&machine);
        let table = Table::of_records("visits", &report["visits"])?;
        emit(self.json, &report, || {
            format!(
                "order          {}\nplanned        {:.1} seconds, including {:.1} of motion\nlimits         {}\n\n{}",
                route.order.name(),
                route.total(),
                route.travel,
                super::limits::describe(machine.limits),
                table.to_markdown()
            )
        })
    }

    /// Plans the lamps of photographs.
    fn list_lamps(&self) -> anyhow::Result<()> {
        let recipe = NamedRecipe::read(&self.recipe)?;
        ensure!(
            recipe.is_any()
                && self.request == PlanArgs::default()
                && self.out.is_none()
                && self.blank.is_none(),
            "--geometry photo needs a recipe for any directions, and takes only --json: give linear-any, and remove the other options"
        );
        let posterior = Posterior::new(&recipe.prior, &[]);
        let posterior = posterior.context("the recipe's prior is not finite")?;
        let report = json!({ "lamps": next_lamps(&posterior, LAMPS) });
        let table = Table::of_records("proposals", &report["lamps"])?;
        emit(self.json, &report, || table.to_markdown())
    }

    /// Plans the readings of hand-held instruments.
    fn list(&self, readings: &[PlannedReading]) -> anyhow::Result<()> {
        self.geometry.read(&self.recipe)?;
        ensure!(
            self.request == PlanArgs::default() && self.out.is_none(),
            "options of a machine, --order and --out have no effect on the instruments of --geometry: remove them"
        );
        if let Some(blank) = &self.blank {
            let sheet = ReadingSet::blank_sheet(readings);
            write_file(blank, sheet.as_bytes(), self.force)?;
        }
        let rows = readings.iter().map(|reading| {
            let aspecular = reading.degrees.map(|[theta_i, theta_o]| theta_i - theta_o);
            let gloss = reading.instrument.and_then(Instrument::brdf_of_gloss_unit);
            let unit = gloss.map_or("reflectance-percent", |_| "gloss-units");
            json!({ "instrument": reading.instrument, "aspecular": aspecular, "unit": unit })
        });
        let report = json!({ "readings": rows.collect::<Vec<_>>() });
        let table = Table::of_records("readings", &report["readings"])?;
        emit(self.json, &report, || table.to_markdown())
    }

    /// Refuses outputs that are inputs, or both the same file.
    fn refuse_inputs(&self) -> anyhow::Result<()> {
        for file in self.out.iter().chain(&self.blank) {
            refuse_recipe(file, &self.recipe)?;
        }
        if let (Some(out), Some(blank)) = (&self.out, &self.blank) {
            ensure!(
                !is_same_file(out, blank) && absolute(out)? != absolute(blank)?,
                "--out and --blank are the same file {}: give two different files",
                out.display()
            );
        }
        Ok(())
    }
}

/// The number of lamps.
const LAMPS: usize = 3;
