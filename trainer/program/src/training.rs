//! A training with a progress bar, from its materials to the files of the recipe.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use anyhow::bail;
use glimpse_fitting::recipe::options::TrainingOptions;
use glimpse_materials::Material;
use glimpse_materials::basis::BasisTable;
use glimpse_training::checkpoint::TrainingState;
use glimpse_training::outer::{Checkpoints, TrainingProgress};
use glimpse_training::run::{TrainError, TrainedRecipe, train};

use crate::output::write_file;
use crate::progress::{StepProgress, catch_interrupts, interrupted};

/// Returns the folder of the checkpoint of a recipe's training.
pub(crate) fn checkpoint_of(out: &Path) -> PathBuf {
    out.with_added_extension("checkpoint")
}

/// Trains a recipe on materials called `data` with a progress bar of loss and remaining time, writes it, and removes its
/// checkpoint. Replaces existing files. `resume` continues from a checkpoint.
pub(crate) fn train_to_file(
    options: &TrainingOptions,
    materials: Vec<Box<dyn Material>>,
    resume: bool,
    data: &str,
    out: &Path,
) -> anyhow::Result<TrainedRecipe> {
    catch_interrupts();
    let checkpoints = Checkpoints {
        directory: checkpoint_of(out),
        resume,
    };
    let steps = StepProgress::new("training", 0);
    let on_progress = &mut |progress: &TrainingProgress| {
        steps.show(progress);
        if interrupted() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    let outcome = train(options, data, materials, Some(&checkpoints), on_progress);
    drop(steps);
    let trained = match outcome {
        Err(TrainError::Stopped(done)) => bail!(
            "stopped after {done} outer steps, which are saved in {}: repeat the command with --resume to \
             continue",
            checkpoints.directory.display()
        ),
        outcome => outcome?,
    };
    if let Some(basis) = &trained.basis {
        // The basis is written first, because the recipe is useless without it.
        write_file(&BasisTable::path_for(out), basis, true)?;
    }
    write_file(out, trained.file.bytes(), true)?;
    TrainingState::remove(&checkpoints.directory);
    Ok(trained)
}
