//! Safe ways of the arms: lamp and sensor stay apart at home, on the way, and where they read.
//!
//! A [`Route`] is a list of waypoints. Between two of them the axes move at the same time, at speeds
//! that nobody relies on, so a route is safe if every combination of angles between two waypoints
//! is. [`Space::route`] tries these in turn:
//!
//! 1. all axes at once;
//! 2. some axes first, then the others;
//! 3. over the home configuration: azimuths to opposite sides, one arm to the horizon, the other one
//!    to the normal, azimuths, and the same backwards. If the azimuths turn freely, this leads from
//!    every safe configuration to every other one.
//!
//! At home one arm is near the normal and the other one near the horizon, so that no azimuth brings
//! them together.

mod separation;

pub use separation::separation_between;

use core::f32::consts::PI;
use core::fmt;

use glimpse_core::gonio::Limits;

/// The angles of the axes, radians: theta_i, phi_i, theta_o, phi_o.
pub type AxisAngles = [f32; 4];

/// The most legs of a route.
const LEGS: usize = 7;
/// Groups of axes that move first. The empty group is the first one: all axes move at once.
const GROUPS: usize = 15;
/// Differences of the azimuths on a way over home; None leaves them as they are.
const SIDES: [Option<f32>; 3] = [None, Some(PI), Some(-PI)];

/// The reason why the arms do not move.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum RouteError {
    /// At home, with some azimuths, lamp and sensor are nearer to each other than `min_separation`.
    HomeTooClose {
        /// Their least separation, radians.
        separation: f32,
    },
    /// A home switch lies beyond `max_theta_i` or `max_theta_o`.
    HomeBeyondLimits,
    /// No known way keeps lamp and sensor apart.
    NoSafeRoute,
}

impl fmt::Display for RouteError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::HomeTooClose { separation } => write!(
                f,
                "at home lamp and sensor are {separation} rad apart, less than `min_separation`: put one home switch near the normal, the other one near the horizon"
            ),
            Self::HomeBeyondLimits => f.write_str(
                "a home switch lies beyond `max_theta_i` or `max_theta_o`: move the switch, or raise the limit",
            ),
            Self::NoSafeRoute => f.write_str(
                "no known way there keeps lamp and sensor apart: check the limits of the azimuths",
            ),
        }
    }
}

impl core::error::Error for RouteError {}

/// The configurations that the arms may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Space {
    /// The smallest angle of each axis at a sample.
    pub least: AxisAngles,
    /// The largest angle of each axis at a sample.
    pub largest: AxisAngles,
    /// The angles at which the home switches open.
    pub home: AxisAngles,
    /// The angles near the switches, where the slow approach begins.
    pub near_home: AxisAngles,
    /// The limits; `in_plane` applies to samples only.
    pub limits: Limits,
    /// Radians by which a separation may be smaller: the rounding to steps.
    pub tolerance: f32,
}

/// Waypoints that are still to come.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Route {
    waypoints: [Option<AxisAngles>; LEGS],
    next: usize,
}

impl Iterator for Route {
    type Item = AxisAngles;

    fn next(&mut self) -> Option<AxisAngles> {
        let waypoint = self.waypoints.get(self.next).copied().flatten();
        self.next = self.next.saturating_add(1);
        waypoint
    }
}

impl Space {
    /// Checks that home is within the limits, and safe with all azimuths.
    ///
    /// # Errors
    /// [`RouteError::HomeTooClose`] or [`RouteError::HomeBeyondLimits`].
    pub fn check_home(&self) -> Result<(), RouteError> {
        let [home_i, _, home_o, _] = self.home;
        let [near_i, _, near_o, _] = self.near_home;
        let separation = separation_between([home_i, 0.0, home_o, -PI], [near_i, 0.0, near_o, PI]);
        if !self.is_far_enough(separation) {
            return Err(RouteError::HomeTooClose { separation });
        }
        let is_within = |angle: f32, limit: f32| angle.abs() <= limit + Limits::TOLERANCE;
        if !(is_within(home_i, self.limits.max_theta_i)
            && is_within(home_o, self.limits.max_theta_o))
        {
            return Err(RouteError::HomeBeyondLimits);
        }
        Ok(())
    }

    /// The order in which arms at unknown positions go home: first the arm whose home is nearer to
    /// the horizon. Afterwards no motion of the other one brings them nearer than they are or than
    /// at home; azimuths come last.
    #[must_use]
    pub fn homing_order(&self) -> [usize; 4] {
        if self.is_sensor_outer() {
            [2, 0, 1, 3]
        } else {
            [0, 2, 1, 3]
        }
    }

