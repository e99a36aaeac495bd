//! `trainer plan`

use std::path::{PathBuf, absolute};

use anyhow::{Error, bail, ensure};
use clap::{ArgGroup, Args};
use glimpse_materials::basis::Basis;
use glimpse_training::recipe::RecipeFile;
use glimpse_training::route::{self, Axes, Machine, MachineError, Order, Route, stops};

use super::limits::{LimitArgs, describe};
use super::output::{is_same_file, write_files};
use super::{emit, numbers};

/// Plan a scan: positions of the arms in degrees, their order, and the duration.
///
/// All axes move at once, each at full speed: a move takes as long as its slowest axis. Then the
/// arms rest for the reading. The plan does not check for collisions, and does not include the
/// return to the start position.
///
/// The BRDF of an isotropic material depends only on the difference of the azimuths. Both azimuth
/// axes move at once to change this difference, the short way around. Each moves in proportion to
/// its speed, which takes the least time. Azimuths may exceed 180 degrees (see --no-full-turns).
///
/// If samples are out of the machine's reach, the error lists all of them, and nothing is planned.
///
/// Example: trainer plan neural-n8.recipe --speed 20,10,20,10 --settle 1.5 --blank readings.csv
///          trainer plan neural-n8.recipe --swap --max-theta-o 78 --out plan.csv
#[derive(Args)]
#[command(verbatim_doc_comment, group = ArgGroup::new("written").args(["out", "blank"]).multiple(true))]
pub(crate) struct Plan {
    /// Recipe file
    recipe: PathBuf,
    /// Order of the samples [default: progressive for recipes trained with --scan-seconds, whose own
    /// order is a fast path; travel for others]
    #[arg(long, value_enum)]
    order: Option<Order>,
    /// Speeds of the axes theta_i, phi_i, theta_o, phi_o in degrees per second, 0.001 to 1,000,000: one
    /// number for all axes, or four, for example 20,10,20,10. Speed 0 marks an azimuth axis that the
    /// machine does not have [default: the recipe's, or else 10]
    #[arg(long, value_name = "DEGREES/S", value_parser = numbers::speeds)]
    speed: Option<Axes>,
    /// Seconds for settling and reading at each sample, 0 to 86400 [default: the recipe's, or else 0.5]
    #[arg(long, value_name = "SECONDS", value_parser = numbers::number(0.0..=86_400.0))]
    settle: Option<f64>,
    /// Initial angles of the axes theta_i, phi_i, theta_o, phi_o in degrees, for example 0,0,0,180: polar
    /// angles from -180 to 180, azimuths from -3600 to 3600
    #[arg(
        long,
        value_name = "DEGREES",
        default_value = "0,0,0,180",
        value_parser = start
    )]
    start: Axes,
    /// Exchange light and sensor for samples where that saves time, or where only that is within
    /// reach. The reading is the same if the material is reciprocal and the sensor is calibrated for
    /// both positions
    #[arg(long)]
    swap: bool,
    /// Keep the difference of the azimuths within -180 to 180 degrees, so that no cable winds up
    #[arg(long)]
    no_full_turns: bool,
    #[command(flatten)]
    limits: LimitArgs,
    /// CSV file for the plan: index, theta_i, phi_i, theta_o, phi_o (degrees), swapped, seconds
    #[arg(long, short, value_name = "FILE.csv")]
    out: Option<PathBuf>,
    /// CSV file for a blank sheet of readings: index, theta_i, phi_i, theta_o, phi_o (degrees), r, g, b
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
        let file = RecipeFile::read(&self.recipe)?;
        let recipe = file.recipe();
        let stated = file.metadata().machine();
        let machine = Machine {
            speeds: self.speed.unwrap_or(stated.speeds),
            settle: self.settle.unwrap_or(stated.settle),
            start: self.start,
            limits: self.limits.or(stated.limits)?,
            full_turns: !self.no_full_turns,
        };
        machine.validate().map_err(|error| match &error {
            MachineError::Speed { .. } | MachineError::NoAzimuth => {
                Error::new(error).context("--speed")
            }
            MachineError::Start { .. } | MachineError::WoundUp(_) => {
                Error::new(error).context("--start")
            }
            MachineError::Settle(_) | MachineError::Limits(_) => Error::new(error),
        })?;
        let stops = match stops(&recipe, &machine.limits, self.swap) {
            Ok(stops) => stops,
            Err(missed) => {
                let lines: Vec<String> = missed
                    .iter()
                    .map(|sample| format!("\n  {sample}"))
                    .collect();
                bail!(
                    "the machine does not reach {} of {} samples:{}\n{}",
                    missed.len(),
                    recipe.samples(),
                    lines.concat(),
                    self.remedy()
                );
            }
        };
        let order = self.order.unwrap_or_else(|| Order::of_recipe(&recipe));
        let takes_missing = recipe.tolerates_missing();
        if self.order == Some(Order::Progressive) && !takes_missing {
            eprintln!(
                "note: this recipe needs all readings, so a scan cannot end early; --order travel takes \
                 less time"
            );
        }
        let route = Route::new(&machine, &stops, order, seed);
        let sheets = [
            (&self.out, route.to_csv()),
            (&self.blank, route::blank_sheet(&route.visits)),
        ];
        let sheets = sheets.into_iter();
        let files = sheets.filter_map(|(path, text)| Some((path.clone()?, text.into_bytes())));
        write_files(&files.collect::<Vec<_>>(), self.force)?;
        emit(self.json, &route.to_json(&machine), || {
            to_text(&route, &machine)
        })
    }

    /// Refuses outputs that are inputs, or both the same file.
    fn refuse_inputs(&self) -> anyhow::Result<()> {
        let written = [("--out", &self.out), ("--blank", &self.blank)];
        for (option, file) in written {
            for input in [&self.recipe, &Basis::path_for(&self.recipe)] {
                ensure!(
                    !file.as_ref().is_some_and(|file| is_same_file(file, input)),
                    "{option} {} is the recipe or its basis: give another {option}",
                    input.display()
                );
            }
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

    /// Advises what to do about samples out of reach.
    fn remedy(&self) -> &'static str {
        match self.swap {
            false => {
                "train a recipe for these limits (trainer train --max-theta-i, --max-theta-o, \
                 --min-separation), or try --swap"
            }
            true => {
                "train a recipe for these limits (trainer train --max-theta-i, --max-theta-o, \
                 --min-separation)"
            }
        }
    }
}

/// Parses the initial angles of the four axes.
fn start(text: &str) -> Result<Axes, String> {
    match numbers::list(text)[..] {
        [Some(theta_i), Some(phi_i), Some(theta_o), Some(phi_o)] => {
            Ok(Axes::from_array([theta_i, phi_i, theta_o, phi_o]))
        }
        _ => Err("give four numbers such as 0,0,0,180, in degrees".to_owned()),
    }
}

fn to_text(route: &Route, machine: &Machine) -> String {
    let mut text = format!(
        "order          {}\n\
         planned        {:.1} seconds, including {:.1} of motion\n\
         limits         {}\n\
         sample  theta_i    phi_i  theta_o    phi_o  (degrees)  read after seconds\n",
        route.order.name(),
        route.total(),
        route.travel,
        describe(machine.limits),
    );
    for visit in &route.visits {
        let [theta_i, phi_i, theta_o, phi_o] = visit.arms.to_array();
        let swapped = match visit.swapped {
            true => "swapped",
            false => "",
        };
        text += &format!(
            "{:6} {theta_i:8.2} {phi_i:8.2} {theta_o:8.2} {phi_o:8.2}  {swapped:9} {:19.1}\n",
            visit.index, visit.seconds
        );
    }
    text
}
