//! All poses of all stops, and the travel time between any two of them.

use super::machine::Machine;
use super::stop::Stop;

/// The poses of all stops as consecutively numbered points. The numbers of a stop's points are consecutive too.
///
/// The travel time between points is a symmetric metric.
pub(super) struct Points {
    /// [`Machine::axis_seconds`] of the start position.
    start: [f64; 4],
    /// [`Machine::axis_seconds`] of each point.
    seconds: Vec<[f64; 4]>,
    /// [`Machine::turn_seconds`].
    turn: [f64; 4],
    /// The index of each point's stop.
    stop: Vec<usize>,
    /// The first point of each stop, followed by the number of points.
    first: Vec<usize>,
}

impl Points {
    pub(super) fn new(machine: &Machine, stops: &[Stop]) -> Self {
        let mut first = vec![0];
        let (mut seconds, mut stop) = (Vec::new(), Vec::new());
        for (index, Stop { poses, .. }) in stops.iter().enumerate() {
            seconds.extend(poses.iter().map(|pose| machine.axis_seconds(&pose.arms)));
            stop.resize(seconds.len(), index);
            first.push(seconds.len());
        }
        Self {
            start: machine.axis_seconds(&machine.start),
            seconds,
            turn: machine.turn_seconds(),
            stop,
            first,
        }
    }

    /// Returns the number of points.
    pub(super) fn len(&self) -> usize {
        self.seconds.len()
    }

    /// Returns the number of stops.
    pub(super) fn stop_count(&self) -> usize {
        self.first.len() - 1
    }

    /// Returns the stop of a point.
    pub(super) fn stop(&self, point: usize) -> usize {
        self.stop[point]
    }

    /// Returns the points of a stop.
    pub(super) fn stop_points(&self, stop: usize) -> std::ops::Range<usize> {
        self.first[stop]..self.first[stop + 1]
    }

    /// Returns the travel time from one point to another, in seconds. As `from`, None means the start position. As
    /// `to`, None means the end of the path, which takes 0 s.
    pub(super) fn seconds_between(&self, from: Option<usize>, to: Option<usize>) -> f64 {
        let Some(to) = to else {
            return 0.0;
        };
        let from = from.map_or(&self.start, |from| &self.seconds[from]);
        let to = &self.seconds[to];
        let mut longest = 0.0_f64;
        for axis in 0..4 {
            let difference = (to[axis] - from[axis]).abs();
            longest = longest.max(difference.min(self.turn[axis] - difference));
        }
        longest
    }

    /// Returns the travel time of a path from the start position, in seconds.
    pub(super) fn path_seconds(&self, path: &[usize]) -> f64 {
        let mut from = None;
        let mut total = 0.0;
        for point in path {
            total += self.seconds_between(from, Some(*point));
            from = Some(*point);
        }
        total
    }
}
