//! Training with a progress bar, and with Ctrl-C that loses nothing.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

use glimpse_trainer::material::Material;
use glimpse_trainer::meta::run::{Learned, Options, TrainError, train};
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
