//! The best way of each stop, where the order is given.

use super::points::Points;

/// The quickest path through stops in this order: of each the point to go to. Exact, stop by stop: the
/// quickest path to each point goes by the quickest path to some point of the stop before.
pub(super) fn choose(points: &Points, order: impl Iterator<Item = usize>) -> Vec<usize> {
    // For each stop its points, the seconds until each, and the point before.
    let mut table: Vec<Vec<(usize, f64, Option<usize>)>> = Vec::new();
    for stop in order {
        let quickest = |to: usize| match table.last() {
            None => (to, points.between(None, Some(to)), None),
            Some(before) => {
                let mut best = (to, f64::INFINITY, None);
                for (from, until, _) in before {
                    let seconds = until + points.between(Some(*from), Some(to));
                    if seconds < best.1 {
                        best = (to, seconds, Some(*from));
                    }
                }
                best
            }
        };
        let row = points.of_stop(stop).map(quickest).collect();
        table.push(row);
    }
    let mut path = Vec::new();
    let mut chosen: Option<usize> = None;
    for row in table.iter().rev() {
        let found = match chosen {
            None => row.iter().min_by(|one, other| one.1.total_cmp(&other.1)),
            Some(point) => row.iter().find(|(own, _, _)| *own == point),
        };
        let Some((point, _, before)) = found else {
            break;
        };
        path.push(*point);
        chosen = *before;
    }
    path.reverse();
    path
}
