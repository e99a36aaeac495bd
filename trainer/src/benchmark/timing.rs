//! Timing of benchmark items.

use std::time::Instant;

use super::Item;

/// The time per task, in milliseconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    /// The median of the runs.
    pub median: f64,
    /// The 10th percentile.
    pub fast: f64,
    /// The 90th percentile.
    pub slow: f64,
    /// The number of runs.
    pub runs: usize,
    /// Floating-point operations per second at the median, in 10^9; a multiply-accumulate counts as two.
    pub gflops: Option<f64>,
}

/// The minimum number of runs.
const MIN_RUNS: usize = 5;

/// Times an item for `seconds` seconds, after a warm-up of a tenth of that time.
pub fn measure(item: &mut Item<'_>, seconds: f64) -> Timing {
    run_times(item, 0.1 * seconds);
    let mut times = run_times(item, seconds);
    times.sort_by(f64::total_cmp);
    let quantile = |fraction: f64| {
        let index = (fraction * (times.len() - 1) as f64).round() as usize;
        1e3 * times[index] / item.tasks as f64
    };
    let median = quantile(0.5);
    Timing {
        median,
        fast: quantile(0.1),
        slow: quantile(0.9),
        runs: times.len(),
        // 2 operations per multiply-accumulate, 1e3 ms per s, and 1e9 operations per GFLOP.
        gflops: item
            .multiply_accumulates
            .map(|count| 2e-6 * count as f64 / item.tasks as f64 / median),
    }
}

/// Runs an item for `seconds` seconds and at least [`MIN_RUNS`] times. Returns the time of each run, in seconds.
fn run_times(item: &mut Item<'_>, seconds: f64) -> Vec<f64> {
    let mut times = Vec::new();
    let begin = Instant::now();
    while times.len() < MIN_RUNS || begin.elapsed().as_secs_f64() < seconds {
        let run_begin = Instant::now();
        item.run();
        times.push(run_begin.elapsed().as_secs_f64());
    }
    times
}
