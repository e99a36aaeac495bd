//! `trainer next`

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use clap::Args;
use glimpse_fitting::linear::Posterior;
use glimpse_fitting::measurement::{
    LossScale, NamedRecipe, NextReading, PlannedReading, ReadingSet,
};
use glimpse_fitting::photo::next_lamps;
use glimpse_fitting::route::{MachineArgs, blank_directions};
use serde::Serialize;

use super::expected_loss::with_scale;
use super::fit::options::ReadingArgs;
use super::geometry::GeometryArgs;
use super::{LINEAR_ANY, emit, numbers};
use crate::output::{is_same_file, refuse_input, write_file};
use crate::report::Table;

/// Propose the directions to read next: those that reduce the expected loss most.
///
/// Give the readings so far, read the proposed directions, fill them in, and repeat, until the
/// upper bound of the loss is at most --target. Then `trainer fit` fits the same file. Without
/// readings, the first directions are proposed. Several directions (--count) are chosen as if the
/// earlier ones had their expected readings.
///
/// With a recipe of n samples, its own directions come first, and the bundled recipe MODEL-any
/// chooses the others. With --speed or --settle, a direction is chosen by the reduction per second
/// of motion and reading, and the arms are at the last reading (without readings: along the normal).
///
/// Readings are read as by `trainer fit`. The loss is that of `trainer evaluate`, next to those
/// of black, a good fit, and a just visible error.
///
/// Example: trainer next --blank scan.csv --count 4                   # fill in the readings, then
///          trainer next --measurements scan.csv --blank scan.csv --target 0.01
///          trainer next linear-n4.recipe --measurements scan.csv --speed 20,10,20,10 --max-theta-o 80
///          trainer next --measurements scan.csv --in-plane --count 3 --json
///          trainer next --measurements paint.csv --geometry paint-lab      # which instrument
///          trainer next --measurements photos.csv --geometry photo         # where the lamp stands
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Next {
    /// Recipe file, with its basis file NAME.basis next to it, if it has one, or the name of a bundled
    /// recipe
    #[arg(default_value = LINEAR_ANY)]
    recipe: PathBuf,
    /// Readings so far: CSV, as for `trainer fit` [default: none]
    #[arg(long, value_name = "FILE.csv")]
    measurements: Option<PathBuf>,
    /// Number of directions, 1 to 256
    #[arg(long, value_name = "K", default_value_t = 1, value_parser = numbers::number(1..=256_usize))]
    count: usize,
    /// Propose nothing once the upper bound of the loss is at most L, above 0
    #[arg(long, value_name = "L", value_parser = numbers::number(1e-6..=10.0))]
    target: Option<f64>,
    #[command(flatten)]
    machine: MachineArgs,
    #[command(flatten)]
    geometry: GeometryArgs,
    #[command(flatten)]
    readings: ReadingArgs,
    /// CSV file for a blank sheet of the proposed readings: theta_i, phi_i, theta_o, phi_o (degrees; in one
    /// plane theta_i, theta_o), r, g, b. A sheet of --measurements gets further rows
    #[arg(long, value_name = "FILE.csv")]
    blank: Option<PathBuf>,
    /// Replace an existing file that differs, such as a filled-in sheet
    #[arg(long, requires = "blank")]
    force: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// The readings so far, and the proposed directions.
#[derive(Serialize)]
struct Report {
    /// The number of different directions that were read.
    readings: usize,
    /// The expected loss of a fit of the readings so far.
    expected_loss: f32,
    /// Its upper bound, which holds for 90 % of materials.
    bound: f32,
    /// Losses to compare it with.
    loss_scale: LossScale,
    /// The target.
    target: Option<f64>,
    /// True if the bound is at most the target; None without a target.
    is_target_reached: Option<bool>,
    directions: Vec<NextReading>,
}

impl Next {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        let given = NamedRecipe::read(&self.recipe)?;
        let is_appended = match (&self.blank, &self.measurements) {
            (Some(blank), Some(measurements)) => is_same_file(blank, measurements),
            _ => false,
        };
        ensure!(
            !(self.force && is_appended),
            "--force has no effect where --blank adds rows to --measurements: remove it"
        );
        if let (Some(blank), Some(white)) = (&self.blank, &self.readings.white) {
            refuse_input(blank, white)?;
        }
        let machine = given.machine(&self.machine)?;
        let any = given.continuing();
        let planned = self.geometry.of_instruments();
        let is_photo = self.geometry.is_photo();
        ensure!(
            planned.is_none() && !is_photo || self.machine == MachineArgs::default(),
            "options of a machine have no effect on the instruments of --geometry: remove them"
        );
        ensure!(
            !is_photo || self.blank.is_none(),
            "--blank has no effect on --geometry photo: remove it"
        );
        ensure!(
            planned.is_some() || is_photo || self.geometry.geometry.is_none(),
            "--geometry: name instruments; give the limits of a goniometer as options, such as --in-plane"
        );
        let (posterior, measured, taken) = match &self.measurements {
            None => {
                ensure!(
                    !self.readings.is_given(),
                    "options of readings have no effect without --measurements: remove them"
                );
                let posterior = Posterior::new(&any.prior, &[]);
                let posterior = posterior.context("the recipe's prior is not finite")?;
                (posterior, Vec::new(), Vec::new())
            }
            Some(path) => {
                // Also with readings that are unlike the others, which reduce the loss most.
                let fit = self.readings.fit(&any, self.readings.rows(path)?, true)?;
                if let Some(doubt) = fit.doubt {
                    eprintln!("{}: {doubt}", path.display());
                }
                let readings = fit.selection.readings;
                let instruments = readings
                    .samples
                    .iter()
                    .map(|sample| sample.optics.instrument);
                let taken = instruments.collect::<Vec<_>>();
                (fit.selection.posterior, readings.pattern(), taken)
            }
        };
        let so_far = posterior.expected_loss();
        let bound = so_far.bound.unwrap_or(f32::INFINITY);
        let is_target_reached = self.target.map(|target| f64::from(bound) <= target);
        let count = match is_target_reached {
            Some(true) => 0,
            _ => self.count,
        };
        let so_far_and_measured = (&posterior, &measured[..]);
        let (sheet, directions) = if is_photo {
            (String::new(), next_lamps(&posterior, count))
        } else if let Some(planned) = planned {
            let next = PlannedReading::next(&planned, so_far_and_measured, &taken, count);
            let (planned, next): (Vec<_>, Vec<_>) = next.into_iter().unzip();
            (ReadingSet::blank_sheet(&planned), next)
        } else {
            let has_seconds = self.machine.position(machine).is_some();
            let proposals = given.next(&self.machine, so_far_and_measured, count)?;
            let in_plane = machine.limits.in_plane;
            let next = proposals.iter();
            let next = next.map(|one| NextReading::new(one, in_plane, has_seconds));
            let next: Vec<NextReading> = next.collect();
            let arms = next.iter().filter_map(|next| next.arms);
            (blank_directions(&arms.collect::<Vec<_>>()), next)
        };
        ensure!(
            count == 0 || !directions.is_empty(),
            "all readings are taken, or outside the limits ({}): widen them, or name other instruments",
            super::limits::describe(machine.limits)
        );
        let report = Report {
            readings: posterior.readings(),
            expected_loss: so_far.loss,
            bound,
            loss_scale: LossScale::of(&posterior),
            target: self.target,
            is_target_reached,
            directions,
        };
        if let (Some(path), false) = (&self.blank, report.directions.is_empty()) {
            let sheet = if is_appended {
                appended(path, &sheet)?
            } else {
                sheet
            };
            write_file(path, sheet.as_bytes(), self.force || is_appended)?;
        }
        let table = Table::of_records("proposals", &report.directions)?;
        emit(self.json, &report, || report.to_text(&table))
    }
}

