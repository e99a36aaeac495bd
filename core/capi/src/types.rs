//! Types of the C API.

use core::ffi::{c_int, c_void};

use glimpse_core::fit::{Progress, ScanModel};
use glimpse_core::geometry::{Arms, Directions};
use glimpse_core::gonio::{Limits, Machine, Move, Reading};
use glimpse_core::scan::{Fitted, Recorded, Residual};

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
pub struct glimpse_recorded {
    /// 1 if it replaced an earlier reading, else 0.
    pub replaced: u8,
    /// 1 if the fit will clamp a channel that is too far below 0, else 0.
    pub clamped: u8,
}

/// Progress of a fit in units of work. A unit is the gradient at one sample, one row or channel of Linear's
/// solve, or one part of the completion.
#[repr(C)]
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
    /// Number of readings that were too far below 0 for the loss. The fit clamps them.
    pub clamped: u16,
    /// Reason why the material is implausible: GLIMPSE_STATUS_DARK to GLIMPSE_STATUS_RESTORED
    /// (84 to 95). 0 if it is plausible.
    pub implausible: i32,
    /// The largest channel of the readings with the lamp off, relative to the mean reading. NAN if it was not
    /// read, as without a driver.
    pub dark: f32,
    /// The largest change of the first sample, read again at the end, relative to it, or to the mean reading
    /// if that is larger. NAN if it was not read.
    pub drift: f32,
    /// Number of readings from before a restart of the device. 0 without a driver.
    pub restored: u16,
}

/// The reflectance models.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(dead_code)] // only in the header
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
pub struct glimpse_recipe {
    /// The fitted model: one of glimpse_model.
    pub model: i32,
    /// n, the number of samples of its pattern.
    pub samples: u16,
    /// Number of values of a fit.
    pub values: u16,
    /// The CRC-32 in its header. It identifies the recipe that saved readings belong to.
    pub checksum: u32,
    /// Expected loss on a material outside of the training set; NaN if the recipe does not include it.
    pub expected_loss: f32,
}

/// The fitted material's quality.
#[repr(C)]
pub struct glimpse_fitted {
    /// The error at the readings.
    pub residual: glimpse_residual,
    /// The loss predicted from this material's readings: the mean of
    /// |ln(1 + f cos(theta_i)) - ln(1 + f_fitted cos(theta_i))| over all directions. NAN if the recipe does
    /// not predict it, or if it is too large for a float.
    pub predicted_loss: f32,
    /// The upper bound of that loss, which holds for 90 % of materials. NAN if the recipe does not state it, or
    /// if it is too large for a float.
    pub loss_bound: f32,
    /// GLIMPSE_ANSWER_YES if the readings are unlike those of all training materials: the predicted loss and
    /// its bound are then uncertain.
    pub unlike_training: glimpse_answer,
}

/// A place in flash for the readings of a scan: two areas, one after the other. They need no preparation, and
/// nothing else has to survive a reset.
///
/// After a power cut or an error, the flash has the content before the call of a function or after it. Each
/// function deletes readings of a recipe other than the scan's.
///
/// The callbacks return 0 on success. They must not call functions of the scan or driver.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct glimpse_flash {
    /// Passed to the callbacks; may be null.
    pub context: *mut c_void,
    /// Reads `count` bytes.
    #[rustfmt::skip]
    pub read: Option<unsafe extern "C" fn(context: *mut c_void, offset: u32, bytes: *mut u8, count: usize) -> c_int>,
    /// Erases the bytes at offsets from `from` to `to` - 1, which are a whole area, to 0xFF.
    pub erase: Option<unsafe extern "C" fn(context: *mut c_void, from: u32, to: u32) -> c_int>,
    /// Writes 32 bytes, at a multiple of 32 bytes from `start`. Each place is written at most once after an
    /// erase.
    #[rustfmt::skip]
    pub write: Option<unsafe extern "C" fn(context: *mut c_void, offset: u32, bytes: *const u8, count: usize) -> c_int>,
    /// Offset of the first area: a multiple of the length of a sector.
    pub start: u32,
    /// Length of an area: whole sectors, at least GLIMPSE_STORE_BYTES of the recipe's samples. Larger areas
    /// are erased less often.
    pub area_bytes: u32,
}

/// The role of the host.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum glimpse_host {
    /// A host moves the arms and reads the sensor, as the device requests.
    Measures = 0,
    /// The device moves the arms; a host receives progress and result. The device scans alone if none
    /// answers.
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
    /// The smallest angle between light and sensor: 0 to pi, and at most the sum of both polar angles above.
    pub min_separation: f32,
    /// Not 0 if light, normal and sensor always lie in one plane.
    pub in_plane: u8,
}

