//! The program `trainer`: its commands, and the tables, plots and pages that they write.
//!
//! The list has the modules in order, lowest first. The program is a library, so that it
//! compiles while the libraries below it are still being optimized.
//!
//! - `output`: output files
//! - `picture`: files of linear pictures of cameras
//! - `progress`: progress bars, and Ctrl-C
//! - `training`: trainings that write recipes
//! - `report`: tables, plots, pages
//! - `benchmark`: timing of the computations that dominate training
//! - `experiment`: the paper's tables and figures
//! - `commands`: one file per subcommand

mod benchmark;
mod commands;
mod experiment;
mod output;
pub mod picture;
mod progress;
mod report;
mod training;

use std::io::Write;
use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use glimpse_materials::setting::set_name_style;

/// Learn where to measure a BRDF and how to fit it, for a scanner's microcontroller.
///
/// The trainer meta-learns a sample pattern, initial parameters and step sizes on measured
/// materials, and writes them into a recipe. The scanner measures at the recipe's directions and
/// fits a new material in a few steps.
///
/// Start with `trainer quickstart`.
///
/// SOURCES. Every option or argument that takes materials, such as --data SOURCE, takes one of
///
/// - a directory with any mix of MERL *.binary, isotropic RGL *.bsdf (RGB or spectra), NBRDF sets
///   (NAME_fc1.npy and its five siblings), SSDD *.ssdd, OpenMATERIAL *_brdf.xompt, and fitted
///   materials (material.json of `trainer fit`, in the directory itself or in a subdirectory);
/// - a single such file, or one PAB-Opto file (*.txt), which is read with the others of its sample;
/// - procedural, procedural:COUNT or procedural:COUNT:SEED: built-in procedural materials.
///
/// A material has the name of its file, an NBRDF set has the name NAME, and a fitted material has
/// the name in its file. Names within a directory must be unique. Skipped entries (other
/// subdirectories, extensions in capitals, non-UTF-8 names, and NAME_spec.bsdf next to
/// NAME_rgb.bsdf), unmeasured directions, and the files and incoming angles of PAB-Opto sets are
/// reported on stderr. An anisotropic *.bsdf file is an error.
#[derive(Parser)]
#[command(name = "trainer", version, max_term_width = 100, verbatim_doc_comment)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Seed of all random numbers; the same seed gives the same bytes on processors with the same vector
    /// instructions (AVX-512, AVX2 or NEON) and C library. Commands without random numbers ignore it
    #[arg(long, global = true, default_value_t = 0, value_parser = commands::numbers::number(0..=u64::MAX))]
    seed: u64,
    /// Number of threads, 1 to 1024; results do not depend on it [default: all cores]
    #[arg(long, global = true, value_parser = commands::numbers::number(1..=1_024_usize))]
    threads: Option<usize>,
}

/// The subcommands. The module of each has its arguments and help text.
#[derive(Subcommand)]
enum Command {
    Quickstart(commands::quickstart::Quickstart),
    #[command(subcommand)]
    Recipes(commands::recipes::Recipes),
    Train(commands::train::Train),
    Evaluate(commands::evaluate::Evaluate),
    Fit(commands::fit::Fit),
    Next(commands::next::Next),
    Inspect(commands::inspect::Inspect),
    Plan(commands::plan::Plan),
    Photo(commands::photo::Photo),
    Query(commands::query::Query),
    #[command(subcommand)]
    Render(commands::render::Render),
    Export(commands::export::Export),
    Convert(commands::convert::Convert),
    Compare(commands::compare::Compare),
    Reproduce(commands::reproduce::Reproduce),
    VirtualScanner(commands::virtual_scanner::VirtualScanner),
    Bench(commands::bench::Bench),
}

/// Runs the command line of this process.
#[must_use]
pub fn run() -> ExitCode {
    set_name_style(commands::message::option);
    let mut parser = commands::numbers::with_negative_values(Cli::command());
    let matches = parser.get_matches_mut();
    let cli = match Cli::from_arg_matches(&matches) {
        Ok(cli) => cli,
        Err(error) => error.format(&mut parser).exit(),
    };
    if let Some(threads) = cli.threads {
        // This fails only if a thread pool already exists, which is not the case here.
        let _ = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build_global();
    }
    let outcome = match cli.command {
        Command::Quickstart(command) => command.run(cli.seed),
        Command::Recipes(command) => command.run(),
        Command::Train(command) => command.run(cli.seed),
        Command::Evaluate(command) => command.run(cli.seed),
        Command::Fit(command) => command.run(cli.seed),
        Command::Next(command) => command.run(),
        Command::Inspect(command) => command.run(),
        Command::Plan(command) => command.run(cli.seed),
        Command::Photo(command) => command.run(),
        Command::Query(command) => command.run(),
        Command::Render(command) => command.run(cli.seed),
        Command::Export(command) => command.run(),
        Command::Convert(command) => command.run(cli.seed),
        Command::Compare(command) => command.run(),
        Command::Reproduce(command) => command.run(cli.seed),
        Command::VirtualScanner(command) => command.run(cli.seed),
        Command::Bench(command) => command.run(),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // stderr may be closed.
            let message = commands::message::message(&error);
            let _ = writeln!(std::io::stderr(), "error: {message}");
            ExitCode::FAILURE
        }
    }
}
