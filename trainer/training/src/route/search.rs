//! A heuristic search for a fast path, for more stops than the exact algorithm can handle.
//!
//! Iterated local search: segments of the path are moved until no move makes the path faster. Then neighboring segments
//! are exchanged at random and the local search runs again. Its result replaces the path unless it is slower.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::points::Points;
use super::poses::choose_poses;

/// The default number of moves to evaluate, which takes about 1 s. The limit is a count and not a time, so that a seed
/// determines the route.
pub(super) const EFFORT: u64 = 100_000_000;
/// The smallest improvement of a path, in seconds. Smaller differences are rounding.
const MIN_GAIN: f64 = 1e-9;
/// The largest number of stops in a segment that is moved.
const MAX_SEGMENT: usize = 6;
/// The largest number of stops that a random exchange affects.
const MAX_WINDOW: usize = 50;

/// Returns the fastest path among those of a search that evaluates about `effort` moves.
pub(super) fn search(points: &Points, seed: u64, effort: u64) -> Vec<usize> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut remaining = effort;
    let first_pose = |stop| points.stop_points(stop).start;
    let mut best: Vec<usize> = (0..points.stop_count()).map(first_pose).collect();
    local_search(points, &mut best, &mut remaining);
    let mut shortest = points.path_seconds(&best);
    let count = best.len();
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
        local_search(points, &mut path, &mut remaining);
        let seconds = points.path_seconds(&path);
        if seconds <= shortest {
            (best, shortest) = (path, seconds);
        }
    }
    best
}

/// Moves segments and chooses poses until the path does not improve or `remaining` moves are evaluated.
fn local_search(points: &Points, path: &mut Vec<usize>, remaining: &mut u64) {
    loop {
        let before = points.path_seconds(path);
        for first in 0..path.len() {
            for length in 1..=MAX_SEGMENT.min(path.len() - first) {
                move_segment(points, path, first, length);
            }
            *remaining = remaining.saturating_sub((2 * MAX_SEGMENT * path.len()) as u64);
            if *remaining == 0 {
                break;
            }
        }
        *path = choose_poses(points, path.iter().map(|point| points.stop(*point)));
        if *remaining == 0 || points.path_seconds(path) > before - MIN_GAIN {
            return;
        }
    }
}

/// Moves the segment of `length` stops that begins at `first` to the fastest position, forward or reversed. A single
/// stop is tried in each of its poses.
fn move_segment(points: &Points, path: &mut Vec<usize>, first: usize, length: usize) {
    let segment = path[first..first + length].to_vec();
    let mut rest = path.clone();
    rest.drain(first..first + length);
    let variants: Vec<Vec<usize>> = match length {
        1 => {
            let poses = points.stop_points(points.stop(segment[0]));
            poses.map(|point| vec![point]).collect()
        }
        _ => vec![segment.clone(), segment.iter().rev().copied().collect()],
    };
    let point_at = |position: usize| rest.get(position).copied();
    let detour = |position: usize, segment: &[usize]| {
        let (before, after) = (
            position.checked_sub(1).and_then(point_at),
            point_at(position),
        );
        points.seconds_between(before, segment.first().copied())
            + points.seconds_between(segment.last().copied(), after)
            - points.seconds_between(before, after)
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
