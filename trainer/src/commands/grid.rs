//! `trainer train --grid`: many recipes, one after another.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, bail};
use clap::ValueEnum;
use glimpse_core::model::ModelKind;
use glimpse_materials::files::write_whole;
use glimpse_materials::{Portion, Source, Sources};
use glimpse_trainer::report::{Best, Cell, Column, Compare, Table};

use super::cells::{self, Given, for_a_shell, paths_of, text_of, texts_of};
use super::existing::Existing;
use super::lock::Lock;
use super::message::message;
use super::output::make_out;
use super::progress::{catch_interrupts, interrupted};
use super::train::{Job, Train};
use super::{ModelName, load_all, print};

/// One recipe of the grid.
struct Row {
    model: ModelName,
    name: &'static str,
    samples: usize,
    /// The loss that it promises; None if it failed.
    expected_loss: Option<f32>,
    /// How long its training took; None if that is not known any more.
    seconds: Option<f64>,
}

/// Trains every model at every n.
pub(crate) fn run(train: &Train, seed: u64) -> anyhow::Result<()> {
    train.prior.refuse_for_others(&train.model)?;
    catch_interrupts()?;
    make_out(&train.out)?;
    let _lock = Lock::within(&train.out)?;
    let sources = train.sources()?;
    let (_, portions) = load_all(&sources)?;
    let csv = train.out.join("grid.csv");
    let mut rows = Vec::new();
    let known = seconds_of(&csv);
    for (model, samples) in each(train) {
        let name = ModelKind::from(model).name();
        rows.push(Row {
            model,
            name,
            samples,
            expected_loss: None,
            seconds: known.get(&(name.to_owned(), samples)).copied(),
        });
    }
    let total = rows.len();
    for cell in 0..total {
        let Row {
            model,
            name,
            samples,
            ..
        } = rows[cell];
        eprintln!("[{}/{total}] {name}, n = {samples}", cell + 1);
        let out = recipe_of(train, name, samples);
        let begin = Instant::now();
        let outcome = train
            .job(model, samples, out, sources.label(), seed)
            .and_then(|job| finish(&job, train, &sources, &portions));
        if interrupted() {
            bail!("stopped at {name}, n = {samples}; repeat the command to go on");
        }
        let row = &mut rows[cell];
        match outcome {
            Ok((expected_loss, trained)) => {
                row.expected_loss = Some(expected_loss);
                if trained {
                    row.seconds = Some(begin.elapsed().as_secs_f64());
                }
            }
            Err(error) => {
                eprintln!("error: {}", message(&error));
                row.seconds = None;
            }
        }
        // Now and not at the end: a resumed grid finds the seconds there.
        write_whole(&csv, table(&rows).to_csv().as_bytes())
            .with_context(|| format!("cannot write {}", csv.display()))?;
    }
    print(&table(&rows).to_text())?;
    let failed = rows.iter().filter(|row| row.expected_loss.is_none());
    match failed.count() {
        0 => Ok(()),
        failed => bail!("{failed} of {total} recipes failed"),
    }
}

/// Every model at every n.
fn each(train: &Train) -> Vec<(ModelName, usize)> {
    let models = match &train.model[..] {
        [] => ModelName::value_variants(),
        some => some,
    };
    let samples = match &train.samples[..] {
        [] => (0..10).map(|k| 1 << k).collect(),
        some => some.to_vec(),
    };
    let each = models
        .iter()
        .flat_map(|model| samples.iter().map(move |samples| (*model, *samples)));
    each.collect()
}

fn recipe_of(train: &Train, model: &str, samples: usize) -> PathBuf {
    train.out.join(format!("{model}-n{samples}.recipe"))
}

/// Prints every recipe's own command, and makes the folder that they write to.
pub(crate) fn list(train: &Train, seed: u64, given: &Given) -> anyhow::Result<()> {
    train.prior.refuse_for_others(&train.model)?;
    let sources = train.sources()?;
    let counts = sources.each().iter().map(Source::count);
    let counts = counts.collect::<Result<Vec<usize>, _>>()?;
    let portions = sources.portions(&counts);
    let mut cells = Vec::new();
    for (model, samples) in each(train) {
        let name = ModelKind::from(model).name();
        let out = recipe_of(train, name, samples);
        let job = train.job(model, samples, out, sources.label(), seed)?;
        let own = [
            format!("--model={name}"),
            format!("--samples={samples}"),
            format!("--out={}", text_of(&job.out)?),
            "--resume".to_owned(),
        ];
        let command = match model {
            ModelName::Linear => given.but(&OF_A_GRID, &own),
            // Alone it would be refused, as having no effect.
            _ => given.but(&[&OF_A_GRID[..], &["bases", "eta"]].concat(), &own),
        };
        let found = job.find(&portions);
        cells.push(cells::Cell {
            name: format!("{name}-n{samples}"),
            shell: for_a_shell(&command)?,
            command,
            inputs: paths_of(sources.each()),
            outputs: texts_of(&job.outputs())?,
            checkpoint: Some(text_of(&job.checkpoint)?),
            done: matches!(found, Existing::Done(_)),
            in_the_way: match found {
                Existing::Other(what) if !train.force => Some(what),
                _ => None,
            },
        });
    }
    make_out(&train.out)?;
    cells::print_all(&cells)
}

/// What a cell's own command does not take over from the grid's.
const OF_A_GRID: [&str; 5] = ["grid", "list", "model", "samples", "out"];

/// Trains a recipe if it is not there; returns the loss that it promises, and true if it was
/// trained.
fn finish(
    job: &Job,
    train: &Train,
    sources: &Sources,
    portions: &[Portion],
) -> anyhow::Result<(f32, bool)> {
    let _locks = job.lock()?;
    match job.find(portions) {
        Existing::Done(expected_loss) => {
            job.clean_up();
            eprintln!("{} is trained already", job.out.display());
            Ok((expected_loss, false))
        }
        Existing::Other(what) if !train.force => {
            bail!("{what}: remove it, give --force to replace it, or give another --out")
        }
        found => {
            job.refuse_to_lose(&found, true, train.force)?;
            let trained = job.train(sources.load()?, true)?;
            let expected_loss = trained.file.recipe().expected_loss();
            Ok((expected_loss.context("the recipe promises nothing")?, true))
        }
    }
}

fn table(rows: &[Row]) -> Table {
    let number = |number: Option<f64>| number.map_or(Cell::Missing, Cell::Number);
    Table {
        caption: "What each recipe promises".into(),
        columns: vec![
            Column::text("model"),
            Column::number("n", 0, Best::None),
            Column::number("expected loss", 4, Best::None),
            Column::number("seconds", 1, Best::None),
        ],
        rows: rows
            .iter()
            .map(|row| {
                vec![
                    Cell::Text(row.name.into()),
                    Cell::Number(row.samples as f64),
                    number(row.expected_loss.map(f64::from)),
                    number(row.seconds),
                ]
            })
            .collect(),
        compare: Compare::Down,
    }
}

/// How long each recipe took, as far as an earlier run wrote it down.
fn seconds_of(path: &Path) -> HashMap<(String, usize), f64> {
    // A table that is not there, or was changed, knows of none.
    let Ok(mut table) = csv::Reader::from_path(path) else {
        return HashMap::new();
    };
    let rows = table.deserialize::<(String, usize, Option<f64>, Option<f64>)>();
    rows.filter_map(|row| {
        let (model, samples, _, seconds) = row.ok()?;
        Some(((model, samples), seconds?))
    })
    .collect()
}
