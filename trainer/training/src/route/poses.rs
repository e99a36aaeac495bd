//! The fastest choice of poses for a fixed order of stops.

use super::points::Points;

/// Returns the fastest path through stops in this order, one point per stop. The result is exact: the fastest path to
/// a point extends the fastest path to some point of the previous stop.
pub(super) fn choose_poses(points: &Points, order: impl Iterator<Item = usize>) -> Vec<usize> {
    // For each stop, its points: the point, the shortest arrival time in seconds, and the previous point on that path.
    let mut table: Vec<Vec<(usize, f64, Option<usize>)>> = Vec::new();
    for stop in order {
        let fastest = |to: usize| match table.last() {
            None => (to, points.seconds_between(None, Some(to)), None),
            Some(previous_row) => {
                let mut best = (to, f64::INFINITY, None);
                for (from, arrival, _) in previous_row {
                    let seconds = arrival + points.seconds_between(Some(*from), Some(to));
                    if seconds < best.1 {
                        best = (to, seconds, Some(*from));
                    }
                }
                best
            }
        };
        let row = points.stop_points(stop).map(fastest).collect();
        table.push(row);
    }
    let mut path = Vec::new();
    let mut chosen: Option<usize> = None;
    for row in table.iter().rev() {
        let entry = match chosen {
            None => row.iter().min_by(|one, other| one.1.total_cmp(&other.1)),
            Some(chosen) => row.iter().find(|(point, _, _)| *point == chosen),
        };
        let Some((point, _, previous)) = entry else {
            break;
        };
        path.push(*point);
        chosen = *previous;
    }
    path.reverse();
    path
}
