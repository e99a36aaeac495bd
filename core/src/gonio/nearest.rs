//! A machine with two arms, its reach, and the pending sample that the arms reach first.

use core::f32::consts::{PI, TAU};

use serde::{Deserialize, Serialize};

use super::Limits;
use crate::error::{Error, ErrorCode};
use crate::geometry::{ArmAngles, Directions, Spherical};
use crate::numeric::math;

/// Speed of each axis in radians per second. 0, a negative number or NaN: the machine lacks this axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Speeds {
    /// The light's polar angle.
    pub theta_i: f32,
    /// The light's azimuth.
    pub phi_i: f32,
    /// The sensor's polar angle.
    pub theta_o: f32,
    /// The sensor's azimuth.
    pub phi_o: f32,
}

/// A scanner with two arms.
///
/// ```
/// use glimpse_core::geometry::{ArmAngles, Spherical};
/// use glimpse_core::gonio::{Limits, Machine, Speeds};
///
/// // The lamp has no azimuth axis. The sensor's azimuth is free.
/// let machine = Machine {
///     speeds: Speeds { theta_i: 0.5, phi_i: 0.0, theta_o: 0.5, phi_o: 1.0 },
///     ..Machine::new(Limits::NONE)
/// };
/// let arms = |theta_i, phi_i, theta_o, phi_o| ArmAngles {
///     incoming: Spherical { theta: theta_i, phi: phi_i },
///     outgoing: Spherical { theta: theta_o, phi: phi_o },
/// };
/// let pending = [arms(1.0, 0.0, 0.5, 3.0), arms(0.3, 2.0, 0.5, 3.0)].map(|arms| arms.directions());
/// let next = machine.nearest((0..).zip(pending), &arms(0.2, 0.0, 0.4, 0.5)).unwrap();
/// assert_eq!(next.index, 1);
/// assert!(next.arms.incoming.phi.abs() < 1e-6); // both arms are turned by -2 about the normal
/// assert!((next.arms.outgoing.phi - 1.0).abs() < 1e-6);
/// assert!((next.seconds - 0.5).abs() < 1e-5); // the sensor's azimuth takes longest
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Machine {
    /// The speeds of its axes.
    pub speeds: Speeds,
    /// The reach of its arms.
    pub limits: Limits,
    /// True if the sample is isotropic, so that both azimuths may be turned together.
    pub isotropic: bool,
    /// True if the arms swing through the normal to negative polar angles, like two arms that move in one plane.
    /// (-theta, phi) is the direction (theta, phi + pi).
    pub through_normal: bool,
    /// Angles at which the axes that the machine lacks are fixed, radians. Those of other axes have no effect.
    pub fixed: ArmAngles,
}

