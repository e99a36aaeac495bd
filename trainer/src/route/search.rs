//! A good order where there are too many for the best.
//!
//! Iterated local search: pieces of the path are moved as long as that makes it quicker. Then
//! neighboring pieces are exchanged at random, and the next result is kept unless it is slower.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::points::Points;
use super::ways::choose;

/// Default number of changes to examine, about a second. Changes are counted and not timed, so that the
/// same seed gives the same route.
pub(super) const EFFORT: u64 = 100_000_000;
/// Differences below this are rounding, seconds.
const GAIN: f64 = 1e-9;
/// The most stops that are moved together.
const PIECE: usize = 6;
/// The most stops that are exchanged at random.
const WINDOW: usize = 50;

/// The quickest path found within `effort`.
pub(super) fn search(points: &Points, seed: u64, effort: u64) -> Vec<usize> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut left = effort;
    let first_way = |stop| points.of_stop(stop).start;
    let mut best: Vec<usize> = (0..points.stops()).map(first_way).collect();
    descend(points, &mut best, &mut left);
    let mut least = points.along(&best);
    let count = best.len();
    while left > 0 && count > 2 {
        let mut path = best.clone();
        let window = WINDOW.min(count);
        let begin = random.random_range(0..=count - window);
        // Twice, since one move undoes a single exchange of short pieces.
        for _ in 0..2 {
            let mut cuts = [0; 3].map(|_| begin + random.random_range(0..=window));
            cuts.sort_unstable();
            path[cuts[0]..cuts[2]].rotate_left(cuts[1] - cuts[0]);
        }
        descend(points, &mut path, &mut left);
        let seconds = points.along(&path);
        if seconds <= least {
            (best, least) = (path, seconds);
        }
    }
    best
}

/// Moves pieces and chooses the ways until nothing helps, or nothing is `left` of the effort.
fn descend(points: &Points, path: &mut Vec<usize>, left: &mut u64) {
    loop {
        let before = points.along(path);
        for first in 0..path.len() {
            for length in 1..=PIECE.min(path.len() - first) {
                move_piece(points, path, first, length);
            }
            *left = left.saturating_sub((2 * PIECE * path.len()) as u64);
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

/// Moves the piece of `length` stops that begins at `first` to the quickest place, forward or reversed.
/// A single stop is tried in each of its ways.
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
