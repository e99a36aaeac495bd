//! `trainer train --grid`: trains a recipe for each model and each n.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, bail};
use glimpse_core::model::ModelKind;
use glimpse_materials::files::write_atomic;
use glimpse_materials::{Source, SourceShare, Sources};
use glimpse_trainer::report::{Cell, Column, Compare, Highlight, Table};

use super::cell_list::{
    CommandLine, ListedCell, path_text, path_texts, print_cells, shell_command, source_paths,
};
use super::existing_output::ExistingOutput;
use super::lock::Lock;
use super::message::message;
use super::numbers::SampleCount;
use super::output::create_out_folder;
use super::progress::{catch_interrupts, interrupted};
use super::train::{Train, TrainingRun};
use super::{MODELS, load_all, print};

/// One recipe of the grid.
struct GridCell {
    model: ModelKind,
    model_name: &'static str,
    samples: usize,
    /// The loss that the recipe states; None if its training failed.
    expected_loss: Option<f32>,
    /// Duration of its training; None if unknown.
    seconds: Option<f64>,
}

/// Trains every model at every n.
pub(crate) fn run(train: &Train, seed: u64) -> anyhow::Result<()> {
    train.linear_prior.refuse_for_other_models(&train.model)?;
    catch_interrupts()?;
    create_out_folder(&train.out)?;
    let _lock = Lock::of_folder(&train.out)?;
    let sources = train.sources()?;
    let (_, source_shares) = load_all(&sources)?;
    let csv = train.out.join("grid.csv");
    let mut cells = Vec::new();
    let earlier_seconds = recorded_seconds(&csv);
    for (model, samples) in models_and_samples(train)? {
        let name = model.name();
        let seconds = earlier_seconds.get(&(name.to_owned(), samples));
        cells.push(GridCell {
            model,
            model_name: name,
            samples,
            expected_loss: None,
            seconds: seconds.copied(),
        });
    }
    let total = cells.len();
    for index in 0..total {
        let GridCell {
            model,
            model_name: name,
            samples,
            ..
        } = cells[index];
        eprintln!("[{}/{total}] {name}, n = {samples}", index + 1);
        let out = recipe_path(train, name, samples);
        let begin = Instant::now();
        let outcome = train
            .training_run(model, samples, out, sources.label(), seed)
            .and_then(|run| train_if_missing(&run, train, &sources, &source_shares));
        if interrupted() {
            bail!("stopped at {name}, n = {samples}: repeat the command to continue");
        }
        let cell = &mut cells[index];
        match outcome {
            Ok((expected_loss, trained)) => {
                cell.expected_loss = Some(expected_loss);
                if trained {
                    cell.seconds = Some(begin.elapsed().as_secs_f64());
                }
            }
            Err(error) => {
                eprintln!("error: {name}, n = {samples}: {}", message(&error));
                cell.seconds = None;
            }
        }
        // The table is written after each cell, since a resumed grid reads the seconds from it.
        write_atomic(&csv, table(&cells).to_csv().as_bytes())
            .with_context(|| format!("cannot write {}", csv.display()))?;
    }
    print(&table(&cells).to_text())?;
    let failed = cells.iter().filter(|cell| cell.expected_loss.is_none());
    match failed.count() {
        0 => Ok(()),
        failed => bail!(
            "{failed} of {total} recipes failed: correct the errors above, and repeat the command"
        ),
    }
}

/// Returns every model at every n.
fn models_and_samples(train: &Train) -> anyhow::Result<Vec<(ModelKind, usize)>> {
    let models = match &train.model[..] {
        [] => &MODELS.map(|(model, _)| model),
        some => some,
    };
    let given = train.samples.iter().map(|samples| match samples {
        SampleCount::Count(samples) => Ok(*samples),
        SampleCount::Auto => {
            bail!("--samples auto does not apply to a grid: give numbers, or omit --grid")
        }
    });
    let samples = match given.collect::<anyhow::Result<Vec<usize>>>()? {
        given if given.is_empty() => (0..10).map(|k| 1 << k).collect(),
        given => given,
    };
    let pairs = models
        .iter()
        .flat_map(|model| samples.iter().map(move |samples| (*model, *samples)));
    Ok(pairs.collect())
}