/// A move of the arms to a pending sample.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Move {
    /// The pending sample's index.
    pub index: u16,
    /// Angles of the arms in radians. The azimuths are the nearest to the previous ones. After many moves, they may
    /// exceed one turn, so that the machine has to unwind its cables.
    pub arms: ArmAngles,
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
        let along_normal = Spherical {
            theta: 0.0,
            phi: 0.0,
        };
        Self {
            speeds: Speeds {
                theta_i: 1.0,
                phi_i: 1.0,
                theta_o: 1.0,
                phi_o: 1.0,
            },
            limits,
            isotropic: true,
            through_normal: false,
            fixed: ArmAngles {
                incoming: along_normal,
                outgoing: along_normal,
            },
        }
    }

    /// Checks that the machine reaches a pair of directions, within its limits and with its axes.
    ///
    /// # Errors
    /// Fails like [`Limits::check`], or with [`ErrorCode::MissingAxis`].
    pub fn check(&self, directions: &Directions<f32>) -> Result<(), Error> {
        self.limits.check(directions)?;
        let (_, seconds) = self.fastest(&ArmAngles::from_directions(directions), &self.fixed);
        // A duration is infinite if the move needs a missing axis.
        match seconds.is_finite() {
            true => Ok(()),
            false => Err(Error::new(ErrorCode::MissingAxis)),
        }
    }

    /// Returns a position with the axes that the machine lacks at their fixed angles.
    fn with_fixed_axes(&self, from: &ArmAngles) -> ArmAngles {
        let fix = |speed: f32, angle, fixed| if speed > 0.0 { angle } else { fixed };
        let (speeds, fixed) = (self.speeds, self.fixed);
        ArmAngles {
            incoming: Spherical {
                theta: fix(speeds.theta_i, from.incoming.theta, fixed.incoming.theta),
                phi: fix(speeds.phi_i, from.incoming.phi, fixed.incoming.phi),
            },
            outgoing: Spherical {
                theta: fix(speeds.theta_o, from.outgoing.theta, fixed.outgoing.theta),
                phi: fix(speeds.phi_o, from.outgoing.phi, fixed.outgoing.phi),
            },
        }
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
        from: &ArmAngles,
    ) -> Option<Move> {
        let from = self.with_fixed_axes(from);
        let mut best: Option<Move> = None;
        for (index, directions) in pending {
            if self.limits.check(&directions).is_err() {
                continue;
            }
            let (arms, seconds) = self.fastest(&ArmAngles::from_directions(&directions), &from);
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
    fn fastest(&self, to: &ArmAngles, from: &ArmAngles) -> (ArmAngles, f32) {
        let through_normal = |arm: Spherical| Spherical {
            theta: -arm.theta,
            phi: arm.phi + PI,
        };
        let positions = [
            *to,
            ArmAngles {
                incoming: through_normal(to.incoming),
                ..*to
            },
            ArmAngles {
                outgoing: through_normal(to.outgoing),
                ..*to
            },
            ArmAngles {
                incoming: through_normal(to.incoming),
                outgoing: through_normal(to.outgoing),
            },
        ];
        let mut best = (*to, f32::INFINITY);
        for position in positions
            .iter()
            .take(if self.through_normal { 4 } else { 1 })
        {
            let (arms, seconds) = self.with_fastest_azimuths(position, from);
            if seconds < best.1 {
                best = (arms, seconds);
            }
        }
        best
    }

    /// Returns a position with the azimuths that take the shortest time, and this time in seconds. Whole turns do not
    /// change a direction. If the sample is isotropic, both azimuths may also be turned together by any angle.
    fn with_fastest_azimuths(&self, to: &ArmAngles, from: &ArmAngles) -> (ArmAngles, f32) {
        let Speeds {
            theta_i,
            phi_i,
            theta_o,
            phi_o,
        } = self.speeds;
        let [sin_i, sin_o] = [to.incoming, to.outgoing].map(|arm| math::sin_cos(arm.theta).0.abs());
        let mut by_i = wrapped(to.incoming.phi - from.incoming.phi);
        let mut by_o = wrapped(to.outgoing.phi - from.outgoing.phi);
        if self.isotropic {
            // Only the difference of the azimuths matters, unless an arm is along the normal. Each axis turns in
            // proportion to its speed, so that both end at the same time.
            let difference = if sin_i <= TOLERANCE || sin_o <= TOLERANCE {
                0.0
            } else {
                wrapped(by_o - by_i)
            };
            let [phi_i, phi_o] = [phi_i, phi_o].map(|speed| if speed > 0.0 { speed } else { 0.0 });
            let speed = phi_i + phi_o;
            let share = if speed > 0.0 { phi_i / speed } else { 0.0 };
            by_i = -share * difference;
            by_o = difference + by_i;
        } else {
            if sin_i <= TOLERANCE {
                by_i = 0.0;
            }
            if sin_o <= TOLERANCE {
                by_o = 0.0;
            }
        }
        let arm = |to: Spherical, from: Spherical, by, speed| Spherical {
            theta: to.theta,
            phi: if speed > 0.0 { from.phi + by } else { from.phi },
        };
        let arms = ArmAngles {
            incoming: arm(to.incoming, from.incoming, by_i, phi_i),
            outgoing: arm(to.outgoing, from.outgoing, by_o, phi_o),
        };
        let durations = [
            duration(to.incoming.theta - from.incoming.theta, 1.0, theta_i),
            duration(by_i, sin_i, phi_i),
            duration(to.outgoing.theta - from.outgoing.theta, 1.0, theta_o),
            duration(by_o, sin_o, phi_o),
        ];
        // No duration is NaN.
        let longer = |a: f32, b: f32| if b > a { b } else { a };
        let seconds = durations.into_iter().fold(0.0, longer);
        (arms, seconds)
    }
}
