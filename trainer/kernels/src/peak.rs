//! A measurement of the machine's peak throughput of multiply-accumulates.

use std::hint::black_box;
use std::time::Instant;

use crate::lanes::{InstructionSet, Lanes, WIDTH, kernel};

/// The number of independent sums. Two arithmetic units with a latency of four cycles need at least eight sums.
const SUMS: usize = 12;
/// The number of additions to each sum in one burst, which takes about 100 us.
const ROUNDS: usize = 30_000;
/// The number of consecutive bursts per thread for all threads. It makes the time to wake up the threads negligible.
const BURSTS_PER_THREAD: usize = 20;

/// Measures for `seconds` on one thread, or on all threads of the pool, on the SIMD lanes of the kernels. Returns the
/// highest throughput of any burst, in 10^9 floating-point operations per second; a multiply-accumulate counts as two.
#[must_use]
pub fn peak(is_parallel: bool, seconds: f64) -> f64 {
    let start = [0.0; SUMS];
    let begin = Instant::now();
    let mut gflops = 0.0_f64;
    while begin.elapsed().as_secs_f64() < seconds {
        let burst_begin = Instant::now();
        let count: usize = match is_parallel {
            false => burst(&start),
            true => rayon::broadcast(|_| {
                let bursts = 0..BURSTS_PER_THREAD;
                bursts.map(|_| burst(&start)).sum::<usize>()
            })
            .into_iter()
            .sum(),
        };
        gflops = gflops.max(2e-9 * count as f64 / burst_begin.elapsed().as_secs_f64());
    }
    gflops
}

kernel! {
    on InstructionSet::detect();
    /// Computes a burst of multiply-accumulates. Returns their number.
    fn burst<'a, L: Lanes>(begin: &'a [f32; SUMS]) -> usize {
        // `black_box` keeps the compiler from computing the result at compile time.
        let factor = L::broadcast(black_box(0.5));
        let term = L::broadcast(black_box(1.0));
        let mut sums = [term; SUMS];
        for (sum, begin) in sums.iter_mut().zip(begin) {
            *sum = L::broadcast(black_box(*begin));
        }
        for _ in 0..ROUNDS {
            for sum in &mut sums {
                *sum = term.plus_product(*sum, factor);
            }
        }
        for sum in sums {
            black_box(sum.total());
        }
        ROUNDS * SUMS * L::OCTETS * WIDTH
    }
}
