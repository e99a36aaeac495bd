//! Long computations without the GIL, which Ctrl-C can interrupt, in a thread pool of this process.

use std::mem::forget;
use std::process;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::error::{Result, panic_exception};

/// Interval at which signals are checked and progress is reported.
const PERIOD: Duration = Duration::from_millis(20);

/// The thread pool, and the id of the process that has its threads.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// Returns a new pool of `threads` threads (0 for the default number), or that of this process. A forked process inherits a pool
/// without threads: it leaks that one, and makes another.
///
/// The lock is held together with the GIL only, which Python's fork holds too: a forked process finds it unlocked.
fn pool(_: Python<'_>, threads: Option<usize>) -> Result<Arc<ThreadPool>> {
    let mut shared = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    let is_own = |(id, _): &&(u32, _)| threads.is_none() && *id == process::id();
    if let Some((_, pool)) = shared.as_ref().filter(is_own) {
        return Ok(pool.clone());
    }
    let builder = ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0));
    let pool = Arc::new(builder.build()?);
    if threads.is_none() {
        forget(shared.replace((process::id(), pool.clone())));
    }
    Ok(pool)
}

/// Runs `work` in a pool of `threads` threads (0 for the default number), or in that of the process, without the GIL, so that
/// other Python threads continue. Long work has a pool of its own, so that short work does not wait for it.
///
/// Meanwhile the calling thread checks for signals and calls `report`, which may call Python. If either raises an
/// exception, the flag passed to `work` is set. The exception is returned as soon as `work` has ended.
pub(crate) fn run_interruptible<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    mut report: impl FnMut(Python<'_>) -> PyResult<()> + Send,
    work: impl FnOnce(&AtomicBool) -> T + Send,
) -> Result<T> {
    let pool = &pool(py, threads)?;
    py.detach(|| {
        let stop = AtomicBool::new(false);
        let stop = &stop;
        thread::scope(|scope| {
            let (sender, end) = sync_channel::<()>(0);
            let worker = scope.spawn(move || {
                // Dropping it signals the end, also after a panic.
                let _sender = sender;
                pool.install(|| work(stop))
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
    run_interruptible(py, None, |_| Ok(()), |_| work())
}
