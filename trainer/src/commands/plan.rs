//! `trainer plan`

use std::path::{Path, PathBuf, absolute};

use anyhow::{Error, bail, ensure};
use clap::{ArgGroup, Args};
use glimpse_core::gonio::Limits;
use glimpse_materials::basis::Basis;
use glimpse_materials::files::holds;
use glimpse_trainer::route::{self, Axes, Machine, MachineError, Order, Route, stops};
use glimpse_training::recipe::RecipeFile;

use super::limits::{LimitArgs, describe};
use super::output::{is_same_file, write_file_forced};
use super::{numbers, print};

/// Orders, as named on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum OrderName {
    /// Least time: the best of all orders for up to 16 samples, otherwise the best that a search of
    /// about a second finds.
    Travel,
    /// The recipe's own: of a recipe trained with --missing the samples that tell most come first, so
    /// that a scan may end early.
    Progressive,
}

/// Plan a scan: where the arms go, in degrees, in which order, and how long it takes.
///
/// All axes move at once, each at full speed, so that a move takes as long as its slowest axis; then
/// the arms rest for the reading. What the arms might hit on the way is not looked at, and coming
/// back at the end is not counted.
///
/// An isotropic sample, which recipes are for, does not notice when both arms are turned about the
/// normal together. So only the difference of the azimuths is given, and it is changed the short way
/// around, by both axes at once, each by its share of the speed: no azimuths take less time. (They
/// may count on past 180 degrees; see --no-full-turns.)
///
/// The naive order, for comparison, is the recipe's own with azimuths as `trainer inspect` shows
/// them.
///
/// What the machine does not reach is named, all of it, and nothing is planned then.
///
/// Example: trainer plan neural-n8.recipe --speed 20,10,20,10 --settle 1.5 --blank readings.csv
///          trainer plan neural-n8.recipe --swap --max-theta-o 78 --out plan.csv
#[derive(Args)]
#[command(verbatim_doc_comment, group = ArgGroup::new("written").args(["out", "blank"]).multiple(true))]
pub(crate) struct Plan {
    /// The recipe file
    recipe: PathBuf,
    /// In which order samples are measured
    #[arg(long, value_enum, default_value_t = OrderName::Travel)]
    order: OrderName,
    /// Speeds of the axes theta_i, phi_i, theta_o, phi_o, degrees per second, 0.001 to 1,000,000: one number
    /// for all or four, as 20,10,20,10. An azimuth of speed 0 is an axis that the machine does not have, as
    /// that of a lamp which only swings
    #[arg(
        long,
        value_name = "DEGREES/S",
        default_value = "10",
        value_parser = speeds
    )]
    speed: Axes,
    /// Seconds that the arms stand at each sample, to come to rest and to be read: 0 to 86400
    #[arg(
        long,
        value_name = "SECONDS",
        default_value_t = 0.5,
        value_parser = numbers::number(0.0..=86_400.0)
    )]
    settle: f64,
    /// Angles of the axes theta_i, phi_i, theta_o, phi_o at first, degrees, as 0,0,0,180: polar angles of -180
    /// to 180, azimuths of -3600 to 3600
    #[arg(
        long,
        value_name = "DEGREES",
        default_value = "0,0,0,0",
        value_parser = start
    )]
    start: Axes,
    /// Samples may be measured with light and sensor exchanged, where that is sooner, or where it is
    /// the only way within reach. It gives the same reading if the material is reciprocal and the
    /// sensor is calibrated for it
    #[arg(long)]
    swap: bool,
    /// The sample is not isotropic: azimuths stay as they are in the recipe's pattern
    #[arg(long)]
    anisotropic: bool,
    /// Azimuth axes do not go around without end: their difference (with --anisotropic each of them)
    /// stays within -180 to 180 degrees, so that no cable winds up
    #[arg(long)]
    no_full_turns: bool,
    #[command(flatten)]
    limits: LimitArgs,
    /// Write the plan here, as CSV: index, theta_i, phi_i, theta_o, phi_o (degrees), swapped, seconds
    #[arg(long, short, value_name = "FILE.csv")]
    out: Option<PathBuf>,
    /// Write a CSV file to fill in: index, theta_i, phi_i, theta_o, phi_o (degrees), r, g, b
    #[arg(long, value_name = "FILE.csv")]
    blank: Option<PathBuf>,
    /// Replace files that are there and differ, as sheets do that somebody has filled in
    #[arg(long, requires = "written")]
    force: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

