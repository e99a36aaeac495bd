//! A machine with two arms, its reach, and the pending sample that the arms reach first.

use core::f32::consts::{PI, TAU};

use super::Limits;
use crate::error::{Error, ErrorCode};
use crate::geometry::{Arms, Directions};
use crate::numeric::math;

/// A scanner with two arms.
///
/// ```
/// use glimpse_core::geometry::Arms;
/// use glimpse_core::gonio::{Limits, Machine};
///
/// // The lamp has no azimuth axis. The sensor's azimuth is free.
/// let machine = Machine {
///     speeds: Arms { theta_i: 0.5, phi_i: 0.0, theta_o: 0.5, phi_o: 1.0 },
///     ..Machine::new(Limits::NONE)
/// };
/// let arms = Arms::from_array;
/// let pending = [[1.0, 0.0, 0.5, 3.0], [0.3, 2.0, 0.5, 3.0]].map(|to| arms(to).directions());
/// let next = machine.nearest((0..).zip(pending), &arms([0.2, 0.0, 0.4, 0.5])).unwrap();
/// assert_eq!(next.index, 1);
/// assert!(next.arms.phi_i.abs() < 1e-6); // both arms are turned by -2 about the normal
/// assert!((next.arms.phi_o - 1.0).abs() < 1e-6);
/// assert!((next.seconds - 0.5).abs() < 1e-5); // the sensor's azimuth takes longest
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Machine {
    /// The speeds of its axes. 0, a negative number or NaN: the machine lacks this axis.
    pub speeds: Arms,
    /// The reach of its arms.
    pub limits: Limits,
    /// True if the sample is isotropic, so that both azimuths may be turned together.
    pub isotropic: bool,
    /// True if the arms swing through the normal to negative polar angles, like two arms that move in one plane.
    /// (-theta, phi) is the direction (theta, phi + pi).
    pub through_normal: bool,
    /// Angles at which the axes that the machine lacks are fixed, radians. Those of other axes have no effect.
    pub fixed: Arms,
}

/// A move of the arms to a pending sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Move {
    /// The pending sample's index.
    pub index: u16,
    /// Angles of the arms in radians. The azimuths are the nearest to the previous ones. After many moves, they may
    /// exceed one turn, so that the machine has to unwind its cables.
    pub arms: Arms,
    /// Duration in seconds: that of the axis that takes longest, at full speed from start to end.
    pub seconds: f32,
}

/// The largest deviation of an arm from its direction because of a missing axis, radians. Also the sine of the polar
/// angle up to which an azimuth has no effect.
const TOLERANCE: f32 = 1e-3;

/// Returns the duration in seconds of a turn of an axis by `by` radians. It moves the direction of the arm by `by`
/// times `sin`. Infinite if the axis is missing but has to turn.
fn duration(by: f32, sin: f32, speed: f32) -> f32 {
    if speed > 0.0 && by.is_finite() {
        by.abs() / speed
    } else if (by * sin).abs() <= TOLERANCE {
        0.0
    } else {
        f32::INFINITY
    }
}

/// Wraps an angle of at most a thousand turns to \[-pi, pi\].
fn wrapped(angle: f32) -> f32 {
    let turns = (angle / TAU + 0.5_f32.copysign(angle)) as i32 as f32;
    let wrapped = angle - turns * TAU;
    if wrapped > PI {
        wrapped - TAU
    } else if wrapped < -PI {
        wrapped + TAU
    } else {
        wrapped
    }
}

impl Machine {
    /// A machine with all four axes, each at 1 rad/s, for isotropic samples. Its arms do not swing through the normal.
    #[must_use]
    pub const fn new(limits: Limits) -> Self {
        Self {
            speeds: Arms::from_array([1.0; 4]),
            limits,
            isotropic: true,
            through_normal: false,
            fixed: Arms::NORMAL,
        }
    }

    /// Checks that the machine reaches a pair of directions, within its limits and with its axes.
    ///
    /// # Errors
    /// Fails like [`Limits::check`], or with [`ErrorCode::MissingAxis`].
    pub fn check(&self, directions: &Directions<f32>) -> Result<(), Error> {
        self.limits.check(directions)?;
        let (_, seconds) = self.fastest(&Arms::from_directions(directions), &self.fixed);
        // A duration is infinite if the move needs a missing axis.
        match seconds.is_finite() {
            true => Ok(()),
            false => Err(Error::new(ErrorCode::MissingAxis)),
        }
    }

