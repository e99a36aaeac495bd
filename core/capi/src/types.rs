//! Types of the C API.

use glimpse_core::geometry::{ArmAngles, Directions, Spherical};
use glimpse_core::gonio::Limits;
use glimpse_core::link::BYTES_PER_FRAME;
use glimpse_core::model::ModelKind;
use glimpse_core::scan::{Reading, Residual};

use crate::status::glimpse_status;

/// A pair of unit directions that point away from the surface; z is the normal.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct glimpse_directions {
    /// Towards the light: x, y, z.
    pub incoming: [f32; 3],
    /// Towards the sensor: x, y, z.
    pub outgoing: [f32; 3],
}

/// Positions of both arms as spherical angles in radians: theta from the normal, phi about the normal from
/// x towards y.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct glimpse_arms {
    /// Polar angle of the light: 0 to pi/2.
    pub theta_i: f32,
    /// Azimuth of the light, modulo 2 pi. 0 along the normal.
    pub phi_i: f32,
    /// Polar angle of the sensor: 0 to pi/2.
    pub theta_o: f32,
    /// Azimuth of the sensor, modulo 2 pi. 0 along the normal.
    pub phi_o: f32,
}

/// A sample of the recipe's pattern.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct glimpse_sample {
    /// Index in the pattern, from 0.
    pub index: u16,
    /// Directions of light and sensor. The half vector lies in the xz plane; for an isotropic material
    /// both azimuths may be rotated by the same angle.
    pub directions: glimpse_directions,
    /// The directions as spherical angles.
    pub arms: glimpse_arms,
    /// Rusinkiewicz angle between the normal and the half vector, radians: 0 to pi/2.
    pub theta_h: f32,
    /// Rusinkiewicz angle between the half vector and the light, radians: 0 to pi/2.
    pub theta_d: f32,
    /// Rusinkiewicz azimuth of the light about the half vector, radians.
    pub phi_d: f32,
}

/// A reading of the sensor.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct glimpse_reading {
    /// The BRDF in linear red, green and blue, in sr^-1: not times the cosine, not counts, not a
    /// reflectance factor. Values down to -1 are accepted as noise. A sensor with one channel repeats its
    /// value three times.
    pub brdf: [f32; 3],
    /// Not 0 if the sensor was saturated: the true value is larger.
    pub saturated: u8,
}

/// Details of a recorded reading.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct glimpse_recorded {
    /// 1 if it replaced an earlier reading, else 0.
    pub replaced: u8,
    /// 1 if the fit will raise a channel that is too far below 0, else 0.
    pub clamped: u8,
}

/// Progress of a fit in units of work. A unit is the gradient at one sample, one row or channel of Linear's
/// solve, or one part of the completion.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct glimpse_progress {
    /// Units done.
    pub done: u32,
    /// Units of the whole fit, which is complete when done equals total.
    pub total: u32,
}

/// Quality of a fit at its readings. It does not reveal readings with a wrong convention: readings that
/// are wrongly multiplied by the cosine have equally small residuals.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct glimpse_residual {
    /// The mean cosine-weighted logarithmic error over the readings.
    pub mean: f32,
    /// The largest error of a reading.
    pub worst: f32,
    /// Index of the reading with the largest error.
    pub worst_index: u16,
    /// Number of saturated readings.
    pub saturated: u16,
    /// Number of readings that equal the previous one bit for bit. A real sensor has noise: if all but the
    /// first are equal, the sensor is stuck.
    pub repeated: u16,
    /// Number of readings that were too far below 0 and were raised.
    pub clamped: u16,
    /// Reason why the material is implausible: GLIMPSE_STATUS_DARK to GLIMPSE_STATUS_IMPLAUSIBLE_OTHER
    /// (84 to 91). 0 if it is plausible.
    pub implausible: i32,
}

/// The reflectance models.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum glimpse_model {
    /// Phong: 7 values.
    Phong = 0,
    /// Neural network: 675 values.
    Neural = 1,
    /// Cook-Torrance: 8 values.
    CookTorrance = 2,
    /// Principal components: 3 m values, m for red, m for green, m for blue.
    Linear = 3,
}

/// An answer that may be unknown. Compare it with these values: GLIMPSE_ANSWER_UNKNOWN is not 0, either.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum glimpse_answer {
    /// No.
    No = 0,
    /// Yes.
    Yes = 1,
    /// The recipe cannot tell.
    Unknown = 2,
}