impl Plan {
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        self.refuse_what_cannot_be()?;
        let file = RecipeFile::read(&self.recipe)?;
        let recipe = file.recipe();
        let stated = recipe.metadata()?.limits;
        let machine = Machine {
            speeds: self.speed,
            settle: self.settle,
            start: self.start,
            limits: self.limits.or(stated.unwrap_or(Limits::NONE))?,
            isotropic: !self.anisotropic,
            full_turns: !self.no_full_turns,
        };
        machine.validate().map_err(|error| match &error {
            MachineError::Speed { .. }
            | MachineError::NoAzimuth
            | MachineError::MissingAzimuth { .. } => Error::new(error).context("--speed"),
            MachineError::Start { .. } | MachineError::WoundUp(_) => {
                Error::new(error).context("--start")
            }
            MachineError::Settle(_) | MachineError::Limits(_) => Error::new(error),
        })?;
        let stops = match stops(&recipe, &machine.limits, self.swap) {
            Ok(stops) => stops,
            Err(missed) => {
                let lines: Vec<String> = missed.iter().map(|each| format!("\n  {each}")).collect();
                bail!(
                    "the machine does not reach {} of {} samples:{}\n{}",
                    missed.len(),
                    recipe.samples(),
                    lines.concat(),
                    self.remedy()
                );
            }
        };
        let order = match self.order {
            OrderName::Travel => Order::Travel,
            OrderName::Progressive => Order::Progressive,
        };
        let takes_missing = recipe
            .completed()
            .is_some_and(|own| own.tolerates_missing());
        if order == Order::Progressive && !takes_missing {
            eprintln!(
                "note: this recipe needs all of its readings, so that no scan of it ends early; \
                 --order travel takes less time"
            );
        }
        let route = Route::new(&machine, &stops, order, seed);
        let files = [
            ("--out", &self.out, route.to_csv()),
            ("--blank", &self.blank, route::blank(&route.visits)),
        ];
        let files: Vec<(&str, &Path, String)> = files
            .into_iter()
            .filter_map(|(option, path, text)| Some((option, path.as_deref()?, text)))
            .collect();
        for (option, path, text) in &files {
            self.refuse_to_replace(option, path, text)?;
        }
        for (_, path, text) in &files {
            // Whatever is there is the same, or may go.
            write_file_forced(path, text.as_bytes(), true)?;
        }
        match self.json {
            true => print(&(serde_json::to_string_pretty(&route.to_json(&machine))? + "\n")),
            false => print(&to_text(&route, &machine)),
        }
    }

    /// Refuses, before anything is planned, what is written over what is read or in vain.
    fn refuse_what_cannot_be(&self) -> anyhow::Result<()> {
        let written = [("--out", &self.out), ("--blank", &self.blank)];
        for (option, file) in written {
            for input in [&self.recipe, &Basis::beside(&self.recipe)] {
                ensure!(
                    !file.as_ref().is_some_and(|file| is_same_file(file, input)),
                    "{option} {} is what is read, or belongs to it: give another {option}",
                    input.display()
                );
            }
        }
        if let (Some(out), Some(blank)) = (&self.out, &self.blank) {
            ensure!(
                !is_same_file(out, blank) && absolute(out)? != absolute(blank)?,
                "--out and --blank are the same file: give two"
            );
        }
        Ok(())
    }

    /// Refuses to replace a file that is not the same, unless told: it may hold readings by now.
    fn refuse_to_replace(&self, option: &str, path: &Path, text: &str) -> anyhow::Result<()> {
        ensure!(
            self.force || !path.is_file() || holds(path, text.as_bytes()),
            "{} is there and may have been filled in: give --force to replace it, or another \
             {option}",
            path.display()
        );
        Ok(())
    }

    /// What helps if something is out of reach.
    fn remedy(&self) -> &'static str {
        match self.swap {
            false => {
                "train a recipe for these limits (trainer train --max-theta-i, --max-theta-o, \
                 --min-separation), or try whether --swap helps"
            }
            true => {
                "train a recipe for these limits (trainer train --max-theta-i, --max-theta-o, \
                 --min-separation)"
            }
        }
    }
}

/// One speed for all axes, or four.
fn speeds(text: &str) -> Result<Axes, String> {
    match numbers::list(text)[..] {
        [Some(all)] => Ok(Axes::of([all; 4])),
        [Some(theta_i), Some(phi_i), Some(theta_o), Some(phi_o)] => {
            Ok(Axes::of([theta_i, phi_i, theta_o, phi_o]))
        }
        _ => Err(
            "give one number for all axes, or four, as 20,10,20,10: degrees per second".to_owned(),
        ),
    }
}

/// Where four axes stand.
fn start(text: &str) -> Result<Axes, String> {
    match numbers::list(text)[..] {
        [Some(theta_i), Some(phi_i), Some(theta_o), Some(phi_o)] => {
            Ok(Axes::of([theta_i, phi_i, theta_o, phi_o]))
        }
        _ => Err("give four numbers, as 0,0,0,180: degrees".to_owned()),
    }
}

fn to_text(route: &Route, machine: &Machine) -> String {
    let what = match (route.order, route.is_best) {
        (Order::Progressive, _) => "the recipe's own order",
        (Order::Travel, true) => "no other order takes less time",
        (Order::Travel, false) => "the best that was found",
    };
    let seconds =
        |travel: f64, total: f64| format!("{total:.1} seconds, {travel:.1} of which arms move");
    let mut text = format!(
        "order          {} ({what})\n\
         planned        {}\n\
         naive order    {}\n\
         limits         {}\n\
         sample  theta_i    phi_i  theta_o    phi_o  (degrees)  read after seconds\n",
        route.order.name(),
        seconds(route.travel, route.total()),
        seconds(route.naive_travel, route.naive_total()),
        describe(machine.limits),
    );
    for visit in &route.visits {
        let [theta_i, phi_i, theta_o, phi_o] = visit.arms.values();
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
