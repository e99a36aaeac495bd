//! The fastest path over all orders, by dynamic programming over subsets (Bellman 1962, Held and Karp 1962).

use super::points::Points;

/// The largest number of stops. The table of 2^16 subsets times 32 last points (two poses per stop) takes about 17 MB.
pub(super) const MAX_STOPS: usize = 16;

/// Returns the fastest path over all orders of the stops and all poses of each stop.
pub(super) fn fastest_path(points: &Points) -> Vec<usize> {
    let (stops, count) = (points.stop_count(), points.len());
    let mut times = Vec::with_capacity(count * count);
    for from in 0..count {
        times.extend((0..count).map(|to| points.seconds_between(Some(from), Some(to))));
    }
    let bit = |point: usize| 1_usize << points.stop(point);
    let all = (1_usize << stops) - 1;
    // The shortest time, in seconds, to visit a subset of the stops and end at a point.
    let mut shortest = vec![f64::INFINITY; (all + 1) * count];
    for point in 0..count {
        shortest[bit(point) * count + point] = points.seconds_between(None, Some(point));
    }
    for visited in 1..all {
        for last in 0..count {
            let arrival = shortest[visited * count + last];
            if arrival == f64::INFINITY {
                continue;
            }
            for next in 0..count {
                if visited & bit(next) == 0 {
                    let time = &mut shortest[(visited | bit(next)) * count + next];
                    *time = time.min(arrival + times[last * count + next]);
                }
            }
        }
    }
    // Backwards from the end: the point before `next` is the one with the shortest time.
    let mut path = Vec::with_capacity(stops);
    let (mut remaining, mut next) = (all, None);
    while remaining != 0 {
        let time_through = |point: usize| {
            let move_time = next.map_or(0.0, |next| times[point * count + next]);
            shortest[remaining * count + point] + move_time
        };
        let candidates = (0..count).filter(|point| remaining & bit(*point) != 0);
        let Some(point) =
            candidates.min_by(|one, other| time_through(*one).total_cmp(&time_through(*other)))
        else {
            break;
        };
        path.push(point);
        remaining &= !bit(point);
        next = Some(point);
    }
    path.reverse();
    path
}
