//! Safe routes of the arms: lamp and sensor never collide, at home, on the way, or at a sample.
//!
//! A [`Route`] is a list of waypoints. Between two waypoints the axes move at the same time, at unknown relative
//! speeds. A route is therefore safe if every combination of angles between two waypoints is safe. [`Space::route`]
//! tries in turn:
//!
//! 1. all axes at once;
//! 2. some axes first, then the others;
//! 3. via home: turn the azimuths apart, move one arm to the horizon and then the other one to the normal, turn the
//!    azimuths, and move the arms in reverse order. If the azimuths turn freely, this connects all safe configurations.
//!
//! At home one arm is near the normal and the other one near the horizon, so they are apart at any azimuths.

mod separation;

pub use separation::separation_between;

use core::f32::consts::PI;
use core::fmt;

use glimpse_core::gonio::Limits;

/// Angles of the axes, radians: theta_i, phi_i, theta_o, phi_o.
pub type AxisAngles = [f32; 4];

/// Maximum number of legs of a route.
const MAX_LEGS: usize = 7;
/// Number of groups of axes that move first. The first group is empty: all axes move at once.
const AXIS_GROUPS: usize = 15;
/// Azimuth differences that are tried on a route via home, radians. None keeps the azimuths.
const AZIMUTH_DIFFERENCES: [Option<f32>; 3] = [None, Some(PI), Some(-PI)];

/// An error of route planning.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum RouteError {
    /// At home, lamp and sensor are closer than `min_separation` at some azimuths.
    HomeTooClose {
        /// Their minimum separation, radians.
        separation: f32,
    },
    /// A home switch lies beyond `max_theta_i` or `max_theta_o`.
    HomeBeyondLimits,
    /// No route keeps lamp and sensor apart.
    NoSafeRoute,
}

impl fmt::Display for RouteError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::HomeTooClose { separation } => write!(
                f,
                "at home lamp and sensor are {separation} rad apart, less than `min_separation`: place one home switch near the normal and the other one near the horizon"
            ),
            Self::HomeBeyondLimits => f.write_str(
                "a home switch lies beyond `max_theta_i` or `max_theta_o`: move the switch, or raise the limit",
            ),
            Self::NoSafeRoute => f.write_str(
                "no route keeps lamp and sensor apart: check the limits of the azimuths",
            ),
        }
    }
}

impl core::error::Error for RouteError {}

/// The configuration space of the arms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Space {
    /// Smallest angle of each axis at a sample, radians.
    pub min_angles: AxisAngles,
    /// Largest angle of each axis at a sample, radians.
    pub max_angles: AxisAngles,
    /// Angles at which the home switches open, radians.
    pub home: AxisAngles,
    /// Angles near the switches at which the slow approach begins, radians.
    pub near_home: AxisAngles,
    /// Limits of the machine; `in_plane` applies to samples only.
    pub limits: Limits,
    /// Tolerance of separations, radians. It allows for the rounding of angles to steps.
    pub tolerance: f32,
}

