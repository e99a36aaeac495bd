//! Safe routes of the arms: lamp and sensor stay apart at home, on the way, and at a sample.
//!
//! A [`Route`] is a list of waypoints. Between two waypoints the axes move at the same time, at unknown relative
//! speeds. A route is therefore safe if every combination of angles between two waypoints is safe. [`Space::route`]
//! tries in turn:
//!
//! 1. all axes at once;
//! 2. some axes first, then the others;
//! 3. via home: turn the azimuths apart, move the sensor to the horizon and then the lamp to the normal, turn the
//!    azimuths, and move the arms in reverse order. If the azimuths turn freely, this connects all safe configurations.
//!
//! At home the lamp is near the normal and the sensor near the horizon, so they are apart at any azimuths.

use core::f32::consts::{PI, TAU};

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::gonio::Limits;

use crate::axis::{Settings, of_axis};

/// Angles of the axes, radians: theta_i, phi_i, theta_o, phi_o.
pub type AxisAngles = [f32; 4];

/// The waypoints of a route. Some may be equal.
pub type Route = core::array::IntoIter<AxisAngles, MAX_LEGS>;

/// Maximum number of legs of a route.
const MAX_LEGS: usize = 7;

/// Homing order of axes at unknown positions: the sensor's polar axis, the lamp's, the azimuths. While the lamp's axis
/// moves, the separation never falls below the smaller of two values: the separation before the move, and that at home.
pub(crate) const HOMING_ORDER: [usize; 4] = [2, 0, 1, 3];

/// Order in which axes go to their far switches: the azimuths first, because the polar axes rely on their scale.
pub(crate) const FAR_ORDER: [usize; 4] = [1, 3, 0, 2];

/// The configuration space of the arms.
///
/// ```
/// use core::f32::consts::PI;
/// use glimpse_core::error::{Error, ErrorCode};
/// use glimpse_scanner::{axis::Settings, route::Space};
///
/// let no_route = Some(Error::new(ErrorCode::NoSafeRoute));
/// let axis = |home, min_angle, max_angle| Settings {
///     steps_per_radian: 2000.0, speed: 4000.0, acceleration: 20_000.0, homing_speed: 500.0,
///     home, min_angle, max_angle, far: None, tolerance: 1, reversed: false,
/// };
/// let (lamp, sensor) = (axis(-0.05, 0.0, 1.4), axis(1.5, 0.0, 1.4));
/// let (start, crossed) = ([0.2, 0.0, 1.0, 0.0], [1.0, 0.0, 0.2, 0.0]);
/// // The azimuths turn, so the lamp can pass the sensor.
/// let turning = axis(-PI - 0.05, -PI, PI);
/// let space = Space::new([lamp, turning, sensor, turning], 0.2)?;
/// assert!(space.route(start, crossed).is_ok());
/// assert_eq!(space.route(start, [f32::NAN; 4]).err(), no_route);
/// // A target that is closer than the minimum separation.
/// assert_eq!(space.route(start, [0.9, 0.0, 1.0, 0.0]).err(), no_route);
/// // Azimuths that hardly turn.
/// let fixed = axis(-0.06, -0.05, 0.05);
/// let space = Space::new([lamp, fixed, sensor, fixed], 0.2)?;
/// assert!(space.route(start, [0.5, 0.0, 1.2, 0.0]).is_ok());
/// assert_eq!(space.route(start, crossed).err(), no_route);
/// # Ok::<(), Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Space {
    pub(crate) settings: [Settings; 4],
    /// The limits of reachable samples.
    pub(crate) limits: Limits,
}

impl Space {
    /// Creates the space of these axes, in the order theta_i, phi_i, theta_o, phi_o. `min_separation` is the minimum
    /// angle between lamp and sensor, radians.
    ///
    /// # Errors
    /// If a value is out of range, or lamp and sensor may collide while they are homed or a far switch is searched.
    pub fn new(settings: [Settings; 4], min_separation: f32) -> Result<Self, Error> {
        for (number, axis) in (0..).zip(&settings) {
            axis.validate().map_err(of_axis(number))?;
        }
        let [lamp, _, sensor, _] = &settings;
        let limits = Limits {
            max_theta_i: lamp.max_angle,
            max_theta_o: sensor.max_angle,
            min_separation,
            in_plane: false,
        };
        limits.validate()?;
        // An axis is homed within this range if its position is known, at any azimuths.
        let [i, o] = [lamp, sensor].map(|axis| axis.angle(axis.margin(Settings::LOST)));
        let separation = separation_between(
            [lamp.home - i, 0.0, sensor.home - o, -PI],
            [lamp.home + i, 0.0, sensor.home + o, PI],
        );
        let is_sensor_outer = libm::fabsf(sensor.home) > libm::fabsf(lamp.home);
        if separation < min_separation || !is_sensor_outer {
            return Err(Error::new(ErrorCode::HomeTooClose));
        }
        let space = Self { settings, limits };
        for (axis, settings) in settings.iter().enumerate() {
            if settings.far.is_some() {
                space.route_to_end(space.home(), axis)?;
            }
        }
        Ok(space)
    }

    /// Plans a route along which lamp and sensor are at least the minimum separation apart. Its waypoints are rounded
    /// to steps.
    ///
    /// # Errors
    /// [`ErrorCode::NoSafeRoute`], also for NaN.
    pub fn route(&self, from: AxisAngles, to: AxisAngles) -> Result<Route, Error> {
        let no_route = Error::new(ErrorCode::NoSafeRoute);
        if !from.iter().chain(&to).all(|angle| angle.is_finite()) {
            return Err(no_route);
        }
        // Each bit of a group is an axis that moves first. In group 0 all axes move at once.
        let groups = (0..15_u8).map(|group| {
            let first = merge(from, to, |axis| group >> axis & 1 == 1);
            Some([first, to, to, to, to, to, to])
        });
        let routes = groups.chain([self.via_home(from, to)]).flatten();
        let mut routes = routes.map(|route| route.map(|angles| self.round(angles)));
        let route = routes.find(|route| self.is_safe(from, route));
        Ok(route.ok_or(no_route)?.into_iter())
    }