/// A machine with two arms. glimpse_machine_default() returns one to change.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct glimpse_machine {
    /// The speed of each axis in rad/s. 0, a negative number or NAN: the machine lacks this axis.
    pub speeds: glimpse_arms,
    /// Angles at which the missing axes are fixed. Those of other axes have no effect.
    pub fixed: glimpse_arms,
    /// The reach of the arms.
    pub limits: glimpse_limits,
    /// Not 0 if the sample is isotropic, so that both azimuths may be turned together.
    pub isotropic: u8,
    /// Not 0 if the arms swing through the normal to negative polar angles. (-theta, phi) is the direction
    /// (theta, phi + pi).
    pub through_normal: u8,
}

/// A move of the arms to a pending sample.
#[repr(C)]
pub struct glimpse_move {
    /// Index of the sample in the pattern.
    pub index: u16,
    /// The new position. The azimuths are the nearest to the previous ones. After many moves they may exceed
    /// one turn, so that the machine has to unwind its cables.
    pub arms: glimpse_arms,
    /// Duration in seconds: that of the axis that takes longest.
    pub seconds: f32,
}

/// The larger spot on the sample at all angles, if the white is read at one pair of directions only.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum glimpse_footprint {
    /// Any: the white is read at the directions of each sample.
    Any = 0,
    /// The light's spot: all that the sensor sees is lit. Counts are proportional to f cos(theta_i).
    LightLarger = 1,
    /// The sensor's spot: it sees all that is lit. Counts are proportional to f cos(theta_o).
    SensorLarger = 2,
}

/// Counts of dark and white, with the same lamp and exposure as the sample. A monochrome sensor repeats its
/// numbers three times.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct glimpse_calibration {
    /// Counts without light.
    pub dark: [f32; 3],
    /// Counts of a white Lambertian tile, above the dark counts.
    pub white: [f32; 3],
    /// The tile's reflectance: above 0, at most 2 (a fraction, not per cent).
    pub reflectance: [f32; 3],
    /// Counts at and above which a reading is saturated, above those of the white. INFINITY if there are none.
    pub saturation: f32,
    /// One of glimpse_footprint.
    pub footprint: i32,
    /// Directions at which the white was read. Unused with GLIMPSE_FOOTPRINT_ANY.
    pub reference: glimpse_directions,
}

/// Mean and variance of repeated readings. All fields of a new one are 0; glimpse_repeated_add() adds to it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct glimpse_repeated {
    /// Number of readings.
    pub count: u32,
    /// Not 0 if a reading was saturated: the mean is then too low.
    pub saturated: u8,
    /// The mean.
    pub mean: [f32; 3],
    /// Sums of squared distances from the mean.
    pub squares: [f32; 3],
    /// The unbiased variance of a reading; NAN after the first reading. The variance of the mean is this
    /// divided by count.
    pub variance: [f32; 3],
}

/// Options of a driver. glimpse_config_default() returns the defaults.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct glimpse_config {
    /// One of glimpse_host.
    pub host: i32,
    /// Not 0 if `machine` is set. The driver skips samples out of reach if the recipe tolerates missing
    /// readings; else the scan fails before any move. If 0, the driver assumes that all samples are within
    /// reach.
    pub has_machine: u8,
    /// Number of invalid readings of a sample after which the driver skips it, or fails if the recipe needs
    /// every reading. 0 means 1.
    pub attempts: u8,
    /// The measuring machine: its reach, and the axes that it lacks.
    pub machine: glimpse_machine,
    /// Seed of the sequence numbers on the link. It must differ from the seeds of all earlier drivers of this
    /// device: the result of glimpse_store_count_boot(), a random number, or the value of a free-running timer.
    pub sequence_seed: u32,
    /// Units of the fit per glimpse_driver_poll(). 0 means 1.
    pub steps_per_poll: u32,
    /// Interval of retransmissions of a request without a reply, in ms.
    pub retransmit_interval_ms: u32,
    /// Timeout of a reply, in ms. After it, the scan fails with a host that measures, and continues alone with
    /// one that listens. A greeting to a host that measures has no timeout.
    pub reply_timeout_ms: u32,
    /// Timeout of a reading by the host, in ms; includes the motion of its arms.
    pub measure_timeout_ms: u32,
    /// The largest glimpse_residual.dark of a plausible result. 0: not limited, and the lamp is never switched
    /// off.
    pub max_dark: f32,
    /// The largest glimpse_residual.drift of a plausible result. 0: not limited, and no sample is read again.
    pub max_drift: f32,
    /// The largest share of saturated readings of a plausible result. 0: not limited.
    pub max_saturated: f32,
    /// Loss at which a scan stops before all samples are read; 0 for none. After each reading, the driver
    /// fits the readings that it has. If glimpse_fitted.loss_bound is at most this loss, it skips the
    /// pending samples, and this fit is the result. Each fit takes as many units as one of all readings. The
    /// bound holds only for the first samples in the recipe's order, so the driver reads all samples if one was
    /// skipped, out of reach, saturated, or read out of order. It has no effect with recipes that do not bound
    /// the loss of such fits.
    pub target_loss: f32,
}

