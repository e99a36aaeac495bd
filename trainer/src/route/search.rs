//! A good order where there are too many for the best.
//!
//! From the nearest neighbour each time on: pieces of the path are reversed (2-opt) and moved (or-opt)
//! as long as that helps, and the ways chosen anew for the order; then two neighbouring pieces are
//! exchanged at random, and what that leads to is kept if it is no longer (iterated local search).

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::points::Points;
use super::ways::choose;

/// How many changes of the path are looked at, unless told: about a second. Counted and not timed, so
/// that the same seed gives the same route.
pub(super) const EFFORT: u64 = 100_000_000;
/// What is less than that, seconds, is rounding and no gain.
const GAIN: f64 = 1e-9;
/// The most stops that are moved together.
const PIECE: usize = 3;
/// The most stops that are mixed up at random.
const WINDOW: usize = 50;

/// A path that cannot be made quicker by changing a piece of it, the best of those that were found
/// within `effort`.
pub(super) fn search(points: &Points, seed: u64, effort: u64) -> Vec<usize> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut left = effort;
    let mut best = nearest(points);
    descend(points, &mut best, &mut left);
    let mut least = points.along(&best);
    let count = best.len();
    while left > 0 && count > 2 {
        let mut path = best.clone();
        let window = WINDOW.min(count);
        let begin = random.random_range(0..=count - window);
        let mut cuts = [0; 3].map(|_| begin + random.random_range(0..=window));
        cuts.sort_unstable();
        path[cuts[0]..cuts[2]].rotate_left(cuts[1] - cuts[0]);
        descend(points, &mut path, &mut left);
        let seconds = points.along(&path);
        if seconds <= least {
            (best, least) = (path, seconds);
        }
    }
    best
}

/// To the nearest point of all stops that are left, each time.
fn nearest(points: &Points) -> Vec<usize> {
    let mut left: Vec<usize> = (0..points.stops()).collect();
    let mut path = Vec::new();
    while !left.is_empty() {
        let from = path.last().copied();
        let mut best = (f64::INFINITY, 0, 0);
        for (place, stop) in left.iter().enumerate() {
            for point in points.of_stop(*stop) {
                let seconds = points.between(from, Some(point));
                if seconds < best.0 {
                    best = (seconds, place, point);
                }
            }
        }
        let (_, place, point) = best;
        left.swap_remove(place);
        path.push(point);
    }
    path
}

/// Changes the path for the better until nothing helps, or nothing is `left` of the effort.
fn descend(points: &Points, path: &mut Vec<usize>, left: &mut u64) {
    loop {
        let before = points.along(path);
        for first in 0..path.len() {
            reverse_from(points, path, first);
            for length in 1..=PIECE.min(path.len() - first) {
                move_piece(points, path, first, length);
            }
            *left = left.saturating_sub(((2 * PIECE + 1) * path.len()) as u64);
            if *left == 0 {
                break;
            }
        }
        *path = choose(points, path.iter().map(|point| points.stop(*point)));
        if *left == 0 || points.along(path) > before - GAIN {
            return;
        }
    }
}

/// Reverses pieces that begin at `first`, wherever that helps.
fn reverse_from(points: &Points, path: &mut [usize], first: usize) {
    let at = |path: &[usize], place: usize| path.get(place).copied();
    let before = first.checked_sub(1).and_then(|place| at(path, place));
    for last in first + 1..path.len() {
        let after = at(path, last + 1);
        let (from, to) = (at(path, first), at(path, last));
        let old = points.between(before, from) + points.between(to, after);
        let new = points.between(before, to) + points.between(from, after);
        if new < old - GAIN {
            path[first..=last].reverse();
        }
    }
}

/// Moves the piece of `length` stops that begins at `first` to where it helps most, either way around;
/// one that is a single stop is also looked at in each of its ways.
fn move_piece(points: &Points, path: &mut Vec<usize>, first: usize, length: usize) {
    let piece = path[first..first + length].to_vec();
    let mut rest = path.clone();
    rest.drain(first..first + length);
    let variants: Vec<Vec<usize>> = match length {
        1 => {
            let ways = points.of_stop(points.stop(piece[0]));
            ways.map(|point| vec![point]).collect()
        }
        _ => vec![piece.clone(), piece.iter().rev().copied().collect()],
    };
    let at = |place: usize| rest.get(place).copied();
    let detour = |place: usize, piece: &[usize]| {
        let (before, after) = (place.checked_sub(1).and_then(at), at(place));
        points.between(before, piece.first().copied())
            + points.between(piece.last().copied(), after)
            - points.between(before, after)
    };
    let mut best = (detour(first, &piece) - GAIN, None);
    for variant in &variants {
        for place in 0..=rest.len() {
            let seconds = detour(place, variant);
            if seconds < best.0 {
                best = (seconds, Some((place, variant)));
            }
        }
    }
    if let (_, Some((place, variant))) = best {
        rest.splice(place..place, variant.iter().copied());
        *path = rest;
    }
}
