//! The best of all orders, by dynamic programming over subsets (Bellman 1962, Held and Karp 1962).

use super::points::Points;

/// The most stops that are looked at so: their subsets are 2^16, and each of them is remembered with
/// each of its points as the last one, in some 17 megabytes.
pub(super) const MOST_STOPS: usize = 16;

/// The quickest path of all, whatever the order and the way of each stop.
pub(super) fn best(points: &Points) -> Vec<usize> {
    let (stops, count) = (points.stops(), points.len());
    let mut times = Vec::with_capacity(count * count);
    for from in 0..count {
        times.extend((0..count).map(|to| points.between(Some(from), Some(to))));
    }
    let bit = |point: usize| 1_usize << points.stop(point);
    let all = (1_usize << stops) - 1;
    // The least seconds in which the stops of a subset are visited, a given point as the last one.
    let mut least = vec![f64::INFINITY; (all + 1) * count];
    for point in 0..count {
        least[bit(point) * count + point] = points.between(None, Some(point));
    }
    for visited in 1..all {
        for last in 0..count {
            let until = least[visited * count + last];
            if until == f64::INFINITY {
                continue;
            }
            for next in 0..count {
                if visited & bit(next) == 0 {
                    let slot = &mut least[(visited | bit(next)) * count + next];
                    *slot = slot.min(until + times[last * count + next]);
                }
            }
        }
    }
    // Back from the end: the point before is the one by which that time came about.
    let mut path = Vec::with_capacity(stops);
    let (mut left, mut after) = (all, None);
    while left != 0 {
        let until = |point: usize| {
            let rest = after.map_or(0.0, |after| times[point * count + after]);
            least[left * count + point] + rest
        };
        let candidates = (0..count).filter(|point| left & bit(*point) != 0);
        let Some(point) = candidates.min_by(|one, other| until(*one).total_cmp(&until(*other)))
        else {
            break;
        };
        path.push(point);
        left &= !bit(point);
        after = Some(point);
    }
    path.reverse();
    path
}
