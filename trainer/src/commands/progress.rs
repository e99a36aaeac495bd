//! Training with a progress bar, and with Ctrl-C that loses nothing.

use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use glimpse_materials::Material;
use glimpse_training::meta::learned::Learned;
use glimpse_training::meta::options::Options;
use glimpse_training::meta::run::{TrainError, train};
use indicatif::{ProgressBar, ProgressStyle};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// From now on the first Ctrl-C stops training at the next step, and the second one the program.
pub(super) fn catch_interrupts() -> anyhow::Result<()> {
    static CAUGHT: AtomicBool = AtomicBool::new(false);
    if !CAUGHT.swap(true, Ordering::Relaxed) {
        ctrlc::set_handler(|| {
            if INTERRUPTED.swap(true, Ordering::Relaxed) {
                std::process::exit(130);
            }
        })?;
    }
    Ok(())
}

/// True after the first Ctrl-C.
pub(super) fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// Trains under a progress bar with loss and time left; without a terminal, a line now and then.
pub(crate) fn train_with_progress(
    options: &Options,
    materials: Vec<Box<dyn Material>>,
) -> anyhow::Result<Learned> {
    catch_interrupts()?;
    let bar = ProgressBar::new(0);
    bar.set_style(ProgressStyle::with_template(
        "{msg} {wide_bar:.cyan/dim} {pos}/{len} {per_sec} {eta} left",
    )?);
    let mut tenth = 0;
    let outcome = train(options, materials, &mut |progress| {
        let mut message = format!(
            "{}, n = {}: loss {:.4}",
            progress.phase, progress.samples, progress.loss
        );
        if let Some(best) = progress.best {
            message += &format!(", best {best:.4}");
        }
        if bar.is_hidden() {
            let now = 10 * progress.done / progress.total.max(1);
            if now > tenth {
                tenth = now;
                eprintln!("{:3} % {message}", 10 * now);
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
            "stopped after {done} outer steps, saved in {}; repeat the command with --resume to go on",
            checkpoints.directory.display()
        )),
        (outcome, _) => Ok(outcome?),
    }
}

/// Many steps of one kind, from any thread: a bar on a terminal, and elsewhere a line every ten
/// seconds, so that nothing is silent for long.
pub(crate) struct Steps {
    bar: ProgressBar,
    what: String,
    /// How many are done, and when that was last told.
    told: Mutex<(usize, Instant)>,
}

/// How long nothing is said without a terminal.
const SILENCE: Duration = Duration::from_secs(10);

impl Steps {
    pub(crate) fn new(what: &str, total: usize) -> Self {
        let bar = ProgressBar::new(total as u64);
        if let Ok(style) = ProgressStyle::with_template(
            "{msg} {wide_bar:.cyan/dim} {pos}/{len} after {elapsed}, {eta} left",
        ) {
            bar.set_style(style);
        }
        bar.set_message(what.to_owned());
        // Also while the first step lasts.
        bar.enable_steady_tick(Duration::from_millis(200));
        Self {
            bar,
            what: what.to_owned(),
            told: Mutex::new((0, Instant::now())),
        }
    }

    /// One more is done.
    pub(crate) fn done(&self) {
        self.bar.inc(1);
        let Ok(mut told) = self.told.lock() else {
            return;
        };
        told.0 += 1;
        if self.bar.is_hidden() && told.1.elapsed() > SILENCE {
            told.1 = Instant::now();
            let total = self.bar.length().unwrap_or_default();
            eprintln!("{}: {} of {total}", self.what, told.0);
        }
    }
}

impl Drop for Steps {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