    /// Returns a position with the axes that the machine lacks at their fixed angles.
    fn with_fixed_axes(&self, from: &Arms) -> Arms {
        let mut angles = self.fixed.to_array();
        let axes = self.speeds.to_array().into_iter().zip(from.to_array());
        for (angle, (speed, from)) in angles.iter_mut().zip(axes) {
            if speed > 0.0 {
                *angle = from;
            }
        }
        Arms::from_array(angles)
    }

    /// The pending sample that the arms reach first, starting at `from`. If several take equally long, it is the first
    /// of them. Samples out of reach are ignored. None if no pending sample is within reach.
    ///
    /// This greedy order is not the shortest path through all samples. Recipes
    /// [in path order](crate::recipe::Recipe::is_in_path_order) take less time in their own order: pass one sample at a
    /// time.
    pub fn nearest(
        &self,
        pending: impl Iterator<Item = (u16, Directions<f32>)>,
        from: &Arms,
    ) -> Option<Move> {
        let from = self.with_fixed_axes(from);
        let mut best: Option<Move> = None;
        for (index, directions) in pending {
            if self.limits.check(&directions).is_err() {
                continue;
            }
            let (arms, seconds) = self.fastest(&Arms::from_directions(&directions), &from);
            // A duration is infinite if the move needs a missing axis.
            if seconds < best.map_or(f32::INFINITY, |best| best.seconds) {
                best = Some(Move {
                    index,
                    arms,
                    seconds,
                });
            }
        }
        best
    }

    /// Returns the position of the arms for a pair of directions that takes the shortest time, and this time in
    /// seconds.
    fn fastest(&self, to: &Arms, from: &Arms) -> (Arms, f32) {
        let count = if self.through_normal { 2 } else { 1 };
        let ways = |theta: f32, phi| [(theta, phi), (-theta, phi + PI)].into_iter().take(count);
        let mut best = (*to, f32::INFINITY);
        for (theta_o, phi_o) in ways(to.theta_o, to.phi_o) {
            for (theta_i, phi_i) in ways(to.theta_i, to.phi_i) {
                let to = Arms::from_array([theta_i, phi_i, theta_o, phi_o]);
                let (arms, seconds) = self.with_fastest_azimuths(&to, from);
                if seconds < best.1 {
                    best = (arms, seconds);
                }
            }
        }
        best
    }

    /// Returns a position with the azimuths that take the shortest time, and this time in seconds. Whole turns do not
    /// change a direction. If the sample is isotropic, both azimuths may also be turned together by any angle.
    fn with_fastest_azimuths(&self, to: &Arms, from: &Arms) -> (Arms, f32) {
        let [sin_i, sin_o] = [to.theta_i, to.theta_o].map(|theta| math::sin_cos(theta).0.abs());
        let by_i = wrapped(to.phi_i - from.phi_i);
        let by_o = wrapped(to.phi_o - from.phi_o);
        // The azimuth of an arm along the normal has no effect.
        let turn = |by, sin: f32| if sin <= TOLERANCE { 0.0 } else { by };
        let (by_i, by_o) = if self.isotropic {
            // Only the difference of the azimuths matters. Each axis turns in proportion to its speed, so that both end
            // at the same time.
            let difference = turn(wrapped(by_o - by_i), sin_i.min(sin_o));
            let phi_i = self.speeds.phi_i.max(0.0);
            let speed = phi_i + self.speeds.phi_o.max(0.0);
            let share = if speed > 0.0 { phi_i / speed } else { 0.0 };
            let by_i = -share * difference;
            (by_i, difference + by_i)
        } else {
            (turn(by_i, sin_i), turn(by_o, sin_o))
        };
        let turned = |from: f32, by, speed| if speed > 0.0 { from + by } else { from };
        let arms = Arms {
            phi_i: turned(from.phi_i, by_i, self.speeds.phi_i),
            phi_o: turned(from.phi_o, by_o, self.speeds.phi_o),
            ..*to
        };
        let (theta_i, theta_o) = (to.theta_i - from.theta_i, to.theta_o - from.theta_o);
        let axes = [(theta_i, 1.0), (by_i, sin_i), (theta_o, 1.0), (by_o, sin_o)];
        let axes = axes.into_iter().zip(self.speeds.to_array());
        let durations = axes.map(|((by, sin), speed)| duration(by, sin, speed));
        (arms, durations.fold(0.0, f32::max))
    }
}
