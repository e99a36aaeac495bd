//! What C and the library hand to each other.

use glimpse_core::geometry::{ArmAngles, Directions, Spherical};
use glimpse_core::link::BYTES_PER_FRAME;
use glimpse_core::model::ModelKind;
use glimpse_core::scan::{Reading, Residual};

/// A pair of directions of unit length, pointing away from the surface; z is its normal.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct glimpse_directions {
    /// Towards the light: x, y, z.
    pub incoming: [f32; 3],
    /// Towards the sensor: x, y, z.
    pub outgoing: [f32; 3],
}

/// Where both arms stand, as spherical angles in radians: theta from the normal, phi about it, from x
/// towards y.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct glimpse_arms {
    /// The light's: 0 to pi/2.
    pub theta_i: f32,
    /// The light's; any turn. 0 along the normal.
    pub phi_i: f32,
    /// The sensor's: 0 to pi/2.
    pub theta_o: f32,
    /// The sensor's; any turn. 0 along the normal.
    pub phi_o: f32,
}

/// Where a sample of the recipe's pattern is.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct glimpse_sample {
    /// Index in the pattern, from 0.
    pub index: u16,
    /// Where the light and the sensor have to be. The half vector lies in the xz plane; an isotropic
    /// material does not notice if both azimuths are turned together.
    pub directions: glimpse_directions,
    /// The same as spherical angles.
    pub arms: glimpse_arms,
    /// The same in Rusinkiewicz angles, radians. Between the normal and the half vector: 0 to pi/2.
    pub theta_h: f32,
    /// Between the half vector and the light: 0 to pi/2.
    pub theta_d: f32,
    /// The light's azimuth about the half vector.
    pub phi_d: f32,
}

/// What the sensor saw.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct glimpse_reading {
    /// The BRDF, linear red, green and blue, in sr^-1: not times the cosine, not counts, not a
    /// reflectance factor. Noise may bring it slightly below 0, to -1 at most. A sensor with one
    /// channel gives it three times.
    pub brdf: [f32; 3],
    /// Not 0 if the sensor was saturated, so that the true value is larger.
    pub saturated: u8,
}

/// What became of a reading.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct glimpse_recorded {
    /// 1 if it took the place of an earlier one, else 0.
    pub replaced: u8,
    /// 1 if a channel was so far below 0 that the fit brings it up to what the loss can take, else 0.
    pub clamped: u8,
}

/// How far a fit is, in units of work: gradients of one sample, for Linear rows and channels of
/// its solve, or parts of a completion of the readings.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct glimpse_progress {
    /// Units done.
    pub done: u32,
    /// Units that the whole fit takes: it is complete when done is total.
    pub total: u32,
}

/// How well a fit explains its readings. It cannot see a wrong convention: readings that are times
/// the cosine are fitted as well as others.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct glimpse_residual {
    /// The mean cosine-weighted logarithmic error over the readings.
    pub mean: f32,
    /// The largest error of a reading.
    pub worst: f32,
    /// Its index.
    pub worst_index: u16,
    /// How many readings were saturated.
    pub saturated: u16,
    /// How many readings were the one before them, bit for bit. A real sensor is too noisy for that;
    /// if all but the first were, it is stuck.
    pub repeated: u16,
    /// How many readings were too far below 0, and were brought up.
    pub clamped: u16,
}

/// The reflectance models.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum glimpse_model {
    /// Phong: 7 values.
    Phong = 0,
    /// A network: 675 values.
    Neural = 1,
    /// Cook-Torrance: 8 values.
    CookTorrance = 2,
    /// Principal components: 3 m values, m for red, m for green, m for blue.
    Linear = 3,
}

/// What is in a recipe.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct glimpse_recipe {
    /// The model that it fits.
    pub model: glimpse_model,
    /// n, how many samples its pattern has.
    pub samples: u16,
    /// How many values a fit by it has.
    pub values: u16,
    /// The CRC-32 in its header, which names it: readings that outlast a reset belong to one recipe.
    pub checksum: u32,
    /// The loss to expect on a material that training never saw; NaN if the recipe states none.
    pub expected_loss: f32,
}

