//! The fastest that this machine multiplies and adds, measured.

use std::hint::black_box;
use std::time::Instant;

use super::Threads;
use glimpse_kernels::lanes::{InstructionSet, Kernel, Lanes, WIDTH};

/// Sums that do not wait for each other: two units of a latency of four need eight.
const CHAINS: usize = 12;
/// How often each is added to in one burst; that takes some 100 us.
const ROUNDS: usize = 30_000;
/// As many bursts are one on several threads: waking these up then does not count.
const LONG: usize = 20;

/// A peak.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// The lanes.
    pub instruction_set: InstructionSet,
    /// On how many threads.
    pub threads: usize,
    /// Floating-point operations a second, in 10^9; a multiply-accumulate is two.
    pub gflops: f64,
}

/// The most that any of many bursts reached in so many seconds, on the kernels' own lanes.
#[must_use]
pub fn peak(instruction_set: InstructionSet, threads: Threads, seconds: f64) -> Peak {
    let begin = Instant::now();
    let mut gflops = 0.0_f64;
    while begin.elapsed().as_secs_f64() < seconds {
        let start = Instant::now();
        let done: usize = match threads {
            Threads::One => instruction_set.run(Burst),
            Threads::All => rayon::broadcast(|_| {
                let bursts = 0..LONG;
                bursts.map(|_| instruction_set.run(Burst)).sum::<usize>()
            })
            .into_iter()
            .sum(),
        };
        gflops = gflops.max(2e-9 * done as f64 / start.elapsed().as_secs_f64());
    }
    Peak {
        instruction_set,
        threads: threads.count(),
        gflops,
    }
}

/// Multiplies and adds, and nothing else; tells how often.
struct Burst;

impl Kernel for Burst {
    type Output = usize;

    #[inline(always)]
    fn run<L: Lanes>(self) -> usize {
        // Single registers: as many as there are chains.
        self.compute::<L::Narrow>()
    }
}

impl Burst {
    #[inline(always)]
    fn compute<L: Lanes>(self) -> usize {
        // Hidden from the compiler, or it would compute all of it itself.
        let factor = L::broadcast(black_box(0.5));
        let term = L::broadcast(black_box(1.0));
        let mut sums = [term; CHAINS];
        for (index, sum) in sums.iter_mut().enumerate() {
            *sum = L::broadcast(black_box(index as f32));
        }
        for _ in 0..ROUNDS {
            for sum in &mut sums {
                *sum = term.plus_product(*sum, factor);
            }
        }
        for sum in sums {
            black_box(sum.total());
        }
        ROUNDS * CHAINS * L::OCTETS * WIDTH
    }
}
