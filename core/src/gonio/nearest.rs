//! The pending pair of directions that the arms reach first.

use core::f32::consts::{PI, TAU};

use super::Limits;
use crate::geometry::{ArmAngles, Directions, Spherical};
use crate::numeric::math;

/// Speed of each axis, radians per second. 0 is an axis that the machine does not have: it
/// stands where it is.
#[derive(Clone, Copy, Debug, PartialEq)]
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
/// // The lamp has no azimuth of its own; the sensor goes all around.
/// let machine = Machine {
///     speeds: Speeds { theta_i: 0.5, phi_i: 0.0, theta_o: 0.5, phi_o: 1.0 },
///     limits: Limits::NONE,
///     isotropic: true,
///     through_normal: false,
/// };
/// let arms = |theta_i, phi_i, theta_o, phi_o| ArmAngles {
///     incoming: Spherical { theta: theta_i, phi: phi_i },
///     outgoing: Spherical { theta: theta_o, phi: phi_o },
/// };
/// let pending = [arms(1.0, 0.0, 0.5, 3.0), arms(0.3, 2.0, 0.5, 3.0)].map(|arms| arms.directions());
/// let next = machine.nearest((0..).zip(pending), &arms(0.2, 0.0, 0.4, 0.5)).unwrap();
/// assert_eq!(next.index, 1);
/// assert!(next.arms.incoming.phi.abs() < 1e-6); // turned by -2 about the normal
/// assert!((next.arms.outgoing.phi - 1.0).abs() < 1e-6);
/// assert!((next.seconds - 0.5).abs() < 1e-5); // the sensor's azimuth is the slowest
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
    /// True if its arms swing through the normal to negative polar angles, where (-theta, phi) is
    /// the direction (theta, phi + pi): as with two arms that move in one plane.
    pub through_normal: bool,
}

/// The next move.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Move {
    /// The pending sample's index.
    pub index: u16,
    /// The angles of the arms, radians. Azimuths are those nearest to where the arms were, and
    /// so may leave one turn in the long run: cables are the machine's to unwind.
    pub arms: ArmAngles,
    /// Duration, seconds: that of the slowest axis, at full speed from start to end.
    pub seconds: f32,
}

/// How far from its direction an arm may point, radians, because of an axis that does not turn; and
/// the sine of the polar angle at which an azimuth is none.
const STILL: f32 = 1e-3;

/// How long an axis takes to turn `by`, seconds, if an arm's direction moves by `sin` times as much.
fn duration(by: f32, sin: f32, speed: f32) -> f32 {
    if speed > 0.0 && by.is_finite() {
        by.abs() / speed
    } else if (by * sin).abs() <= STILL {
        0.0
    } else {
        f32::INFINITY
    }
}

/// The same angle in \[-pi, pi\], for one within a thousand turns.
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
    /// The pending sample that the arms reach soonest `from` where they are: the first one of several
    /// that take as long. Samples out of reach are left out; None if no other is pending.
    ///
    /// To go to the nearest one each time is no shortest way through all of them: where time
    /// matters, the host plans the order and the device keeps to it.
    pub fn nearest(
        &self,
        pending: impl Iterator<Item = (u16, Directions<f32>)>,
        from: &ArmAngles,
    ) -> Option<Move> {
        let mut best: Option<Move> = None;
        for (index, directions) in pending {
            if self.limits.check(&directions).is_err() {
                continue;
            }
            let (arms, seconds) = self.fastest(&ArmAngles::from_directions(&directions), from);
            // No sample whose way is infinite: an axis would have to turn that cannot.
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

    /// The fastest of the ways in which the arms may stand at a pair of directions, and how long it
    /// takes.
    fn fastest(&self, to: &ArmAngles, from: &ArmAngles) -> (ArmAngles, f32) {
        let across = |arm: Spherical| Spherical {
            theta: -arm.theta,
            phi: arm.phi + PI,
        };
        let ways = [
            *to,
            ArmAngles {
                incoming: across(to.incoming),
                ..*to
            },
            ArmAngles {
                outgoing: across(to.outgoing),
                ..*to
            },
            ArmAngles {
                incoming: across(to.incoming),
                outgoing: across(to.outgoing),
            },
        ];
        let mut best = (*to, f32::INFINITY);
        for way in ways.iter().take(if self.through_normal { 4 } else { 1 }) {
            let (arms, seconds) = self.turned(way, from);
            if seconds < best.1 {
                best = (arms, seconds);
            }
        }
        best
    }

    /// The azimuths that take least time, of what is the same direction, and if the sample is
    /// isotropic, of any common turn.
    fn turned(&self, to: &ArmAngles, from: &ArmAngles) -> (ArmAngles, f32) {
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
            // Only their difference matters, and none at all where an arm is along the normal.
            // Each axis takes its share, so that both end together.
            let apart = if sin_i <= STILL || sin_o <= STILL {
                0.0
            } else {
                wrapped(by_o - by_i)
            };
            let [phi_i, phi_o] = [phi_i, phi_o].map(|speed| if speed > 0.0 { speed } else { 0.0 });
            let both = phi_i + phi_o;
            let share = if both > 0.0 { phi_i / both } else { 0.0 };
            by_i = -share * apart;
            by_o = apart + by_i;
        } else {
            if sin_i <= STILL {
                by_i = 0.0;
            }
            if sin_o <= STILL {
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
        // None of them is a NaN.
        let longer = |a: f32, b: f32| if b > a { b } else { a };
        let seconds = durations.into_iter().fold(0.0, longer);
        (arms, seconds)
    }
}