/// A reading that outlasted a reset.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct glimpse_kept {
    /// Index of the sample in the recipe's pattern.
    pub index: u16,
    /// What the sensor saw.
    pub reading: glimpse_reading,
}

/// Who is at the other end of the line, and who moves the arms.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum glimpse_host {
    /// A host moves the arms and reads the sensor; the device asks it to.
    Measures = 0,
    /// The device moves the arms; a host hears how far it is, and the result.
    Listens = 1,
    /// The device moves the arms, and nobody is there.
    Absent = 2,
}

/// How a driver behaves. glimpse_config_default() has what serves most.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct glimpse_config {
    /// One of glimpse_host.
    pub host: i32,
    /// Units of the fit in one glimpse_driver_poll().
    pub slice: u32,
    /// A request that has no reply is sent again after so many milliseconds.
    pub repeat: u32,
    /// A host that does not reply for so many milliseconds has fallen silent.
    pub patience: u32,
    /// The same while its motors move.
    pub measuring_patience: u32,
    /// The device can store recipes of at most so many bytes; 0 if it cannot.
    pub recipe_bytes: u32,
    /// How often a reading is taken that cannot be one before the scan is given up.
    pub attempts: u8,
}

/// What a firmware has to do next.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum glimpse_action_kind {
    /// Nothing, until a byte comes, one can be sent, or `milliseconds` have passed (UINT32_MAX: until
    /// glimpse_driver_restart()).
    Wait = 0,
    /// Nothing but to call again soon.
    Continue = 1,
    /// Move the arms to `directions`, read the sensor, then glimpse_driver_record() with `index`, or
    /// glimpse_driver_fail(). Any other pending sample will do too. It is said again until then.
    Measure = 2,
    /// Keep `index` and `reading` where a reset leaves them.
    Save = 3,
    /// Forget all readings that were kept.
    Forget = 4,
    /// Write `byte_count` of `bytes` to `offset` of a new recipe, where the present one is not. At 0
    /// another recipe begins.
    Store = 5,
    /// The new recipe of `offset` bytes is stored, and should have `checksum`. If
    /// glimpse_recipe_describe() accepts it, begin a driver by it; else glimpse_driver_reject().
    Install = 6,
    /// The scan is done, with `residual`; until the next poll glimpse_driver_scan() has the material.
    Finished = 7,
    /// The scan is given up, because of `failure`. It begins anew by itself where a host measures or
    /// listens, else by glimpse_driver_restart().
    Failed = 8,
}

/// What a firmware has to do next. What its kind does not name is 0.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct glimpse_action {
    /// What is to be done.
    pub kind: glimpse_action_kind,
    /// Why a scan is given up.
    pub failure: crate::status::glimpse_status,
    /// How long nothing is to be done.
    pub milliseconds: u32,
    /// Where in a new recipe bytes belong; or its length.
    pub offset: u32,
    /// The checksum that a new recipe should have in its header.
    pub checksum: u32,
    /// Where to measure.
    pub directions: glimpse_directions,
    /// What to keep.
    pub reading: glimpse_reading,
    /// How well the fit explains its readings.
    pub residual: glimpse_residual,
    /// Index of a sample.
    pub index: u16,
    /// How many bytes there are to store.
    pub byte_count: u16,
    /// What to store.
    pub bytes: [u8; 60],
}

const _: () = assert!(BYTES_PER_FRAME == 60); // the header's number

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

/// The directions of two arms. All angles will do; what is below the horizon has no BRDF.
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
        }
    }
}

impl From<ModelKind> for glimpse_model {
    fn from(model: ModelKind) -> Self {
        match model {
            ModelKind::Phong => Self::Phong,
            ModelKind::Neural => Self::Neural,
            ModelKind::CookTorrance => Self::CookTorrance,
            ModelKind::Linear => Self::Linear,
        }
    }
}
