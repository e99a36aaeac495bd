//! `trainer train`

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, bail, ensure};
use clap::Args;
use glimpse_core::model::ModelKind;
use glimpse_fitting::recipe::RecipeFile;
use glimpse_fitting::recipe::options::{Schedule, TrainingOptions};
use glimpse_materials::basis::Basis;
use glimpse_materials::files::is_stream;
use glimpse_materials::{Material, MaterialsAndShares, Source, SourceShare, Sources};
use glimpse_training::checkpoint::Checkpoint;
use glimpse_training::outer::Checkpoints;
use glimpse_training::run::{TrainedRecipe, check};

use super::expected_loss::expected_loss;
use super::geometry::read_directions;
use super::load_all;
use super::lock::Lock;
use super::output::{check_out, write_file};
use super::progress::train_with_progress;

/// Train a recipe on materials.
///
/// SCHEDULES. With --schedule prior, the default, a recipe completes the readings: a small learned
/// map estimates the whole material from them. For models other than linear, a descent refines the
/// estimate. Training uses all materials. Four-fold cross-validation follows: four shorter trainings,
/// each without a quarter of the materials. They yield the expected loss on unseen materials, and
/// the predictor of a material's loss from its readings.
///
/// With --schedule paper, every tenth material is held out, and the loss on those is the
/// expected loss. The model linear holds none out: its loss on each material is that with the
/// components of the other materials.
///
/// RESUMING. The run is saved at least every ten seconds, and on Ctrl-C. The same command with --resume
/// continues it, also after kill -9, and writes the same bytes as an uninterrupted run. A recipe
/// that was trained with other options is replaced only with --force. Two runs cannot write the same
/// recipe at once.
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
        let run = self.training_run(seed)?;
        let _lock = run.lock()?;
        let (materials, source_shares) = load_all(&run.sources)?;
        let trained = run.is_trained(&source_shares);
        let trained = run.refuse_overwrite(trained, self.resume, self.force)?;
        if self.resume && !Checkpoint::exists_in(&run.checkpoint) {
            if trained {
                Checkpoint::remove(&run.checkpoint);
                eprintln!("{} is already trained", self.out.display());
                return Ok(());
            }
            eprintln!(
                "no checkpoint in {}: starting from the beginning",
                run.checkpoint.display()
            );
        }
        let begin = Instant::now();
        let trained = run.train((materials, source_shares), self.resume)?;
        let expected_loss = expected_loss(&trained.recipe())?;
        eprintln!(
            "trained in {:.0} s; expected loss {}",
            begin.elapsed().as_secs_f64(),
            expected_loss.unwrap_or_else(|| "not stated".into()),
        );
        Ok(())
    }

    /// Returns the training, with valid options.
    fn training_run(&self, seed: u64) -> anyhow::Result<TrainingRun> {
        let mut options = TrainingOptions {
            seed,
            ..self.options.clone()
        };
        if let Some(path) = &self.pattern {
            options.pattern = read_directions(path).context("--pattern names a file")?;
        }
        check(&options)?;
        let mut checkpoint = self.out.clone().into_os_string();
        checkpoint.push(".checkpoint");
        Ok(TrainingRun {
            sources: Sources::new(self.data.clone(), &options.share)?,
            options,
            checkpoint: checkpoint.into(),
            out: self.out.clone(),
        })
    }
}

/// The training of one recipe.
struct TrainingRun {
    options: TrainingOptions,
    sources: Sources,
    out: PathBuf,
    checkpoint: PathBuf,
}

impl TrainingRun {
    /// Locks the recipe and its checkpoint.
    fn lock(&self) -> anyhow::Result<Lock> {
        Lock::of_path(&self.out)
    }

