//! A fast order of samples, for training.

use super::axes::Axes;
use super::exact;
use super::machine::Machine;
use super::points::Points;
use super::search;
use super::stop::{Pose, Stop};

/// The largest number of stops for which a quick search is exact, too.
const MAX_QUICK_EXACT: usize = 10;
/// The number of moves that a quick search evaluates, for each pair of stops.
const QUICK_EFFORT: u64 = 300;
/// The largest number of moves that a quick search evaluates.
const MAX_QUICK_EFFORT: u64 = 1_000_000;
/// The number of moves that a thorough search evaluates.
const THOROUGH_EFFORT: u64 = 10_000_000;

/// Returns an order in which a machine visits positions of its arms, as indices. It is at least as fast as the given order,
/// and the fastest for few positions. The machine must be [valid](Machine::validate).
#[must_use]
pub fn fast_order(machine: &Machine, arms: &[Axes], thorough: bool) -> Vec<usize> {
    let stop = |(index, arms): (usize, &Axes)| Stop {
        index,
        poses: vec![Pose {
            arms: *arms,
            swapped: false,
        }],
    };
    let stops: Vec<Stop> = arms.iter().enumerate().map(stop).collect();
    let points = Points::new(machine, &stops);
    let (max_exact, effort) = match thorough {
        true => (exact::MAX_STOPS, THOROUGH_EFFORT),
        false => {
            let effort = QUICK_EFFORT * (arms.len() as u64).pow(2);
            (MAX_QUICK_EXACT, effort.min(MAX_QUICK_EFFORT))
        }
    };
    match arms.len() <= max_exact {
        true => exact::fastest_path(&points),
        false => search::search(&points, 0, effort),
    }
}