fn recipe_path(train: &Train, model: &str, samples: usize) -> PathBuf {
    train.out.join(format!("{model}-n{samples}.recipe"))
}

/// Prints a command for each recipe, and creates the output folder.
pub(crate) fn list(train: &Train, seed: u64, line: &CommandLine) -> anyhow::Result<()> {
    train.linear_prior.refuse_for_other_models(&train.model)?;
    let sources = train.sources()?;
    let counts = sources.as_slice().iter().map(Source::count);
    let counts = counts.collect::<Result<Vec<usize>, _>>()?;
    let source_shares = sources.source_shares(&counts);
    let mut cells = Vec::new();
    for (model, samples) in models_and_samples(train)? {
        let name = model.name();
        let out = recipe_path(train, name, samples);
        let run = train.training_run(model, samples, out, sources.label(), seed)?;
        let added = [
            format!("--model={name}"),
            format!("--samples={samples}"),
            format!("--out={}", path_text(&run.out)?),
            "--resume".to_owned(),
        ];
        let mut command = match model {
            ModelKind::Linear => line.words_without(&GRID_ARGUMENTS),
            // The cell's command would refuse options of the model linear.
            _ => line.words_without(&[&GRID_ARGUMENTS[..], &["bases", "eta"]].concat()),
        };
        command.extend(added);
        let existing = run.existing_output(&source_shares);
        cells.push(ListedCell {
            name: format!("{name}-n{samples}"),
            shell: shell_command(&command)?,
            command,
            inputs: source_paths(sources.as_slice()),
            outputs: path_texts(&run.outputs())?,
            checkpoint: Some(path_text(&run.checkpoint)?),
            done: matches!(existing, ExistingOutput::Trained(_)),
            conflict: match existing {
                ExistingOutput::Conflict(description) if !train.force => Some(description),
                _ => None,
            },
        });
    }
    create_out_folder(&train.out)?;
    print_cells(&cells)
}

/// Arguments of the grid's command that are not repeated in a cell's command.
const GRID_ARGUMENTS: [&str; 5] = ["grid", "list", "model", "samples", "out"];

/// Trains a recipe unless it exists. Returns its expected loss, and true if it was trained now.
fn train_if_missing(
    run: &TrainingRun,
    train: &Train,
    sources: &Sources,
    source_shares: &[SourceShare],
) -> anyhow::Result<(f32, bool)> {
    let _locks = run.lock()?;
    match run.existing_output(source_shares) {
        ExistingOutput::Trained(expected_loss) => {
            run.remove_checkpoint();
            eprintln!("{} is already trained", run.out.display());
            Ok((expected_loss, false))
        }
        ExistingOutput::Conflict(description) if !train.force => {
            bail!("{description}: remove it, give --force to replace it, or give another --out")
        }
        existing => {
            run.refuse_overwrite(&existing, true, train.force)?;
            let trained = run.train(sources.load()?, true)?;
            trained.print_cross_validation();
            let expected_loss = trained.file.recipe().expected_loss();
            Ok((
                expected_loss.context("the recipe states no expected loss")?,
                true,
            ))
        }
    }
}

fn table(cells: &[GridCell]) -> Table {
    let number = |value: Option<f64>| value.map_or(Cell::Missing, Cell::Number);
    Table {
        caption: "Expected loss of each recipe".into(),
        columns: vec![
            Column::text("model"),
            Column::number("n", 0, Highlight::None),
            Column::number("expected loss", 4, Highlight::None),
            Column::number("seconds", 1, Highlight::None),
        ],
        rows: cells
            .iter()
            .map(|cell| {
                vec![
                    Cell::Text(cell.model_name.into()),
                    Cell::Number(cell.samples as f64),
                    number(cell.expected_loss.map(f64::from)),
                    number(cell.seconds),
                ]
            })
            .collect(),
        compare: Compare::WithinColumn,
    }
}

/// Reads the durations of trainings by model and n from the table of an earlier run. Malformed rows are ignored.
fn recorded_seconds(path: &Path) -> HashMap<(String, usize), f64> {
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
