//! Threads that stay awake during a computation and share its sums.
//!
//! Waking a thread takes about 20 us, as long as a sum over 512 samples. So the threads of a crew wait for work without
//! sleeping.

use std::hint::spin_loop;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError, Weak};

/// Chunks of a sum, taken one by one.
struct Job<'s, R> {
    compute: Box<dyn Fn(usize) -> R + Send + Sync + 's>,
    taken: AtomicUsize,
    results: Vec<OnceLock<R>>,
}

impl<R> Job<'_, R> {
    /// Computes chunks until all are taken.
    fn work(&self) {
        let take = || self.taken.fetch_add(1, Ordering::Relaxed);
        let mut chunk = take();
        while let Some(result) = self.results.get(chunk) {
            result.get_or_init(|| (self.compute)(chunk));
            chunk = take();
        }
    }

    /// Returns a chunk's result, computed here if the thread that took it panicked.
    fn result(&self, chunk: usize) -> &R {
        let result = &self.results[chunk];
        let mut looks = 0..1_000; // about 50 us; then this thread sleeps
        while result.get().is_none() && looks.next().is_some() {
            spin_loop();
        }
        result.get_or_init(|| (self.compute)(chunk))
    }
}

/// The threads of a computation. The lifetime `'s` is that of the samples.
pub(crate) struct Crew<'s, R>(Mutex<Option<Arc<Job<'s, R>>>>);

impl<'s, R: Clone + Send + Sync> Crew<'s, R> {
    /// Runs a computation whose sums have at most `chunks` chunks. Threads of the thread pool that have nothing else to
    /// do join the crew.
    pub(crate) fn run<T: Send>(chunks: usize, computation: impl FnOnce(&Self) -> T + Send) -> T {
        let crew = Self(Mutex::new(None));
        rayon::scope(|scope| {
            let presence = Arc::new(()); // dropped when the computation ends, even by a panic
            for _ in 1..rayon::current_num_threads().min(chunks) {
                let presence = Arc::downgrade(&presence);
                scope.spawn(|_| crew.help(presence));
            }
            computation(&crew)
        })
    }

    /// Works on all jobs until the computation drops its `presence`.
    fn help(&self, presence: Weak<()>) {
        while presence.strong_count() > 0 {
            let job = self
                .0
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .clone();
            job.iter().for_each(|job| job.work());
            std::thread::yield_now();
        }
    }

    /// Returns the result of `compute` for each chunk.
    pub(crate) fn map(
        &self,
        chunks: usize,
        compute: impl Fn(usize) -> R + Send + Sync + 's,
    ) -> Vec<R> {
        let job = Arc::new(Job {
            compute: Box::new(compute),
            taken: AtomicUsize::new(0),
            results: (0..chunks).map(|_| OnceLock::new()).collect(),
        });
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::clone(&job));
        job.work();
        (0..chunks).map(|chunk| job.result(chunk).clone()).collect()
    }
}
