//! A search for the fastest path through all stops.
//!
//! Iterated local search: segments of the path are moved until no move makes the path faster. Then neighboring segments
//! are exchanged at random and the local search runs again. Its result replaces the path unless it is slower.

use glimpse_core::geometry::Arms;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::machine::{AxisSeconds, TimedMachine, move_seconds};

/// A number of moves to evaluate. The limit is a count and not a time, so that a seed determines the route.
pub(super) struct Effort {
    /// The number for each triple of stops.
    pub(super) for_triple: u64,
    /// The largest number.
    pub(super) max: u64,
}

/// The effort of a search during training, which takes milliseconds.
pub(super) const QUICK: Effort = Effort {
    for_triple: 40,
    max: 1_000_000,
};
/// The effort of a planned scan, which takes at most a few seconds.
pub(super) const THOROUGH: Effort = Effort {
    for_triple: 3_000,
    max: 100_000_000,
};

/// The smallest improvement of a path, in seconds. Smaller differences are rounding.
const MIN_GAIN: f64 = 1e-9;
/// The largest number of stops in a segment that is moved.
const MAX_SEGMENT: usize = 6;
/// The largest number of stops that a random exchange affects.
const MAX_WINDOW: usize = 50;

/// The travel time between any two stops, which are named by their indices. This time is a symmetric metric.
pub(super) struct Points {
    /// [`TimedMachine::axis_seconds`] of the start position.
    start: AxisSeconds,
    /// [`TimedMachine::turn_seconds`].
    turn: f64,
    /// [`TimedMachine::axis_seconds`] of each stop.
    stops: Vec<AxisSeconds>,
}

/// Returns the moves of a path. The first one is from the start position.
pub(super) fn moves(path: &[usize]) -> impl Iterator<Item = (Option<&usize>, &usize)> {
    std::iter::once(None).chain(path.iter().map(Some)).zip(path)
}

impl Points {
    pub(super) fn new(machine: &TimedMachine, stops: &[Arms<f64>]) -> Self {
        let seconds = stops.iter().map(|arms| machine.axis_seconds(arms));
        Self {
            start: machine.axis_seconds(&TimedMachine::START),
            turn: machine.turn_seconds(),
            stops: seconds.collect(),
        }
    }

    /// Returns the travel time from one stop to another, in seconds. As `from`, None means the start position. As
    /// `to`, None means the end of the path, which takes 0 s.
    pub(super) fn seconds_between(&self, from: Option<&usize>, to: Option<&usize>) -> f64 {
        let from = from.map_or(&self.start, |from| &self.stops[*from]);
        to.map_or(0.0, |to| move_seconds(self.turn, from, &self.stops[*to]))
    }

    /// Returns the travel time of a path from the start position, in seconds.
    pub(super) fn path_seconds(&self, path: &[usize]) -> f64 {
        moves(path).fold(0.0, |sum, (from, to)| {
            sum + self.seconds_between(from, Some(to))
        })
    }

    /// Returns the fastest path that a search finds.
    pub(super) fn fastest_path(&self, effort: &Effort, seed: u64) -> Vec<usize> {
        let count = self.stops.len();
        let mut remaining = effort.max.min(effort.for_triple * (count as u64).pow(3));
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut best: Vec<usize> = (0..count).collect();
        self.search_locally(&mut best, &mut remaining);
        let mut shortest = self.path_seconds(&best);
        while remaining > 0 && count > 2 {
            let mut path = best.clone();
            let window = MAX_WINDOW.min(count);
            let begin = random.random_range(0..=count - window);
            // Two exchanges, because a single move can undo one exchange of short segments.
            for _ in 0..2 {
                let mut cuts = [0; 3].map(|_| begin + random.random_range(0..=window));
                cuts.sort_unstable();
                path[cuts[0]..cuts[2]].rotate_left(cuts[1] - cuts[0]);
            }
            self.search_locally(&mut path, &mut remaining);
            let seconds = self.path_seconds(&path);
            if seconds <= shortest {
                (best, shortest) = (path, seconds);
            }
        }
        best
    }

    /// Moves segments until the path does not improve or `remaining` moves are evaluated.
    fn search_locally(&self, path: &mut Vec<usize>, remaining: &mut u64) {
        loop {
            let before = self.path_seconds(path);
            for first in 0..path.len() {
                for length in 1..=MAX_SEGMENT.min(path.len() - first) {
                    self.move_segment(path, first, length);
                }
                *remaining = remaining.saturating_sub((2 * MAX_SEGMENT * path.len()) as u64);
                if *remaining == 0 {
                    break;
                }
            }
            if *remaining == 0 || self.path_seconds(path) > before - MIN_GAIN {
                return;
            }
        }
    }

    /// Moves the segment of `length` stops that begins at `first` to the fastest position, forward or reversed.
    fn move_segment(&self, path: &mut Vec<usize>, first: usize, length: usize) {
        let segment = path[first..first + length].to_vec();
        let mut rest = path.clone();
        rest.drain(first..first + length);
        let reversed: Vec<usize> = segment.iter().rev().copied().collect();
        let detour = |position: usize, segment: &[usize]| {
            let before = position.checked_sub(1).map(|before| &rest[before]);
            let after = rest.get(position);
            self.seconds_between(before, segment.first())
                + self.seconds_between(segment.last(), after)
                - self.seconds_between(before, after)
        };
        let mut best = (detour(first, &segment) - MIN_GAIN, None);
        for variant in [&segment, &reversed] {
            for position in 0..=rest.len() {
                let seconds = detour(position, variant);
                if seconds < best.0 {
                    best = (seconds, Some((position, variant)));
                }
            }
        }
        if let (_, Some((position, variant))) = best {
            rest.splice(position..position, variant.iter().copied());
            *path = rest;
        }
    }
}
