//! Long computations without the GIL, which Ctrl-C can interrupt.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;

use crate::error::{Result, panic_exception};

/// Interval at which signals are checked and progress is reported.
const PERIOD: Duration = Duration::from_millis(20);

/// Runs `work` on another thread without the GIL, so that other Python threads continue.
///
/// Meanwhile the calling thread checks for signals and calls `report`, which may call Python. If either raises an
/// exception, the flag passed to `work` is set. The exception is returned as soon as `work` has ended.
pub(crate) fn run_interruptible<T: Send>(
    py: Python<'_>,
    mut report: impl FnMut(Python<'_>) -> PyResult<()> + Send,
    work: impl FnOnce(&AtomicBool) -> T + Send,
) -> Result<T> {
    py.detach(|| {
        let stop = AtomicBool::new(false);
        let stop = &stop;
        thread::scope(|scope| {
            let (sender, end) = sync_channel::<()>(0);
            let worker = scope.spawn(move || {
                // Dropping it signals the end, also after a panic.
                let _sender = sender;
                work(stop)
            });
            let mut poll = || Python::attach(|py| py.check_signals().and_then(|()| report(py)));
            let mut exception = None;
            while end.recv_timeout(PERIOD) == Err(RecvTimeoutError::Timeout) {
                if exception.is_none()
                    && let Err(error) = poll()
                {
                    stop.store(true, Ordering::Relaxed);
                    exception = Some(error);
                }
            }
            let result = worker.join().map_err(|payload| panic_exception(&*payload));
            if let Some(error) = exception {
                return Err(error.into());
            }
            let result = result?;
            poll()?; // reports the last progress
            Ok(result)
        })
    })
}

/// Runs short work of about a second without the GIL. It reports no progress and cannot be interrupted.
pub(crate) fn run_detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> Result<T> {
    run_interruptible(py, |_| Ok(()), |_| work())
}
