//! Threads that stay awake during a computation and share its sums.
//!
//! Waking a thread takes about 20 us, as long as a sum over 512 samples. So the threads of a crew wait without sleeping.

use std::hint::spin_loop;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock, PoisonError, RwLock};
use std::thread::yield_now;

/// The number of looks, about 50 us, after which a waiting thread lets others run. It matters if there are more threads
/// than processors.
const LOOKS: usize = 1024;

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
        for _ in 0..LOOKS {
            if result.get().is_some() {
                break;
            }
            spin_loop();
        }
        result.get_or_init(|| (self.compute)(chunk))
    }
}

/// The threads of a computation. The lifetime `'s` is that of the samples.
pub(crate) struct Crew<'s, R> {
    job: RwLock<Option<Arc<Job<'s, R>>>>,
    /// The number of jobs so far.
    jobs: AtomicUsize,
    is_dismissed: AtomicBool,
}

/// Dismisses a crew when the computation ends, even by a panic.
struct Dismissal<'c>(&'c AtomicBool);

impl Drop for Dismissal<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Release);
    }
}

impl<'s, R: Clone + Send + Sync> Crew<'s, R> {
    /// Runs a computation whose sums have at most `chunks` chunks. Threads of the thread pool that have nothing else to
    /// do join the crew.
    pub(crate) fn run<T: Send>(chunks: usize, computation: impl FnOnce(&Self) -> T + Send) -> T {
        let crew = Self {
            job: RwLock::new(None),
            jobs: AtomicUsize::new(0),
            is_dismissed: AtomicBool::new(false),
        };
        rayon::scope(|scope| {
            for _ in 1..rayon::current_num_threads().min(chunks) {
                scope.spawn(|_| crew.help());
            }
            let _dismissal = Dismissal(&crew.is_dismissed);
            computation(&crew)
        })
    }

    /// Works on all jobs until the crew is dismissed.
    fn help(&self) {
        let (mut known, mut looks) = (0, 0);
        while !self.is_dismissed.load(Ordering::Acquire) {
            let jobs = self.jobs.load(Ordering::Acquire);
            looks += 1;
            if jobs != known {
                known = jobs;
                // The lock is released at the end of the statement, before the work.
                let job = Option::clone(&self.job.read().unwrap_or_else(PoisonError::into_inner));
                job.iter().for_each(|job| job.work());
            } else if looks % LOOKS == 0 {
                yield_now();
            } else {
                spin_loop();
            }
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
        *self.job.write().unwrap_or_else(PoisonError::into_inner) = Some(Arc::clone(&job));
        self.jobs.fetch_add(1, Ordering::Release);
        job.work();
        (0..chunks).map(|chunk| job.result(chunk).clone()).collect()
    }
}