    /// Plans a safe way.
    ///
    /// # Errors
    /// [`RouteError::NoSafeRoute`].
    #[inline(never)] // smaller: there are several calls of it
    pub fn route(&self, from: AxisAngles, to: AxisAngles) -> Result<Route, RouteError> {
        for candidate in 0..GROUPS + SIDES.len() * SIDES.len() {
            if let Some(waypoints) = self.candidate(from, to, candidate)
                && self.is_safe(from, &waypoints)
            {
                return Ok(Route {
                    waypoints: without_repeats(from, waypoints),
                    next: 0,
                });
            }
        }
        Err(RouteError::NoSafeRoute)
    }

    /// The waypoints of a way by its number, in the order in which they are tried.
    fn candidate(
        &self,
        from: AxisAngles,
        to: AxisAngles,
        number: usize,
    ) -> Option<[AxisAngles; LEGS]> {
        let Some(number) = number.checked_sub(GROUPS) else {
            // Each bit is an axis that moves first; without any, all move at once.
            let first = merge(from, to, |axis| number >> axis & 1 == 1);
            return Some([first, to, to, to, to, to, to]);
        };
        let before = *SIDES.get(number / SIDES.len())?;
        let after = *SIDES.get(number % SIDES.len())?;
        self.over_home(from, to, before, after)
    }

    /// The waypoints over home, with azimuths that differ by `before` and `after` while one of the
    /// arms moves; None of these leaves them as they are.
    fn over_home(
        &self,
        from: AxisAngles,
        to: AxisAngles,
        before: Option<f32>,
        after: Option<f32>,
    ) -> Option<[AxisAngles; LEGS]> {
        let [home_i, phi_i, home_o, phi_o] = self.home;
        let [least, largest] = [self.least, self.largest];
        let [least_i, _, least_o, _] = least;
        let [largest_i, _, largest_o, _] = largest;
        let home = [
            home_i.max(least_i).min(largest_i),
            phi_i,
            home_o.max(least_o).min(largest_o),
            phi_o,
        ];
        let (outer, inner) = if self.is_sensor_outer() {
            (2, 0)
        } else {
            (0, 2)
        };
        let spread = self.spread(from, before)?;
        let at_horizon = merge(spread, home, |axis| axis == outer);
        let at_home = merge(at_horizon, home, |axis| axis == inner);
        let turned = merge(at_home, self.spread(to, after)?, |axis| axis % 2 == 1);
        let back = merge(turned, to, |axis| axis == inner);
        let all_back = merge(back, to, |axis| axis == outer);
        Some([spread, at_horizon, at_home, turned, back, all_back, to])
    }

    /// The same polar angles with azimuths that differ by `apart`, if both axes reach them.
    fn spread(&self, angles: AxisAngles, apart: Option<f32>) -> Option<AxisAngles> {
        let Some(apart) = apart else {
            return Some(angles);
        };
        let [theta_i, _, theta_o, phi_o] = angles;
        let [_, least_i, _, least_o] = self.least;
        let [_, largest_i, _, largest_o] = self.largest;
        let phi_o = phi_o
            .max(least_o.max(least_i + apart))
            .min(largest_o.min(largest_i + apart));
        let phi_i = phi_o - apart;
        let is_within = |angle, least, largest| least <= angle && angle <= largest;
        let is_reached =
            is_within(phi_i, least_i, largest_i) && is_within(phi_o, least_o, largest_o);
        is_reached.then_some([theta_i, phi_i, theta_o, phi_o])
    }

    /// Returns true if lamp and sensor stay apart along these waypoints.
    fn is_safe(&self, from: AxisAngles, waypoints: &[AxisAngles]) -> bool {
        let starts = core::iter::once(&from).chain(waypoints);
        let mut legs = starts.zip(waypoints);
        legs.all(|(from, to)| self.is_far_enough(separation_between(*from, *to)))
    }

    /// Returns false for NaN.
    fn is_far_enough(&self, separation: f32) -> bool {
        separation >= self.limits.min_separation - self.tolerance
    }

    fn is_sensor_outer(&self) -> bool {
        let [home_i, _, home_o, _] = self.home;
        home_o.abs() >= home_i.abs()
    }
}

/// The angles of `to` for the axes of a group, and of `from` for the others.
fn merge(from: AxisAngles, to: AxisAngles, is_moved: impl Fn(usize) -> bool) -> AxisAngles {
    let mut merged = from;
    for (axis, (merged, to)) in merged.iter_mut().zip(to).enumerate() {
        if is_moved(axis) {
            *merged = to;
        }
    }
    merged
}

/// The waypoints without those that equal the one before.
fn without_repeats(from: AxisAngles, waypoints: [AxisAngles; LEGS]) -> [Option<AxisAngles>; LEGS] {
    let mut last = from;
    let mut moves = waypoints.into_iter().filter(|waypoint| {
        let is_move = *waypoint != last;
        last = *waypoint;
        is_move
    });
    [(); LEGS].map(|()| moves.next())
}