/// Description of a recipe.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct glimpse_recipe {
    /// The fitted model.
    pub model: glimpse_model,
    /// n, the number of samples of its pattern.
    pub samples: u16,
    /// Number of values of a fit.
    pub values: u16,
    /// The CRC-32 in its header. It identifies the recipe that saved readings belong to.
    pub checksum: u32,
    /// Expected loss on a material outside of the training set; NaN if the recipe does not include it.
    pub expected_loss: f32,
}

/// A reading that survived a reset.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct glimpse_saved {
    /// Index of the sample in the recipe's pattern.
    pub index: u16,
    /// The reading.
    pub reading: glimpse_reading,
}

/// The role of the host.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum glimpse_host {
    /// A host moves the arms and reads the sensor, as the device requests.
    Measures = 0,
    /// The device moves the arms; a host receives progress and result.
    Listens = 1,
    /// The device moves the arms, without a host.
    Absent = 2,
}

/// Limits of the measuring machine; angles in radians.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct glimpse_limits {
    /// The largest polar angle of the light's arm: above 0, at most pi/2.
    pub max_theta_i: f32,
    /// The largest polar angle of the sensor's arm: above 0, at most pi/2.
    pub max_theta_o: f32,
    /// The smallest angle between light and sensor: 0 to pi.
    pub min_separation: f32,
    /// Not 0 if light, normal and sensor always lie in one plane.
    pub in_plane: u8,
}

/// Options of a driver. glimpse_config_default() returns the defaults.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct glimpse_config {
    /// One of glimpse_host.
    pub host: i32,
    /// Not 0 if `limits` are set. The driver skips samples out of reach if the recipe tolerates missing
    /// readings; else the scan fails before the first measurement. If 0, the driver assumes that all samples
    /// are within reach.
    pub has_limits: u8,
    /// Number of invalid readings of a sample after which the driver skips it, or fails if the recipe needs
    /// every reading.
    pub attempts: u8,
    /// Limits of the measuring machine.
    pub limits: glimpse_limits,
    /// Seed of the sequence numbers on the link. It must differ from the seeds of all earlier
    /// drivers of this device: a boot counter, a random number, or the value of a free-running timer.
    pub sequence_seed: u32,
    /// Units of the fit per glimpse_driver_poll(). 0 means 1.
    pub steps_per_poll: u32,
    /// Interval of retransmissions of a request without a reply, in ms.
    pub retransmit_interval_ms: u32,
    /// Timeout of a reply, in ms.
    pub reply_timeout_ms: u32,
    /// Timeout of a reading by the host, in ms; includes the motion of its arms.
    pub measure_timeout_ms: u32,
    /// Maximum size of a recipe that the device can store, in bytes. 0 if it stores none.
    pub recipe_bytes: u32,
    /// Loss at which a scan stops before all samples are read; 0 for none. After each reading, the driver
    /// fits the readings that it has. If glimpse_fitted_loss_bound() is at most this loss, it skips the
    /// pending samples, and this fit is the result. Each fit takes as many units as one of all readings. It
    /// has no effect with recipes that do not bound the loss of such fits.
    pub target_loss: f32,
}

/// Kinds of glimpse_action. Ignore unknown kinds.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum glimpse_action_kind {
    /// Sleep until a byte arrives or can be sent, or glimpse_driver_poll_delay() has passed.
    Wait = 0,
    /// Poll again soon.
    Continue = 1,
    /// Move the arms to `directions`, read the sensor, then call glimpse_driver_record() with `index`, or
    /// glimpse_driver_skip(), or glimpse_driver_fail(). Other pending samples are allowed, too. The driver
    /// repeats this action until one of these calls.
    Measure = 2,
    /// Save `index` and `reading` in memory that survives a reset.
    Save = 3,
    /// Delete all saved readings.
    Forget = 4,
    /// Write `byte_count` bytes of `bytes` at `offset` of a new recipe, separate from the present one. A new
    /// recipe begins at offset 0.
    Store = 5,
    /// The new recipe of `offset` bytes is complete, and should have `checksum`. If its
    /// glimpse_driver_bytes() are neither 0 nor larger than the memory, begin a driver with it; else call
    /// glimpse_driver_reject().
    Install = 6,
    /// The scan is finished, with `residual`. glimpse_driver_scan() returns the fitted material until the
    /// next poll.
    Finished = 7,
    /// The scan has failed because of `failure`. With a host it restarts automatically after a pause.
    /// Without a host, call glimpse_driver_restart().
    Failed = 8,
}

