//! Progress bars, and interruption of training with Ctrl-C after a checkpoint.

use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use glimpse_fitting::recipe::options::TrainingOptions;
use glimpse_materials::Material;
use glimpse_training::outer::Checkpoints;
use glimpse_training::run::{TrainError, TrainedRecipe, train};
use indicatif::{ProgressBar, ProgressStyle};

use super::lock;

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Installs a handler of Ctrl-C: the first one stops training at the next step, the second one ends the program
/// with exit code 130.
pub(super) fn catch_interrupts() -> anyhow::Result<()> {
    static INSTALLED: AtomicBool = AtomicBool::new(false);
    if !INSTALLED.swap(true, Ordering::Relaxed) {
        ctrlc::set_handler(|| {
            if INTERRUPTED.swap(true, Ordering::Relaxed) {
                lock::remove_all();
                std::process::exit(130);
            }
        })?;
    }
    Ok(())
}

/// Returns true after the first Ctrl-C.
pub(super) fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// Trains with a progress bar of loss and remaining time.
pub(crate) fn train_with_progress(
    options: &TrainingOptions,
    data: &str,
    materials: Vec<Box<dyn Material>>,
    checkpoints: &Checkpoints,
) -> anyhow::Result<TrainedRecipe> {
    catch_interrupts()?;
    let steps = StepProgress::new("training", 0);
    let outcome = train(
        options,
        data,
        materials,
        Some(checkpoints),
        &mut |progress| {
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
            steps.bar.set_length(progress.total as u64);
            steps.bar.set_position(progress.done as u64);
            steps.bar.set_message(message);
            steps.report();
            match interrupted() {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            }
        },
    );
    drop(steps);
    match outcome {
        Err(TrainError::Stopped(done)) => Err(anyhow::anyhow!(
            "stopped after {done} outer steps, which are saved in {}: repeat the command with --resume to \
             continue",
            checkpoints.directory.display()
        )),
        outcome => Ok(outcome?),
    }
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
