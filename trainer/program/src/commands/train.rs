//! `trainer train`

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, ensure};
use clap::Args;
use glimpse_core::model::ModelKind;
use glimpse_fitting::recipe::RecipeFile;
use glimpse_fitting::recipe::options::{Schedule, TrainingOptions};
use glimpse_materials::basis::BasisTable;
use glimpse_materials::files::is_stream;
use glimpse_materials::{Source, Sources};
use glimpse_training::checkpoint::TrainingState;
use glimpse_training::run::{TrainedRecipe, check};

use super::expected_loss::{expected_loss, standard_error};
use super::geometry::read_directions;
use super::load_all;
use super::lock::Lock;
use crate::output::check_out;
use crate::training::{checkpoint_of, train_to_file};

/// Train a recipe on materials.
///
/// SCHEDULES. With --schedule prior, the default, a recipe completes the readings: a small learned
/// map estimates the whole material from them. For models other than linear, Gauss-Newton steps
/// refine the estimate. Training uses all materials. With ten or more, four-fold cross-validation
/// follows: four shorter trainings, each without a quarter of the materials. They yield the expected
/// loss on unseen materials, and the predictor of a material's loss from its readings.
///
/// With --schedule paper, every tenth material is held out, and the loss on those is the
/// expected loss. The model linear holds none out: its loss on each material is that with the
/// components of the other materials.
///
/// RESUMING. The run is saved at least every ten seconds, and on Ctrl-C. The same command with --resume
/// continues it, also after kill -9, and writes the same bytes as an uninterrupted run, unless the
/// processor has other vector instructions: compare checksums by `trainer inspect`. A recipe that was
/// trained with other options is replaced only with --force. Two runs cannot write the same recipe at
/// once.
///
/// Example: trainer train --model neural --samples 8 --data MERL/ --out neural-n8.recipe
///          trainer train --model linear --samples 12 --scan-seconds 12 --data MERL/ --out 12s.recipe
///          trainer train --model linear -n 8 --pattern my-six-angles.csv --data MERL/ --out 8.recipe
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Train {
    #[command(flatten)]
    options: TrainingOptions,
    /// Training materials; can be given several times
    #[arg(long, value_name = "SOURCE", default_value = "procedural:100")]
    data: Vec<Source>,
    /// Recipe file to write
    #[arg(long, short)]
    out: PathBuf,
    /// Schedule prior: CSV file of directions that the instrument fixes, as for `trainer query`. They are
    /// the recipe's first samples, and the remaining ones of N are trained
    #[arg(long, value_name = "FILE.csv", conflicts_with = "scan_seconds")]
    pattern: Option<PathBuf>,
    /// Continue from the checkpoint OUT.checkpoint, if there is one
    #[arg(long)]
    resume: bool,
    /// Replace a recipe that was trained with other options, or discard an unfinished run
    #[arg(long)]
    force: bool,
}

impl Train {
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        ensure!(
            !is_stream(&self.out),
            "{} is not a regular file, and has no place for a checkpoint: give a file as --out",
            self.out.display()
        );
        let mut options = TrainingOptions {
            seed,
            ..self.options.clone()
        };
        if let Some(path) = &self.pattern {
            options.pattern = read_directions(path).context("--pattern names a file")?;
        }
        check(&options)?;
        let sources = Sources::new(self.data.clone(), &options.share)?;
        let _lock = Lock::of_path(&self.out)?;
        let (materials, source_shares) = load_all(&sources)?;
        options.source_shares = source_shares;
        let checkpoint = checkpoint_of(&self.out);
        let is_unfinished = TrainingState::exists_in(&checkpoint);
        let is_trained = match self.is_trained(&options, is_unfinished) {
            Err(error) if !self.force => return Err(error),
            is_trained => is_trained.unwrap_or_default(),
        };
        if self.resume && !is_unfinished {
            if is_trained {
                TrainingState::remove(&checkpoint);
                eprintln!("{} is already trained", self.out.display());
                return Ok(());
            }
            eprintln!(
                "no checkpoint in {}: starting from the beginning",
                checkpoint.display()
            );
        }
        // An unwritable output is reported before training, not after hours of it.
        check_out(&self.out)?;
        let begin = Instant::now();
        if options.schedule == Schedule::Prior {
            let shares = options.sources().into_iter().map(|source| {
                let (share, label) = (100.0 * source.share, source.label);
                format!(
                    "{share:.0} % from {} materials of {label}",
                    source.materials
                )
            });
            eprintln!("training tasks: {}", shares.collect::<Vec<_>>().join(", "));
        }
        let label = sources.label();
        let trained = train_to_file(&options, materials, self.resume, &label, &self.out)?;
        print_validation(&options, &trained);
        let expected_loss = expected_loss(&trained.file.recipe())?;
        eprintln!(
            "trained in {:.0} s; expected loss {}",
            begin.elapsed().as_secs_f64(),
            expected_loss.unwrap_or_else(|| "not stated".into()),
        );
        Ok(())
    }

    /// Returns true if the recipe is already trained with these options.
    ///
    /// # Errors
    /// If training would replace another file, or an unfinished run.
    fn is_trained(&self, options: &TrainingOptions, is_unfinished: bool) -> anyhow::Result<bool> {
        ensure!(
            self.resume || !is_unfinished,
            "{} holds an unfinished run: give --resume to continue it, or --force to discard it",
            checkpoint_of(&self.out).display()
        );
        let has_basis = options.model == ModelKind::Linear || options.samples == 0;
        let path = BasisTable::path_for(&self.out);
        let (out, basis) = (self.out.display(), path.display());
        let remedy = "give --force to replace it, or another --out";
        if !self.out.exists() {
            // With a checkpoint, the basis is that of the unfinished run.
            ensure!(
                is_unfinished || !has_basis || !path.exists(),
                "{basis} exists without its recipe {out}, and may belong to another recipe: {remedy}"
            );
            return Ok(false);
        }
        let file =
            RecipeFile::read(&self.out).with_context(|| format!("{out} exists: {remedy}"))?;
        let trained = file.metadata().options();
        ensure!(
            trained.map(|trained| trained.identity(&[])) == Some(options.identity(&[])),
            "{out} was trained with other options or materials: {remedy}"
        );
        ensure!(
            !has_basis || path.exists(),
            "{out} has no basis file {basis}: {remedy}"
        );
        Ok(true)
    }
}

/// Prints the results of cross-validation.
fn print_validation(options: &TrainingOptions, trained: &TrainedRecipe) {
    let Some(predictor) = &trained.loss_predictor else {
        return;
    };
    let losses = options.source_shares.iter().zip(&predictor.source_losses);
    for (source, estimate) in losses {
        let error = standard_error(estimate.standard_error);
        eprintln!(
            "expected loss on {}: {:.4}{error}, {} materials",
            source.label, estimate.loss, estimate.materials
        );
    }
    if let Some(correlation) = predictor.rank_correlation {
        eprintln!(
            "loss prediction: rank correlation {correlation:.2} between predicted and true losses in cross-validation"
        );
    }
}
