//! A route: the visits of all samples, in order and with times.

use glimpse_core::recipe::Recipe;

use super::axes::Axes;
use super::machine::Machine;
use super::order::fast_order;
use super::points::Points;
use super::stop::{Stop, stops};
use super::{exact, poses, search};

/// The order in which samples are visited.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Order {
    /// Shortest time: the optimum for up to 16 samples, otherwise the best result of a search of about one second.
    Travel,
    /// The recipe's own order, in which a scan may end early if the recipe tolerates missing readings.
    Progressive,
}

impl Order {
    /// Returns the order in which a recipe is best scanned: its own if that is a fast path, otherwise [`Order::Travel`].
    #[must_use]
    pub fn of_recipe(recipe: &Recipe<'_>) -> Self {
        match recipe.is_in_path_order() {
            true => Self::Progressive,
            false => Self::Travel,
        }
    }

    /// Returns the name on the command line and in JSON.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Travel => "travel",
            Self::Progressive => "progressive",
        }
    }
}

/// One sample of a route.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Visit {
    /// The sample's index in the recipe's pattern, from 0.
    pub index: usize,
    /// The axis positions in degrees. Azimuths continue from the start position, and may leave the range -180 to 180 if
    /// the machine makes full turns.
    pub arms: Axes,
    /// True if light and sensor are exchanged.
    pub swapped: bool,
    /// The time when the sample has been read and the arms may move on, in seconds after the start.
    pub seconds: f64,
}

/// All samples in the order of their visits.
#[derive(Clone, Debug, PartialEq)]
pub struct Route {
    /// The requested order.
    pub order: Order,
    /// True if no other order, poses or azimuths take less time. For [`Order::Progressive`], the order is fixed, and
    /// only other poses and azimuths are considered. False if the route is the result of a heuristic search.
    pub is_best: bool,
    /// The visits.
    pub visits: Vec<Visit>,
    /// The travel time, in seconds.
    pub travel: f64,
    /// The travel time of the naive route, in seconds: [`Machine::naive`] in the recipe's own order, with the first
    /// pose of each sample.
    pub naive_travel: f64,
    /// The total time at the samples, in seconds; the same for any order.
    pub settling: f64,
}

impl Route {
    /// Plans the scan of a recipe quickly. None if the machine is invalid, or a sample exceeds its limits.
    #[must_use]
    pub fn of_recipe(recipe: &Recipe<'_>, machine: &Machine, order: Order) -> Option<Self> {
        machine.validate().ok()?;
        let mut stops = stops(recipe, &machine.limits, false).ok()?;
        if order == Order::Travel {
            let arms: Vec<Axes> = stops.iter().map(|stop| stop.poses[0].arms).collect();
            let order = fast_order(machine, &arms, arms.len() <= exact::MAX_STOPS);
            stops = order
                .into_iter()
                .map(|index| stops[index].clone())
                .collect();
        }
        Some(Self::new(machine, &stops, Order::Progressive, 0))
    }

    /// Plans a route through all stops. `stops` is in the recipe's own order. The seed determines the route of a
    /// heuristic search, which is used for more than 16 stops.
    ///
    /// The machine must be [valid](Machine::validate).
    #[must_use]
    pub fn new(machine: &Machine, stops: &[Stop], order: Order, seed: u64) -> Self {
        let points = Points::new(machine, stops);
        let is_best = order == Order::Progressive || stops.len() <= exact::MAX_STOPS;
        let path = match order {
            Order::Progressive => poses::choose_poses(&points, 0..stops.len()),
            Order::Travel if is_best => exact::fastest_path(&points),
            Order::Travel => search::search(&points, seed, search::EFFORT),
        };
        let naive = Points::new(&machine.naive(), stops);
        let first_poses: Vec<usize> = (0..stops.len())
            .map(|stop| naive.stop_points(stop).start)
            .collect();
        Self {
            order,
            is_best,
            visits: visits(machine, stops, &points, &path),
            travel: points.path_seconds(&path),
            naive_travel: naive.path_seconds(&first_poses),
            settling: machine.settle * stops.len() as f64,
        }
    }

    /// Returns the time from the start until the last sample is read, in seconds.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.travel + self.settling
    }

    /// Returns the total time of the naive route, in seconds.
    #[must_use]
    pub fn naive_total(&self) -> f64 {
        self.naive_travel + self.settling
    }
}

/// Converts a path to visits, with axis positions and times.
fn visits(machine: &Machine, stops: &[Stop], points: &Points, path: &[usize]) -> Vec<Visit> {
    let (mut position, mut previous_pose) = (machine.start, machine.start);
    let (mut previous_point, mut seconds) = (None, 0.0);
    let mut visits = Vec::with_capacity(path.len());
    for &point in path {
        let stop_index = points.stop(point);
        let stop = &stops[stop_index];
        let pose = stop.poses[point - points.stop_points(stop_index).start];
        position = machine.arrival(&position, &previous_pose, &pose.arms);
        previous_pose = pose.arms;
        seconds += points.seconds_between(previous_point, Some(point)) + machine.settle;
        previous_point = Some(point);
        visits.push(Visit {
            index: stop.index,
            arms: position,
            swapped: pose.swapped,
            seconds,
        });
    }
    visits
}
