//! `trainer train --grid`: trains a recipe for each model and each n.

use crate::report::{Column, Table};
use anyhow::{Context, bail};
use glimpse_core::model::ModelKind;
use glimpse_materials::files::write_atomic;
use glimpse_materials::{MODELS, SourceShare, Sources};
use glimpse_training::meta::checkpoint::Checkpoint;
use glimpse_training::recipe::RecipeFile;

use super::lock::Lock;
use super::message::message;
use super::numbers::SampleCount;
use super::output::create_out_folder;
use super::progress::{catch_interrupts, interrupted};
use super::train::{Train, TrainingRun};
use super::{load_all, print};

/// One recipe of the grid.
struct GridCell {
    model: ModelKind,
    samples: usize,
    /// The loss that the recipe states; None if its training failed.
    expected_loss: Option<f32>,
}

/// Trains every model at every n.
pub(crate) fn run(train: &Train, seed: u64) -> anyhow::Result<()> {
    let sources = train.sources()?;
    catch_interrupts()?;
    create_out_folder(&train.out)?;
    let _lock = Lock::of_folder(&train.out)?;
    let (_, source_shares) = load_all(&sources)?;
    let csv = train.out.join("grid.csv");
    let mut cells = Vec::new();
    for (model, samples) in models_and_samples(train)? {
        cells.push(GridCell {
            model,
            samples,
            expected_loss: None,
        });
    }
    let total = cells.len();
    for index in 0..total {
        let GridCell { model, samples, .. } = cells[index];
        let name = model.name();
        eprintln!("[{}/{total}] {name}, n = {samples}", index + 1);
        let out = train.out.join(format!("{name}-n{samples}.recipe"));
        let outcome = train
            .training_run(model, samples, out, sources.label(), seed)
            .and_then(|run| train_if_missing(&run, train, &sources, &source_shares));
        if interrupted() {
            bail!("stopped at {name}, n = {samples}: repeat the command to continue");
        }
        match outcome {
            Ok(expected_loss) => cells[index].expected_loss = Some(expected_loss),
            Err(error) => eprintln!("error: {name}, n = {samples}: {}", message(&error)),
        }
        // The table is written after each cell, for readers during a long run.
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
        [] => &MODELS,
        some => some,
    };
    let given = train.samples.iter().map(|samples| match samples {
        SampleCount::Count(samples) if *samples > 0 => Ok(*samples),
        _ => bail!("--samples auto and any do not apply to a grid: give numbers, or omit --grid"),
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

/// Trains a recipe unless it exists. Returns its expected loss.
fn train_if_missing(
    run: &TrainingRun,
    train: &Train,
    sources: &Sources,
    source_shares: &[SourceShare],
) -> anyhow::Result<f32> {
    let _lock = run.lock()?;
    let is_trained = run.refuse_overwrite(run.is_trained(source_shares), true, train.force)?;
    if is_trained {
        Checkpoint::remove(&run.checkpoint);
        eprintln!("{} is already trained", run.out.display());
        return stated_loss(&RecipeFile::read(&run.out)?);
    }
    stated_loss(&run.train(sources.load()?, true)?)
}

fn stated_loss(file: &RecipeFile) -> anyhow::Result<f32> {
    let expected_loss = file.recipe().expected_loss();
    expected_loss.context("the recipe states no expected loss")
}

fn table(cells: &[GridCell]) -> Table {
    let columns = [
        Column::text("model"),
        Column::plain("n", 0),
        Column::plain("expected loss", 4),
    ];
    let row = |cell: &GridCell| {
        let loss = cell.expected_loss.map(f64::from);
        vec![cell.model.name().into(), cell.samples.into(), loss.into()]
    };
    let rows = cells.iter().map(row);
    Table::new("Expected loss of each recipe", columns, rows)
}