    /// Refuses to replace a recipe, a basis or an unfinished run, unless `force` is set. Takes and returns the result of
    /// [`Self::is_trained`].
    fn refuse_overwrite(
        &self,
        trained: anyhow::Result<bool>,
        resume: bool,
        force: bool,
    ) -> anyhow::Result<bool> {
        if force {
            return Ok(trained.unwrap_or_default());
        }
        let trained = trained?;
        let unfinished = Checkpoint::exists_in(&self.checkpoint);
        let basis = Basis::path_for(&self.out);
        match trained {
            _ if unfinished && !resume => bail!(
                "{} holds an unfinished run: give --resume to continue it, or --force to discard it",
                self.checkpoint.display()
            ),
            // With a checkpoint, the basis is that of the unfinished run.
            false if self.has_basis() && basis.exists() && !unfinished => bail!(
                "{} exists without its recipe {}, and may belong to another recipe: give --force to \
                 replace it, or another --out",
                basis.display(),
                self.out.display()
            ),
            _ => Ok(trained),
        }
    }

    /// Returns true if the recipe has a basis, as a file next to it.
    fn has_basis(&self) -> bool {
        self.options.model == ModelKind::Linear || self.options.samples == 0
    }

    /// Returns true if the recipe is already trained on materials of these sources.
    ///
    /// # Errors
    /// If another file has the recipe's path.
    fn is_trained(&self, source_shares: &[SourceShare]) -> anyhow::Result<bool> {
        if !self.out.exists() {
            return Ok(false);
        }
        let out = self.out.display();
        let remedy = "give --force to replace it, or another --out";
        let file =
            RecipeFile::read(&self.out).with_context(|| format!("{out} exists: {remedy}"))?;
        let options = TrainingOptions {
            source_shares: source_shares.to_vec(),
            ..self.options.clone()
        };
        let trained = file.metadata().options();
        ensure!(
            trained.map(|trained| trained.identity(&[])) == Some(options.identity(&[])),
            "{out} was trained with other options or materials: {remedy}"
        );
        let basis = Basis::path_for(&self.out);
        ensure!(
            !self.has_basis() || basis.exists(),
            "{out} has no basis file {}: {remedy}",
            basis.display()
        );
        Ok(true)
    }

    /// Trains the recipe and writes it. Replaces existing files. Prints the sources of the training tasks, and the results of
    /// cross-validation.
    fn train(
        &self,
        (materials, source_shares): MaterialsAndShares,
        resume: bool,
    ) -> anyhow::Result<RecipeFile> {
        // An unwritable output is reported before training, not after hours of it.
        check_out(&self.out)?;
        let options = TrainingOptions {
            source_shares,
            ..self.options.clone()
        };
        let checkpoints = Checkpoints {
            directory: self.checkpoint.clone(),
            resume,
        };
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
        let trained = train_to_file(
            &options,
            materials,
            &checkpoints,
            &self.sources.label(),
            &self.out,
        )?;
        if let Some(predictor) = &trained.loss_predictor {
            let losses = options.source_shares.iter().zip(&predictor.source_losses);
            for (source, estimate) in losses {
                let error = estimate.standard_error.map_or(String::new(), |error| {
                    format!(" (standard error {error:.4})")
                });
                eprintln!(
                    "expected loss on {}: {:.4}{error}, {} materials",
                    source.label, estimate.loss, estimate.materials
                );
            }
            if let Some(correlation) = predictor.rank_correlation {
                eprintln!(
                    "loss prediction: rank correlation {correlation:.2} between predicted and true losses in \
                     cross-validation"
                );
            }
        }
        Ok(trained.file)
    }
}

/// Trains a recipe on materials called `data`, writes it, and removes its checkpoint. Replaces existing files.
pub(super) fn train_to_file(
    options: &TrainingOptions,
    materials: Vec<Box<dyn Material>>,
    checkpoints: &Checkpoints,
    data: &str,
    out: &Path,
) -> anyhow::Result<TrainedRecipe> {
    let trained = train_with_progress(options, data, materials, checkpoints)?;
    if let Some(basis) = &trained.basis {
        // The basis is written first, because the recipe is useless without it.
        write_file(&Basis::path_for(out), basis, true)?;
    }
    write_file(out, trained.file.bytes(), true)?;
    Checkpoint::remove(&checkpoints.directory);
    Ok(trained)
}
