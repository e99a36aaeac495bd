//! The command line `trainer`.

mod commands;
mod commit;
mod experiment;

use std::io::Write;
use std::process::ExitCode;

use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};

use commands::cells::Given;

/// Learn where to measure a BRDF and how to fit it, for a scanner's microcontroller.
///
/// The trainer meta-learns a sample pattern, initial parameters and step sizes on measured
/// materials and writes them into a recipe. The scanner measures at the recipe's directions and
/// fits a new material in a few steps.
///
/// Start with `trainer quickstart`.
///
/// SOURCES. Wherever a command takes materials (--data, --test, --train, --material, SRC) it takes
/// a directory holding any mix of MERL *.binary, isotropic RGL *_rgb.bsdf, NBRDF sets
/// (NAME_fc1.npy and its five siblings) and fitted materials (material.json, as `trainer fit` leaves
/// it, in a folder of its own too), a single such file, or procedural, procedural:COUNT or
/// procedural:COUNT:SEED, the built-in set. A material is named by its file (NBRDF: by NAME; a
/// fitted one: by what its file says), and no two of a directory may have the same name. What of a directory may have been meant and is not
/// read (folders, endings in capitals, names that are no UTF-8) is told; *.bsdf that are spectral or
/// anisotropic are an error, so that no material is left out unnoticed.
#[derive(Parser)]
#[command(name = "trainer", version = commit::VERSION, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    common: Common,
}

/// What all commands take.
#[derive(Args, Clone, Copy, Debug)]
struct Common {
    /// Seed of all random numbers: the same seed gives the same results. Every command takes it,
    /// also those that draw none
    #[arg(long, global = true, default_value_t = 0, value_parser = commands::numbers::seed)]
    seed: u64,
    /// Threads to compute on [default: all cores]; the results do not depend on it
    #[arg(long, global = true, value_parser = commands::numbers::threads)]
    threads: Option<usize>,
}

/// Each is described where its arguments are.
#[derive(Subcommand)]
enum Command {
    Quickstart(commands::quickstart::Quickstart),
    Recipes(commands::recipes::Recipes),
    Train(commands::train::Train),
    Evaluate(commands::evaluate::Evaluate),
    Fit(commands::fit::Fit),
    Inspect(commands::inspect::Inspect),
    Plan(commands::plan::Plan),
    Query(commands::query::Query),
    Render(commands::render::Render),
    Export(commands::export::Export),
    Convert(commands::convert::Convert),
    Reproduce(commands::reproduce::Reproduce),
    VirtualScanner(commands::virtual_scanner::VirtualScanner),
    Bench(commands::bench::Bench),
    Completion(commands::completion::Completion),
}

fn main() -> ExitCode {
    let mut line = commands::numbers::with_negative_values(Cli::command());
    let matches = line.get_matches_mut();
    let Cli { command, common } = match Cli::from_arg_matches(&matches) {
        Ok(cli) => cli,
        Err(error) => error.format(&mut line).exit(),
    };
    let given = || Given::of(&line, &matches);
    if let Some(threads) = common.threads {
        // It fails only if a pool exists already, and none does yet.
        let _ = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build_global();
    }
    let outcome = match command {
        Command::Quickstart(command) => command.run(common.seed),
        Command::Recipes(command) => command.run(),
        Command::Train(command) if command.list => {
            given().and_then(|given| commands::grid::list(&command, common.seed, &given))
        }
        Command::Train(command) if command.grid => commands::grid::run(&command, common.seed),
        Command::Train(command) => command.run(common.seed),
        Command::Evaluate(command) => command.run(common.seed),
        Command::Fit(command) => command.run(common.seed),
        Command::Inspect(command) => command.run(),
        Command::Plan(command) => command.run(common.seed),
        Command::Query(command) => command.run(),
        Command::Render(command) => command.run(common.seed),
        Command::Export(command) => command.run(),
        Command::Convert(command) => command.run(common.seed),
        Command::Reproduce(command) if command.list => {
            given().and_then(|given| command.list(common.seed, &given))
        }
        Command::Reproduce(command) => command.run(common.seed),
        Command::VirtualScanner(command) => command.run(common.seed),
        Command::Bench(command) => command.run(),
        Command::Completion(command) => command.run(&mut Cli::command()),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // Nobody may be listening any more.
            let message = commands::message::message(&error);
            let _ = writeln!(std::io::stderr(), "error: {message}");
            ExitCode::FAILURE
        }
    }
}
