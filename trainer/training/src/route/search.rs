//! A search for the fastest path through all stops.
//!
//! Iterated local search: segments of the path are moved until no move makes the path faster. Then neighboring segments
//! are exchanged at random and the local search runs again. Its result replaces the path unless it is slower.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::machine::{AxisSeconds, Machine, move_seconds};
use super::stop::Stop;

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

/// A stop in one of its poses.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub(super) stop: usize,
    pub(super) pose: usize,
    /// [`Machine::axis_seconds`] of the pose.
    seconds: AxisSeconds,
}

/// All poses of all stops, and the travel time between any two of them. This time is a symmetric metric.
pub(super) struct Points {
    /// [`Machine::axis_seconds`] of the start position.
    start: AxisSeconds,
    /// [`Machine::turn_seconds`].
    turn: f64,
    /// The points of each stop.
    pub(super) stops: Vec<Vec<Point>>,
}

impl Points {
    pub(super) fn new(machine: &Machine, stops: &[Stop]) -> Self {
        let points = |(stop, Stop { poses, .. }): (usize, &Stop)| {
            let point = |(pose, arms)| Point {
                stop,
                pose,
                seconds: machine.axis_seconds(arms),
            };
            let arms = poses.iter().map(|pose| &pose.arms);
            arms.enumerate().map(point).collect()
        };
        Self {
            start: machine.axis_seconds(&machine.start),
            turn: machine.turn_seconds(),
            stops: stops.iter().enumerate().map(points).collect(),
        }
    }

    /// Returns the travel time from one point to another, in seconds. As `from`, None means the start position. As
    /// `to`, None means the end of the path, which takes 0 s.
    pub(super) fn seconds_between(&self, from: Option<&Point>, to: Option<&Point>) -> f64 {
        let from = from.map_or(&self.start, |from| &from.seconds);
        to.map_or(0.0, |to| move_seconds(self.turn, from, &to.seconds))
    }

    /// Returns the travel time of a path from the start position, in seconds.
    pub(super) fn path_seconds(&self, path: &[Point]) -> f64 {
        let from = std::iter::once(None).chain(path.iter().map(Some));
        let moves = from.zip(path);
        moves.fold(0.0, |sum, (from, to)| {
            sum + self.seconds_between(from, Some(to))
        })
    }

    /// Returns the fastest path through stops in this order, one point per stop. The result is exact: the fastest path
    /// to a point extends the fastest path to some point of the previous stop.
    pub(super) fn fastest_poses(&self, order: impl IntoIterator<Item = usize>) -> Vec<Point> {
        /// The shortest arrival time at a point in seconds, and the index of the previous point on that path.
        type Arrival = (f64, usize);
        let mut table: Vec<(&[Point], Vec<Arrival>)> = Vec::new();
        for stop in order {
            let points = &self.stops[stop];
            let arrival = |to: &Point| match table.last() {
                None => (self.seconds_between(None, Some(to)), 0),
                Some((points, arrivals)) => {
                    let each = points.iter().zip(arrivals).enumerate();
                    let times = each.map(|(index, (from, (arrival, _)))| {
                        (arrival + self.seconds_between(Some(from), Some(to)), index)
                    });
                    fastest(times)
                }
            };
            let arrivals = points.iter().map(arrival).collect();
            table.push((points, arrivals));
        }
        let last = table.last().map_or(&[][..], |(_, arrivals)| arrivals);
        let arrivals = last.iter().enumerate();
        let (_, mut chosen) = fastest(arrivals.map(|(index, (seconds, _))| (*seconds, index)));
        let backwards = table.iter().rev().map(|(points, arrivals)| {
            let point = points[chosen];
            chosen = arrivals[chosen].1;
            point
        });
        let mut path: Vec<Point> = backwards.collect();
        path.reverse();
        path
    }

    /// Returns the fastest path that a search finds.
    pub(super) fn fastest_path(&self, effort: &Effort, seed: u64) -> Vec<Point> {
        let count = self.stops.len();
        let mut remaining = effort.max.min(effort.for_triple * (count as u64).pow(3));
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut best: Vec<Point> = self.stops.iter().map(|points| points[0]).collect();
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

    /// Moves segments and chooses poses until the path does not improve or `remaining` moves are evaluated.
    fn search_locally(&self, path: &mut Vec<Point>, remaining: &mut u64) {
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
            *path = self.fastest_poses(path.iter().map(|point| point.stop));
            if *remaining == 0 || self.path_seconds(path) > before - MIN_GAIN {
                return;
            }
        }
    }

    /// Moves the segment of `length` stops that begins at `first` to the fastest position, forward or reversed. A
    /// single stop is tried in each of its poses.
    fn move_segment(&self, path: &mut Vec<Point>, first: usize, length: usize) {
        let segment = path[first..first + length].to_vec();
        let mut rest = path.clone();
        rest.drain(first..first + length);
        let variants: Vec<Vec<Point>> = match segment[..] {
            [Point { stop, .. }] => self.stops[stop].iter().map(|point| vec![*point]).collect(),
            _ => vec![segment.clone(), segment.iter().rev().copied().collect()],
        };
        let detour = |position: usize, segment: &[Point]| {
            let before = position.checked_sub(1).map(|before| &rest[before]);
            let after = rest.get(position);
            self.seconds_between(before, segment.first())
                + self.seconds_between(segment.last(), after)
                - self.seconds_between(before, after)
        };
        let mut best = (detour(first, &segment) - MIN_GAIN, None);
        for variant in &variants {
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

/// Returns the first of the smallest times, with its index.
fn fastest(times: impl Iterator<Item = (f64, usize)>) -> (f64, usize) {
    times
        .min_by(|one, other| one.0.total_cmp(&other.0))
        .unwrap_or_default()
}
