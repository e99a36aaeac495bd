//! Progress bars, and interruption of training with Ctrl-C after a checkpoint.

use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use glimpse_materials::Material;
use glimpse_training::meta::learned::LearnedRecipe;
use glimpse_training::meta::options::Options;
use glimpse_training::meta::run::{TrainError, train};
use indicatif::{ProgressBar, ProgressStyle};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Installs a handler of Ctrl-C: the first one stops training at the next step, the second one ends the program
/// with exit code 130.
pub(super) fn catch_interrupts() -> anyhow::Result<()> {
    static INSTALLED: AtomicBool = AtomicBool::new(false);
    if !INSTALLED.swap(true, Ordering::Relaxed) {
        ctrlc::set_handler(|| {
            if INTERRUPTED.swap(true, Ordering::Relaxed) {
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

/// Trains with a progress bar of loss and remaining time. Without a terminal, prints a line for each tenth of the
/// steps instead.
pub(crate) fn train_with_progress(
    options: &Options,
    materials: Vec<Box<dyn Material>>,
) -> anyhow::Result<LearnedRecipe> {
    catch_interrupts()?;
    let bar = ProgressBar::new(0);
    bar.set_style(ProgressStyle::with_template(
        "{msg} {wide_bar:.cyan/dim} {pos}/{len} {per_sec} {eta} left",
    )?);
    let mut reported_tenth = 0;
    let outcome = train(options, materials, &mut |progress| {
        let mut message = format!(
            "{}, n = {}: loss {:.4}",
            progress.phase, progress.samples, progress.loss
        );
        if let Some(best) = progress.best {
            message += &format!(", best {best:.4}");
        }
        if bar.is_hidden() {
            let current_tenth = 10 * progress.done / progress.total.max(1);
            if current_tenth > reported_tenth {
                reported_tenth = current_tenth;
                eprintln!("{:3} % {message}", 10 * reported_tenth);
            }
        } else {
            bar.set_length(progress.total as u64);
            bar.set_position(progress.done as u64);
            bar.set_message(message);
        }
        match interrupted() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    });
    bar.finish_and_clear();
    match (outcome, &options.checkpoints) {
        (Err(TrainError::Stopped(done)), Some(checkpoints)) => Err(anyhow::anyhow!(
            "stopped after {done} outer steps, which are saved in {}: repeat the command with --resume to \
             continue",
            checkpoints.directory.display()
        )),
        (outcome, _) => Ok(outcome?),
    }
}

/// Progress of equal steps, counted from any thread: a bar on a terminal, or else a line every 10 s.
pub(crate) struct StepProgress {
    bar: ProgressBar,
    label: String,
    reported: Mutex<Reported>,
}

/// State of the progress lines.
struct Reported {
    /// Number of completed steps.
    done: usize,
    /// Time of the last line.
    at: Instant,
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
        let reported = Reported {
            done: 0,
            at: Instant::now(),
        };
        Self {
            bar,
            label: label.to_owned(),
            reported: Mutex::new(reported),
        }
    }

    /// Counts one completed step.
    pub(crate) fn increment(&self) {
        self.bar.inc(1);
        let Ok(mut reported) = self.reported.lock() else {
            return;
        };
        reported.done += 1;
        if self.bar.is_hidden() && reported.at.elapsed() > REPORT_INTERVAL {
            reported.at = Instant::now();
            let total = self.bar.length().unwrap_or_default();
            eprintln!("{}: {} of {total}", self.label, reported.done);
        }
    }
}

impl Drop for StepProgress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