/// A route: an iterator over its waypoints.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Route {
    waypoints: [Option<AxisAngles>; MAX_LEGS],
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
    /// Checks that home is within the limits, and safe at all azimuths.
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

    /// Returns the homing order of arms at unknown positions: first the arm whose home is nearer to the horizon, then
    /// the other one, then the azimuths. While the second arm moves, the separation never falls below the smaller of
    /// two values: the separation before the move, and that at home.
    #[must_use]
    pub fn homing_order(&self) -> [usize; 4] {
        if self.is_sensor_outer() {
            [2, 0, 1, 3]
        } else {
            [0, 2, 1, 3]
        }
    }

    /// Plans a safe route.
    ///
    /// # Errors
    /// [`RouteError::NoSafeRoute`].
    #[inline(never)] // saves flash: one copy for several calls
    pub fn route(&self, from: AxisAngles, to: AxisAngles) -> Result<Route, RouteError> {
        for candidate in 0..AXIS_GROUPS + AZIMUTH_DIFFERENCES.len() * AZIMUTH_DIFFERENCES.len() {
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

    /// Returns the waypoints of a candidate route by its number, in the order of the attempts.
    fn candidate(
        &self,
        from: AxisAngles,
        to: AxisAngles,
        number: usize,
    ) -> Option<[AxisAngles; MAX_LEGS]> {
        let Some(number) = number.checked_sub(AXIS_GROUPS) else {
            // Each bit is an axis that moves first. Without any, all axes move at once.
            let first = merge(from, to, |axis| number >> axis & 1 == 1);
            return Some([first, to, to, to, to, to, to]);
        };
        let before = *AZIMUTH_DIFFERENCES.get(number / AZIMUTH_DIFFERENCES.len())?;
        let after = *AZIMUTH_DIFFERENCES.get(number % AZIMUTH_DIFFERENCES.len())?;
        self.via_home(from, to, before, after)
    }

    /// Returns the waypoints via home. While a polar axis moves, the azimuths differ by `before` on the way to home,
    /// and by `after` on the way back. None keeps the azimuths.
    fn via_home(
        &self,
        from: AxisAngles,
        to: AxisAngles,
        before: Option<f32>,
        after: Option<f32>,
    ) -> Option<[AxisAngles; MAX_LEGS]> {
        let [home_i, phi_i, home_o, phi_o] = self.home;
        let [min, max] = [self.min_angles, self.max_angles];
        let [min_i, _, min_o, _] = min;
        let [max_i, _, max_o, _] = max;
        let home = [
            home_i.max(min_i).min(max_i),
            phi_i,
            home_o.max(min_o).min(max_o),
            phi_o,
        ];
        let (outer, inner) = if self.is_sensor_outer() {
            (2, 0)
        } else {
            (0, 2)
        };
        let spread = self.spread_azimuths(from, before)?;
        let at_horizon = merge(spread, home, |axis| axis == outer);
        let at_home = merge(at_horizon, home, |axis| axis == inner);
        let turned = merge(at_home, self.spread_azimuths(to, after)?, |axis| {
            axis % 2 == 1
        });
        let back = merge(turned, to, |axis| axis == inner);
        let all_back = merge(back, to, |axis| axis == outer);
        Some([spread, at_horizon, at_home, turned, back, all_back, to])
    }

    /// Returns the same polar angles with azimuths that differ by `difference`, if both axes reach them.
    fn spread_azimuths(&self, angles: AxisAngles, difference: Option<f32>) -> Option<AxisAngles> {
        let Some(difference) = difference else {
            return Some(angles);
        };
        let [theta_i, _, theta_o, phi_o] = angles;
        let [_, min_i, _, min_o] = self.min_angles;
        let [_, max_i, _, max_o] = self.max_angles;
        let phi_o = phi_o
            .max(min_o.max(min_i + difference))
            .min(max_o.min(max_i + difference));
        let phi_i = phi_o - difference;
        let is_within = |angle, min, max| min <= angle && angle <= max;
        let is_reachable = is_within(phi_i, min_i, max_i) && is_within(phi_o, min_o, max_o);
        is_reachable.then_some([theta_i, phi_i, theta_o, phi_o])
    }

    /// Returns true if lamp and sensor stay apart along these waypoints.
    fn is_safe(&self, from: AxisAngles, waypoints: &[AxisAngles]) -> bool {
        let starts = core::iter::once(&from).chain(waypoints);
        let mut legs = starts.zip(waypoints);
        legs.all(|(from, to)| self.is_far_enough(separation_between(*from, *to)))
    }

    /// Returns true if a separation is large enough. Returns false for NaN.
    fn is_far_enough(&self, separation: f32) -> bool {
        separation >= self.limits.min_separation - self.tolerance
    }

    /// Returns true if the sensor is the outer arm: the one whose home is nearer to the horizon.
    fn is_sensor_outer(&self) -> bool {
        let [home_i, _, home_o, _] = self.home;
        home_o.abs() >= home_i.abs()
    }
}

/// Returns the angles of `to` for the axes of a group, and those of `from` for the others.
fn merge(from: AxisAngles, to: AxisAngles, is_moved: impl Fn(usize) -> bool) -> AxisAngles {
    let mut merged = from;
    for (axis, (merged, to)) in merged.iter_mut().zip(to).enumerate() {
        if is_moved(axis) {
            *merged = to;
        }
    }
    merged
}

/// Returns the waypoints without consecutive repeats.
fn without_repeats(
    from: AxisAngles,
    waypoints: [AxisAngles; MAX_LEGS],
) -> [Option<AxisAngles>; MAX_LEGS] {
    let mut last = from;
    let mut moves = waypoints.into_iter().filter(|waypoint| {
        let is_move = *waypoint != last;
        last = *waypoint;
        is_move
    });
    [(); MAX_LEGS].map(|()| moves.next())
}