/// The purpose of a reading.
#[repr(i32)]
#[allow(dead_code)] // only in the header
pub enum glimpse_purpose {
    /// A reading for the fit.
    Sample = 0,
    /// A reading with the lamp off: 0, but for room light and noise.
    Dark = 1,
    /// The first sample again: the same reading, unless lamp, room light or axes have drifted.
    Again = 2,
}

/// Kinds of glimpse_action. Ignore unknown kinds.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum glimpse_action_kind {
    /// Sleep until a byte arrives or can be sent, or glimpse_driver_poll_delay() has passed.
    Wait = 0,
    /// Poll again soon.
    Continue = 1,
    /// Move the arms to `directions`, read the sensor, then call glimpse_driver_record() with `index`. If only
    /// this sample cannot be read, call glimpse_driver_skip(). If arms or sensor failed, call
    /// glimpse_driver_fail(). The driver repeats this action until one of these calls.
    ///
    /// Switch the lamp off if `purpose` is GLIMPSE_PURPOSE_DARK. If it is GLIMPSE_PURPOSE_SAMPLE, the firmware
    /// may read any other pending sample instead, such as that of glimpse_machine_nearest().
    Measure = 2,
    /// Save `reading` of the sample `index` in memory that survives a reset, or without `has_reading` that it
    /// was skipped: glimpse_store_save().
    Save = 3,
    /// Delete all saved readings: glimpse_store_clear(). If this fails, try again before the next scan: a
    /// reset would restore them.
    Forget = 4,
    /// The fit is complete, with `residual`. It may be implausible: check residual.implausible first.
    /// glimpse_driver_scan() has the fitted material until the next scan.
    ///
    /// The driver then sends the result to the host, and returns GLIMPSE_ACTION_KIND_FORGET when the host has
    /// accepted it. With GLIMPSE_HOST_MEASURES the next scan begins afterwards. Otherwise call
    /// glimpse_driver_restart().
    Finished = 5,
    /// The scan has failed because of `failure`, or its result was refused. The readings are kept, and
    /// nothing moves until glimpse_driver_resume() or glimpse_driver_restart().
    Failed = 6,
}

/// The next action of the firmware. Fields that its kind does not use are 0.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct glimpse_action {
    /// The kind.
    pub kind: glimpse_action_kind,
    /// Reason of a failure.
    pub failure: glimpse_status,
    /// Purpose of a reading: one of glimpse_purpose.
    pub purpose: i32,
    /// Directions of light and sensor.
    pub directions: glimpse_directions,
    /// The reading to save.
    pub reading: glimpse_reading,
    /// Quality of the fit.
    pub residual: glimpse_residual,
    /// Index of a sample.
    pub index: u16,
    /// 0 if the sample was skipped: save the skip.
    pub has_reading: u8,
}

/// Converts structs with equal fields in both directions. The fields after `;` are flags, which C stores in bytes.
macro_rules! convert {
    ($($c:ty = $core:ty { $($field:ident),* $(; $($flag:ident),+)? })+) => {$(
        impl From<$core> for $c {
            fn from(from: $core) -> Self {
                Self { $($field: from.$field.into(),)* $($($flag: u8::from(from.$flag)),+)? }
            }
        }

        impl From<$c> for $core {
            fn from(from: $c) -> Self {
                Self { $($field: from.$field.into(),)* $($($flag: from.$flag != 0),+)? }
            }
        }
    )+};
}

convert! {
    glimpse_directions = Directions<f32> { incoming, outgoing }
    glimpse_reading = Reading { brdf; saturated }
    glimpse_recorded = Recorded {; replaced, clamped }
    glimpse_progress = Progress { done, total }
    glimpse_move = Move { index, arms, seconds }
    glimpse_limits = Limits { max_theta_i, max_theta_o, min_separation; in_plane }
    glimpse_arms = Arms { theta_i, phi_i, theta_o, phi_o }
    glimpse_machine = Machine { speeds, fixed, limits; isotropic, through_normal }
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
            implausible: residual.implausible.map_or(0, |code| code.number().into()),
            dark: residual.evidence.dark.unwrap_or(f32::NAN),
            drift: residual.evidence.drift.unwrap_or(f32::NAN),
            restored: residual.evidence.restored,
        }
    }
}

impl<K: ScanModel> From<Fitted<'_, K>> for glimpse_fitted {
    fn from(fitted: Fitted<'_, K>) -> Self {
        Self {
            residual: fitted.residual().into(),
            predicted_loss: fitted.predicted_loss().unwrap_or(f32::NAN),
            loss_bound: fitted.loss_bound().unwrap_or(f32::NAN),
            unlike_training: match fitted.is_unlike_training() {
                Some(false) => glimpse_answer::No,
                Some(true) => glimpse_answer::Yes,
                None => glimpse_answer::Unknown,
            },
        }
    }
}
