//! The reach of a machine's arms.

use core::f32::consts::{FRAC_PI_2, PI};

use crate::error::{Error, ErrorCode};
use crate::geometry::{Arms, Directions};

/// The reach of a machine's arms, without limits of the azimuths; angles in radians. [`Limits::validate`] checks
/// them.
///
/// ```
/// use glimpse_core::error::{Error, ErrorCode};
/// use glimpse_core::geometry::Arms;
/// use glimpse_core::gonio::Limits;
///
/// let limits = Limits {
///     max_theta_o: 1.2,
///     min_separation: 0.2, // the lamp would shade the sample, or the arms collide
///     ..Limits::NONE
/// };
/// limits.validate()?;
///
/// let sensor_at = |theta_o| Arms { theta_i: 0.5, theta_o, ..Arms::NORMAL };
/// assert_eq!(limits.check(&sensor_at(0.9).directions()), Ok(()));
/// let error = limits.check(&sensor_at(0.6).directions()).unwrap_err();
/// assert_eq!(error.code, ErrorCode::MinSeparation);
/// let deficit = f32::from_bits(error.details[0]); // radians
/// assert!((deficit - 0.1).abs() < 1e-5);
/// # Ok::<(), Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// The largest polar angle of the light's arm: above 0, at most pi/2.
    pub max_theta_i: f32,
    /// The largest polar angle of the sensor's arm: above 0, at most pi/2.
    pub max_theta_o: f32,
    /// The smallest angle between light and sensor: 0 to pi, and at most the sum of the largest polar angles.
    pub min_separation: f32,
    /// True if light, normal and sensor always lie in one plane.
    pub in_plane: bool,
}

impl Limits {
    /// No limits: both arms reach the whole hemisphere.
    pub const NONE: Self = Self {
        max_theta_i: FRAC_PI_2,
        max_theta_o: FRAC_PI_2,
        min_separation: 0.0,
        in_plane: false,
    };

    /// The tolerance of the limits of angles in radians (0.006 degrees). It covers the rounding of directions whose
    /// angles lie exactly on a limit.
    pub const TOLERANCE: f32 = 1e-4;
    /// The tolerance of `in_plane`, radians (0.06 degrees).
    const IN_PLANE_TOLERANCE: f32 = 1e-3;

    /// Checks the ranges of the limits.
    ///
    /// # Errors
    /// [`ErrorCode::Limits`] with the name of the limit that is out of range.
    pub fn validate(&self) -> Result<(), Error> {
        // This form of the condition rejects NaN too.
        let polar = |theta: f32| theta > 0.0 && theta <= FRAC_PI_2;
        let max_separation = PI.min(self.max_theta_i + self.max_theta_o);
        let field = if !polar(self.max_theta_i) {
            "limits.max_theta_i"
        } else if !polar(self.max_theta_o) {
            "limits.max_theta_o"
        } else if !(0.0..=max_separation).contains(&self.min_separation) {
            "limits.min_separation"
        } else {
            return Ok(());
        };
        Err(Error::in_field(ErrorCode::Limits, field))
    }

    /// Checks that the arms reach a pair of directions. A limit that is NaN is exceeded.
    ///
    /// # Errors
    /// [`ErrorCode::Directions`]; or the code of the first limit that is exceeded, and the excess:
    /// [`ErrorCode::MaxThetaI`], [`ErrorCode::MaxThetaO`], [`ErrorCode::MinSeparation`] or [`ErrorCode::InPlane`].
    pub fn check(&self, directions: &Directions<f32>) -> Result<(), Error> {
        directions.check()?;
        let arms = Arms::from_directions(directions);
        let check = |code, excess: f32, tolerance| match excess.is_nan() || excess > tolerance {
            true => Err(Error::with(code, [excess.to_bits(), 0])),
            false => Ok(()),
        };
        let theta_i = arms.theta_i - self.max_theta_i;
        let theta_o = arms.theta_o - self.max_theta_o;
        let separation = self.min_separation - directions.separation();
        check(ErrorCode::MaxThetaI, theta_i, Self::TOLERANCE)?;
        check(ErrorCode::MaxThetaO, theta_o, Self::TOLERANCE)?;
        check(ErrorCode::MinSeparation, separation, Self::TOLERANCE)?;
        if self.in_plane {
            let deviation = directions.out_of_plane();
            check(ErrorCode::InPlane, deviation, Self::IN_PLANE_TOLERANCE)?;
        }
        Ok(())
    }
}
