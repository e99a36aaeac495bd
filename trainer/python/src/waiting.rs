//! Long work without Python's lock, and Ctrl-C that works meanwhile.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;

use crate::error::defect;

/// How often signals are looked at, and progress is told.
const PERIOD: Duration = Duration::from_millis(20);

/// Does `work` on a thread of its own, and lets other Python threads run until it is done.
///
/// This thread looks at signals meanwhile, and calls `tell`, which may call into Python. If either raises,
/// `work` is asked to stop by the flag that it was given; what was raised is the outcome once it has
/// stopped.
pub(crate) fn waiting<T: Send>(
    py: Python<'_>,
    mut tell: impl FnMut(Python<'_>) -> PyResult<()> + Send,
    work: impl FnOnce(&AtomicBool) -> T + Send,
) -> PyResult<T> {
    py.detach(|| {
        let stop = AtomicBool::new(false);
        let stop = &stop;
        thread::scope(|scope| {
            let (ended, wait) = sync_channel::<()>(0);
            let worker = scope.spawn(move || {
                // Dropped at the end, also if there is a panic.
                let _ended = ended;
                work(stop)
            });
            let mut look = || Python::attach(|py| py.check_signals().and_then(|()| tell(py)));
            let mut raised = None;
            while wait.recv_timeout(PERIOD) == Err(RecvTimeoutError::Timeout) {
                if raised.is_none()
                    && let Err(error) = look()
                {
                    stop.store(true, Ordering::Relaxed);
                    raised = Some(error);
                }
            }
            let done = worker.join().map_err(|payload| defect(&*payload));
            match raised {
                Some(error) => Err(error),
                // What there was to tell last.
                None => done.and_then(|done| look().map(|()| done)),
            }
        })
    })
}

/// The same for work that nobody is told of and that cannot be stopped; it takes a second or so.
pub(crate) fn detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    waiting(py, |_| Ok(()), |_| work())
}
