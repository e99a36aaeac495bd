//! Progress bars, and interruption with Ctrl-C.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, Once};
use std::time::{Duration, Instant};

use glimpse_training::outer::TrainingProgress;
use indicatif::{ProgressBar, ProgressStyle};

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
    pub(crate) fn show(&self, progress: &TrainingProgress) {
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