/// The next action of the firmware. Fields that its kind does not use are 0.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct glimpse_action {
    /// The kind.
    pub kind: glimpse_action_kind,
    /// Reason of a failure.
    pub failure: glimpse_status,
    /// Offset of the bytes in a new recipe, or its length.
    pub offset: u32,
    /// Expected checksum in the header of a new recipe.
    pub checksum: u32,
    /// Directions of light and sensor.
    pub directions: glimpse_directions,
    /// The reading to save.
    pub reading: glimpse_reading,
    /// Quality of the fit.
    pub residual: glimpse_residual,
    /// Index of a sample.
    pub index: u16,
    /// Number of bytes to store.
    pub byte_count: u16,
    /// The bytes to store.
    pub bytes: [u8; 60],
}

const _: () = assert!(BYTES_PER_FRAME == 60); // the length of `bytes` above

impl From<Directions<f32>> for glimpse_directions {
    fn from(directions: Directions<f32>) -> Self {
        Self {
            incoming: directions.incoming,
            outgoing: directions.outgoing,
        }
    }
}

impl From<glimpse_directions> for Directions<f32> {
    fn from(directions: glimpse_directions) -> Self {
        Self {
            incoming: directions.incoming,
            outgoing: directions.outgoing,
        }
    }
}

/// Returns the directions of two arms. All angles are valid; below the horizon the BRDF is undefined.
#[unsafe(no_mangle)]
pub extern "C" fn glimpse_directions_of(arms: glimpse_arms) -> glimpse_directions {
    let spherical = |theta, phi| Spherical { theta, phi };
    let arms = ArmAngles {
        incoming: spherical(arms.theta_i, arms.phi_i),
        outgoing: spherical(arms.theta_o, arms.phi_o),
    };
    arms.directions().into()
}

impl From<Directions<f32>> for glimpse_arms {
    fn from(directions: Directions<f32>) -> Self {
        let ArmAngles { incoming, outgoing } = ArmAngles::from_directions(&directions);
        Self {
            theta_i: incoming.theta,
            phi_i: incoming.phi,
            theta_o: outgoing.theta,
            phi_o: outgoing.phi,
        }
    }
}

impl From<Reading> for glimpse_reading {
    fn from(reading: Reading) -> Self {
        Self {
            brdf: reading.brdf,
            saturated: u8::from(reading.saturated),
        }
    }
}

impl From<glimpse_reading> for Reading {
    fn from(reading: glimpse_reading) -> Self {
        Self {
            brdf: reading.brdf,
            saturated: reading.saturated != 0,
        }
    }
}

impl From<Residual> for glimpse_residual {
    fn from(residual: Residual) -> Self {
        Self {
            mean: residual.mean,
            worst: residual.worst,
            worst_index: residual.worst_index,
            saturated: residual.saturated,
            repeated: residual.repeated,
            clamped: residual.clamped,
            implausible: residual
                .implausible
                .map_or(glimpse_status::Ok, |reason| reason.code().into())
                as i32,
        }
    }
}

impl From<Limits> for glimpse_limits {
    fn from(limits: Limits) -> Self {
        Self {
            max_theta_i: limits.max_theta_i,
            max_theta_o: limits.max_theta_o,
            min_separation: limits.min_separation,
            in_plane: u8::from(limits.in_plane),
        }
    }
}

impl From<glimpse_limits> for Limits {
    fn from(limits: glimpse_limits) -> Self {
        Self {
            max_theta_i: limits.max_theta_i,
            max_theta_o: limits.max_theta_o,
            min_separation: limits.min_separation,
            in_plane: limits.in_plane != 0,
        }
    }
}

impl From<Option<bool>> for glimpse_answer {
    fn from(answer: Option<bool>) -> Self {
        match answer {
            Some(false) => Self::No,
            Some(true) => Self::Yes,
            None => Self::Unknown,
        }
    }
}

impl TryFrom<ModelKind> for glimpse_model {
    type Error = glimpse_status;

    fn try_from(model: ModelKind) -> Result<Self, glimpse_status> {
        Ok(match model {
            ModelKind::Phong => Self::Phong,
            ModelKind::Neural => Self::Neural,
            ModelKind::CookTorrance => Self::CookTorrance,
            ModelKind::Linear => Self::Linear,
            _ => return Err(glimpse_status::Model),
        })
    }
}