/// Returns the text of a file of readings with the rows of a blank sheet that it lacks.
fn appended(path: &Path, sheet: &str) -> anyhow::Result<String> {
    let mut text = fs::read_to_string(path)
        .with_context(|| format!("cannot read {}", path.display()))?
        .trim_end()
        .to_owned();
    let mut rows = sheet.lines();
    let header = rows.next();
    ensure!(
        text.lines().next() == header,
        "--blank {}: only a sheet with the columns {} takes further rows; give another file",
        path.display(),
        header.unwrap_or_default()
    );
    for row in rows {
        if text.lines().all(|known| known != row) {
            text += "\n";
            text += row;
        }
    }
    Ok(text + "\n")
}

impl Report {
    /// Formats the report for the terminal, with a table of the directions.
    fn to_text(&self, table: &Table) -> String {
        let text = format!(
            "readings       {}\nexpected loss  {}\n",
            self.readings,
            with_scale(self.expected_loss, Some(self.bound), &self.loss_scale)
        );
        let target = match (self.target, self.is_target_reached) {
            (None, _) => String::new(),
            (Some(target), Some(true)) => {
                return format!(
                    "{text}target         {target}, reached: fit the readings with `trainer fit`\n"
                );
            }
            (Some(target), _) => format!("target         {target}, not reached\n"),
        };
        format!("{text}{target}\n{}", table.to_markdown())
    }
}