    /// Plans a route to a configuration in which an axis can leave the end of its travel for its far switch. The other
    /// axes are home, but polar axes move at opposite azimuths, and the lamp leaves the normal before the sensor goes there.
    pub(crate) fn route_to_end(&self, from: AxisAngles, axis: usize) -> Result<Route, Error> {
        let home = self.home();
        let apart = self.spread(home).filter(|_| axis == 0 || axis == 2);
        let ends = self.settings.each_ref().map(Settings::end);
        let far = self.settings.each_ref().map(|axis| {
            let beyond = axis.angle(2 * axis.margin(Settings::LOST));
            axis.end() + libm::copysignf(beyond, axis.end() - axis.home)
        });
        let end = merge(apart.unwrap_or(home), ends, |other| {
            other == axis || (axis, other) == (2, 0)
        });
        let beyond = merge(end, far, |other| other == axis);
        if separation_between(end, beyond) < self.limits.min_separation {
            return Err(Error::new(ErrorCode::NoSafeRoute));
        }
        self.route(from, end)
    }

    /// Returns the waypoints via home, if the azimuths can turn apart.
    fn via_home(&self, from: AxisAngles, to: AxisAngles) -> Option<[AxisAngles; MAX_LEGS]> {
        let (home, spread, back) = (self.home(), self.spread(from)?, self.spread(to)?);
        let sensor_home = merge(spread, home, |axis| axis == 2);
        let both_home = merge(sensor_home, home, |axis| axis == 0);
        let turned = merge(back, home, |axis| axis % 2 == 0);
        let lamp_back = merge(back, home, |axis| axis == 2);
        Some([spread, sensor_home, both_home, turned, lamp_back, back, to])
    }

    /// Returns the angles within the limits that are nearest to home.
    pub(crate) fn home(&self) -> AxisAngles {
        self.settings.each_ref().map(|axis| axis.clamp(axis.home))
    }

    /// Returns the same polar angles with azimuths that differ by half a turn, in the direction in which they differ.
    /// None if the axes do not reach them.
    fn spread(&self, [theta_i, phi_i, theta_o, phi_o]: AxisAngles) -> Option<AxisAngles> {
        let difference = libm::copysignf(PI, phi_o - phi_i);
        let [_, i, _, o] = &self.settings;
        let low = o.min_angle.max(i.min_angle + difference);
        let high = o.max_angle.min(i.max_angle + difference);
        let phi_o = phi_o.max(low).min(high);
        (low <= high).then_some([theta_i, phi_o - difference, theta_o, phi_o])
    }

    fn round(&self, angles: AxisAngles) -> AxisAngles {
        let mut angles = angles.into_iter();
        let axes = self.settings.each_ref();
        axes.map(|axis| axis.angle(axis.steps(angles.next().unwrap_or_default())))
    }

    /// Returns true if lamp and sensor stay apart along these waypoints.
    fn is_safe(&self, from: AxisAngles, waypoints: &[AxisAngles]) -> bool {
        let mut legs = core::iter::once(&from).chain(waypoints).zip(waypoints);
        legs.all(|(from, to)| separation_between(*from, *to) >= self.limits.min_separation)
    }
}

/// Returns the angles of `to` for the axes of a group, and those of `from` for the others.
fn merge(from: AxisAngles, to: AxisAngles, is_in_group: impl Fn(usize) -> bool) -> AxisAngles {
    let mut axes = (0..).zip(to);
    from.map(|from| match axes.next() {
        Some((axis, to)) if is_in_group(axis) => to,
        _ => from,
    })
}

/// Returns a lower bound of the angle between lamp and sensor, radians, while each axis moves from its angle in `from`
/// to that in `to`, at any speed. The angles must be finite.
///
/// The cosine of the angle between the arms is
///
/// (1 + c) / 2 cos(θi - θo) + (1 - c) / 2 cos(θi + θo),
///
/// where c is the cosine of the azimuth difference. The bound takes the largest value of each cosine. It is exact if
/// only azimuths or no axes move, and if the azimuths are equal or opposite.
pub fn separation_between(from: AxisAngles, to: AxisAngles) -> f32 {
    let ([a, b, c, d], [e, f, g, h]) = (from, to);
    let same = max_cosine([a - c, a - g, e - c, e - g]);
    let opposite = max_cosine([a + c, a + g, e + c, e + g]);
    let azimuths = [b - d, b - h, f - d, f - h];
    let cosines = [
        max_cosine(azimuths),
        -max_cosine(azimuths.map(|angle| angle + PI)),
    ];
    let bounds = cosines.map(|c| 0.5 * ((1.0 + c) * same + (1.0 - c) * opposite));
    libm::acosf(bounds.into_iter().fold(-1.0, f32::max).min(1.0))
}

/// Returns the largest cosine of all angles between the smallest and the largest one.
fn max_cosine(angles: [f32; 4]) -> f32 {
    let low = angles.into_iter().fold(f32::INFINITY, f32::min);
    let high = angles.into_iter().fold(f32::NEG_INFINITY, f32::max);
    if libm::ceilf(low / TAU) <= libm::floorf(high / TAU) {
        return 1.0;
    }
    libm::cosf(low).max(libm::cosf(high))
}
