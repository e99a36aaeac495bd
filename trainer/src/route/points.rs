//! All places where the arms may stand, and the time between any two of them.

use super::machine::Machine;
use super::stop::Stop;

/// The ways of all stops as points, numbered through, those of one stop side by side.
///
/// The time between points is a metric, the same in both directions.
pub(super) struct Points {
    start: [f64; 4],
    /// [`Machine::seconds`] of each.
    seconds: Vec<[f64; 4]>,
    /// [`Machine::turn`].
    turn: [f64; 4],
    /// The stop of each point, by its place in the list of stops.
    stop: Vec<usize>,
    /// The first point of each stop, and at the end the number of points.
    first: Vec<usize>,
}

impl Points {
    pub(super) fn new(machine: &Machine, stops: &[Stop]) -> Self {
        let mut first = vec![0];
        let (mut seconds, mut stop) = (Vec::new(), Vec::new());
        for (number, each) in stops.iter().enumerate() {
            seconds.extend(each.ways.iter().map(|way| machine.seconds(&way.arms)));
            stop.resize(seconds.len(), number);
            first.push(seconds.len());
        }
        Self {
            start: machine.seconds(&machine.start),
            seconds,
            turn: machine.turn(),
            stop,
            first,
        }
    }

    /// How many points there are.
    pub(super) fn len(&self) -> usize {
        self.seconds.len()
    }

    /// How many stops there are.
    pub(super) fn stops(&self) -> usize {
        self.first.len() - 1
    }

    /// The stop that a point belongs to.
    pub(super) fn stop(&self, point: usize) -> usize {
        self.stop[point]
    }

    /// The points of a stop.
    pub(super) fn of_stop(&self, stop: usize) -> std::ops::Range<usize> {
        self.first[stop]..self.first[stop + 1]
    }

    /// Seconds from one point to another. From None is from where the arms start; to None, from the
    /// last stop, is no way at all.
    pub(super) fn between(&self, from: Option<usize>, to: Option<usize>) -> f64 {
        let Some(to) = to else {
            return 0.0;
        };
        let from = from.map_or(&self.start, |from| &self.seconds[from]);
        let to = &self.seconds[to];
        let mut longest = 0.0_f64;
        for axis in 0..4 {
            let by = (to[axis] - from[axis]).abs();
            longest = longest.max(by.min(self.turn[axis] - by));
        }
        longest
    }

    /// Seconds of a whole path from the start.
    pub(super) fn along(&self, path: &[usize]) -> f64 {
        let mut from = None;
        let mut total = 0.0;
        for point in path {
            total += self.between(from, Some(*point));
            from = Some(*point);
        }
        total
    }
}
