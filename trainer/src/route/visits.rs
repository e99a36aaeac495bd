//! The route: which stop when, and where the axes stand.

use super::axes::Axes;
use super::machine::Machine;
use super::points::Points;
use super::stop::Stop;
use super::{exact, search, ways};

/// In which order samples are visited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// That which takes the least time.
    Travel,
    /// The recipe's own. Where its samples come most telling first, whatever was read when a scan ends
    /// early is of use.
    Progressive,
}

impl Order {
    /// What it is called.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Travel => "travel",
            Self::Progressive => "progressive",
        }
    }
}

/// One sample on the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Visit {
    /// Its number in the recipe's pattern, from 0.
    pub index: usize,
    /// Where the axes stand, degrees. Azimuths count on from where the arms started, also past 180 and
    /// -180 if the machine makes full turns.
    pub arms: Axes,
    /// True if light and sensor are exchanged.
    pub swapped: bool,
    /// When the sample is read and the arms may go on, in seconds after the start.
    pub seconds: f64,
}

/// All samples, in the order in which they are visited.
#[derive(Clone, Debug, PartialEq)]
pub struct Route {
    /// What was asked for.
    pub order: Order,
    /// True if no other order, way of a sample, or choice of azimuths takes less time; for
    /// [`Order::Progressive`], no other way or choice in that order. False if it is the best that was
    /// found.
    pub is_best: bool,
    /// The samples.
    pub visits: Vec<Visit>,
    /// Seconds in which arms move.
    pub travel: f64,
    /// Seconds in which arms move in the recipe's own order, each sample in its first way, if none of
    /// the machine's freedom is used: [`Machine::naive`].
    pub naive_travel: f64,
    /// Seconds at the samples, the same in any order.
    pub settling: f64,
}

impl Route {
    /// Plans the way through all stops, which are in the recipe's own order. The same seed gives the
    /// same route; up to 16 stops there is nothing random in it.
    ///
    /// The machine must be [valid](Machine::validate).
    #[must_use]
    pub fn new(machine: &Machine, stops: &[Stop], order: Order, seed: u64) -> Self {
        let points = Points::new(machine, stops);
        let is_best = order == Order::Progressive || stops.len() <= exact::MOST_STOPS;
        let path = match order {
            Order::Progressive => ways::choose(&points, 0..stops.len()),
            Order::Travel if is_best => exact::best(&points),
            Order::Travel => search::search(&points, seed, search::EFFORT),
        };
        let naive = Points::new(&machine.naive(), stops);
        let first: Vec<usize> = (0..stops.len())
            .map(|stop| naive.of_stop(stop).start)
            .collect();
        Self {
            order,
            is_best,
            visits: visits(machine, stops, &points, &path),
            travel: points.along(&path),
            naive_travel: naive.along(&first),
            settling: machine.settle * stops.len() as f64,
        }
    }

    /// Seconds from the start until the last sample is read.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.travel + self.settling
    }

    /// The same for the naive order.
    #[must_use]
    pub fn naive_total(&self) -> f64 {
        self.naive_travel + self.settling
    }
}

/// Where the axes stand along a path, and when.
fn visits(machine: &Machine, stops: &[Stop], points: &Points, path: &[usize]) -> Vec<Visit> {
    let (mut at, mut place) = (machine.start, machine.start);
    let (mut before, mut seconds) = (None, 0.0);
    let mut visits = Vec::with_capacity(path.len());
    for &point in path {
        let number = points.stop(point);
        let stop = &stops[number];
        let way = stop.ways[point - points.of_stop(number).start];
        at = machine.arrival(&at, &place, &way.arms);
        place = way.arms;
        seconds += points.between(before, Some(point)) + machine.settle;
        before = Some(point);
        visits.push(Visit {
            index: stop.index,
            arms: at,
            swapped: way.swapped,
            seconds,
        });
    }
    visits
}
