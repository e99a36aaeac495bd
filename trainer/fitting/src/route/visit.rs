//! A route: the visits of all samples, in order and with times.

use glimpse_core::geometry::Arms;
use glimpse_core::recipe::Recipe;
use serde::Serialize;

use super::machine::TimedMachine;
use super::search::{self, Effort, Points, moves};
use super::stop::stops;

/// The order in which samples are visited.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// Shortest time: the optimum for up to 16 samples, otherwise the best result of a search of about one second.
    Travel,
    /// The recipe's own order, in which a scan may end early if the recipe tolerates missing readings.
    Progressive,
}

/// One sample of a route.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Visit {
    /// The sample's index in the recipe's pattern, from 0.
    pub index: usize,
    /// The axis positions in degrees. Azimuths continue from the start position, and may leave the range -180 to 180 if
    /// the machine makes full turns. In one plane they are 0 and 180, and theta_o may be negative.
    pub arms: Arms<f64>,
    /// The time when the sample has been read and the arms may move on, in seconds after the start.
    pub seconds: f64,
}

/// All samples in the order of their visits.
#[derive(Clone, Debug, PartialEq)]
pub struct Route {
    /// The requested order.
    pub order: Order,
    /// The visits.
    pub visits: Vec<Visit>,
    /// The travel time, in seconds.
    pub travel: f64,
    /// The total time at the samples, in seconds; the same for any order.
    pub settling: f64,
    /// True for a machine in one plane, without azimuths.
    pub in_plane: bool,
}

impl Route {
    /// Plans the scan of a recipe quickly. None if a sample exceeds the limits of the machine.
    #[must_use]
    pub fn of_recipe(recipe: &Recipe<'_>, machine: &TimedMachine, order: Order) -> Option<Self> {
        let stops = stops(recipe, &machine.limits).ok()?;
        Some(Self::quick(machine, &stops, order))
    }

    /// Plans a route through all stops within milliseconds. The machine must be [valid](TimedMachine::validate).
    #[must_use]
    pub fn quick(machine: &TimedMachine, stops: &[Arms<f64>], order: Order) -> Self {
        Self::plan(machine, stops, order, &search::QUICK, 0)
    }

    /// Plans a route through all stops, with up to a second of search. `stops` is in the recipe's own order. The seed
    /// determines the route.
    ///
    /// The machine must be [valid](TimedMachine::validate).
    #[must_use]
    pub fn new(machine: &TimedMachine, stops: &[Arms<f64>], order: Order, seed: u64) -> Self {
        Self::plan(machine, stops, order, &search::THOROUGH, seed)
    }

    fn plan(
        machine: &TimedMachine,
        stops: &[Arms<f64>],
        order: Order,
        effort: &Effort,
        seed: u64,
    ) -> Self {
        let points = Points::new(machine, stops);
        let path = match order {
            Order::Progressive => (0..stops.len()).collect(),
            Order::Travel => points.fastest_path(effort, seed),
        };
        let (mut position, mut seconds) = (TimedMachine::START, 0.0);
        let visits = moves(&path).map(|(from, to)| {
            let previous_arms = from.map_or(&TimedMachine::START, |from| &stops[*from]);
            position = machine.arrival(&position, previous_arms, &stops[*to]);
            seconds += points.seconds_between(from, Some(to)) + machine.settle;
            Visit {
                index: *to,
                arms: position,
                seconds,
            }
        });
        let visits = visits.collect();
        Self {
            order,
            visits,
            travel: points.path_seconds(&path),
            settling: machine.settle * stops.len() as f64,
            in_plane: machine.limits.in_plane,
        }
    }

    /// Returns the time from the start until the last sample is read, in seconds.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.travel + self.settling
    }
}
