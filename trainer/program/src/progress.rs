//! Progress bars, and interruption of training with Ctrl-C after a checkpoint.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, Once};
use std::time::{Duration, Instant};

use anyhow::bail;
use glimpse_fitting::recipe::options::TrainingOptions;
use glimpse_materials::Material;
use glimpse_materials::basis::BasisTable;
use glimpse_training::checkpoint::Checkpoint;
use glimpse_training::outer::{Checkpoints, TrainingProgress};
use glimpse_training::run::{TrainError, TrainedRecipe, train};
use indicatif::{ProgressBar, ProgressStyle};

use crate::output::write_file;

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Installs a handler of Ctrl-C, once: the first one stops training at the next step, the second one ends the program
/// with exit code 130.
pub(crate) fn catch_interrupts() {
    static INSTALLED: Once = Once::new();
    INSTALLED.call_once(|| {
        // Without a handler, Ctrl-C ends the program at once, and the last checkpoint remains.
        let _ = ctrlc::set_handler(|| {
            if INTERRUPTED.swap(true, Ordering::Relaxed) {
                std::process::exit(130);
            }
        });
    });
}

/// Returns true after the first Ctrl-C.
pub(crate) fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// Returns the folder of the checkpoint of a recipe's training.
pub(crate) fn checkpoint_of(out: &Path) -> PathBuf {
    let mut path = out.as_os_str().to_owned();
    path.push(".checkpoint");
    path.into()
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
    let mut on_progress = |progress: &TrainingProgress| {
        steps.show(progress);
        if interrupted() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    let outcome = train(
        options,
        data,
        materials,
        Some(&checkpoints),
        &mut on_progress,
    );
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
    Checkpoint::remove(&checkpoints.directory);
    Ok(trained)
}

/// Progress of steps, counted from any thread: a bar on a terminal, or else a line every 10 s.
pub(crate) struct StepProgress {
    bar: ProgressBar,
    /// Time of the last line.
    reported: Mutex<Instant>,
}

/// Time between two progress lines without a terminal.
const REPORT_INTERVAL: Duration = Duration::from_secs(10);

impl StepProgress {
    pub(crate) fn new(label: &str, total: usize) -> Self {
        let bar = ProgressBar::new(total as u64);
        if let Ok(style) = ProgressStyle::with_template(
            "{msg} {wide_bar:.cyan/dim} {pos}/{len} after {elapsed}, {eta} left",
        ) {
            bar.set_style(style);
        }
        bar.set_message(label.to_owned());
        // Keeps the bar alive during a long first step.
        bar.enable_steady_tick(Duration::from_millis(200));
        Self {
            bar,
            reported: Mutex::new(Instant::now()),
        }
    }

    /// Counts one completed step.
    pub(crate) fn increment(&self) {
        self.bar.inc(1);
        self.report();
    }

    /// Shows the progress of a training.
    fn show(&self, progress: &TrainingProgress) {
        let mut message = progress.phase.to_owned();
        if progress.samples > 0 {
            message += &format!(", n = {}", progress.samples);
        }
        if progress.loss.is_finite() {
            message += &format!(": loss {:.4}", progress.loss);
        }
        if let Some(best) = progress.best {
            message += &format!(", best {best:.4}");
        }
        self.bar.set_length(progress.total as u64);
        self.bar.set_position(progress.done as u64);
        self.bar.set_message(message);
        self.report();
    }

    /// Prints a line without a terminal, if the last one is old.
    fn report(&self) {
        let Ok(mut reported) = self.reported.lock() else {
            return;
        };
        if self.bar.is_hidden() && reported.elapsed() > REPORT_INTERVAL {
            *reported = Instant::now();
            let (done, total) = (self.bar.position(), self.bar.length().unwrap_or_default());
            eprintln!("{}: {done} of {total}", self.bar.message());
        }
    }
}

impl Drop for StepProgress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
