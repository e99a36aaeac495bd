//! How long an item takes.

use std::time::Instant;

use super::Item;

/// Times of one task, in milliseconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    /// Half of the runs were faster.
    pub median: f64,
    /// A tenth of them was faster.
    pub fast: f64,
    /// A tenth of them was slower.
    pub slow: f64,
    /// How many runs there were.
    pub runs: usize,
    /// Floating-point operations a second, in 10^9, by the median; two for each
    /// multiply-accumulate.
    pub gflops: Option<f64>,
}

/// Fewest runs.
const LEAST_RUNS: usize = 5;

/// Runs an item over and over for so many seconds, after a tenth of them to warm up.
pub fn measure(item: &mut Item<'_>, seconds: f64) -> Timing {
    repeat(item, 0.1 * seconds);
    let mut times = repeat(item, seconds);
    times.sort_by(f64::total_cmp);
    let quantile = |share: f64| {
        let index = (share * (times.len() - 1) as f64).round() as usize;
        1e3 * times[index] / item.tasks as f64
    };
    let median = quantile(0.5);
    Timing {
        median,
        fast: quantile(0.1),
        slow: quantile(0.9),
        runs: times.len(),
        gflops: item
            .multiply_accumulates
            .map(|count| 2e-6 * count as f64 / item.tasks as f64 / median),
    }
}

/// The time of each run, in seconds.
fn repeat(item: &mut Item<'_>, seconds: f64) -> Vec<f64> {
    let mut times = Vec::new();
    let begin = Instant::now();
    while times.len() < LEAST_RUNS || begin.elapsed().as_secs_f64() < seconds {
        let start = Instant::now();
        item.run();
        times.push(start.elapsed().as_secs_f64());
    }
    times
}
