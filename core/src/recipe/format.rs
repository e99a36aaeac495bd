//! Constants of the format: magic, version and limits.

/// The first bytes of every recipe.
pub const MAGIC: [u8; 4] = *b"GLMP";
/// The only format version that this crate reads and writes.
pub const VERSION: u16 = 3;
/// Number of bytes before the body.
pub const HEADER_BYTES: usize = 14;
/// The largest number of samples in a pattern.
pub const MAX_SAMPLES: usize = 4096;
/// The largest number of inner steps.
pub const MAX_INNER_STEPS: u16 = 10_000;
/// The largest number of Gauss-Newton steps.
pub const MAX_GAUSS_NEWTON_STEPS: u16 = 100;
/// The largest number of components of a ridge solve.
pub const MAX_COMPONENTS: usize = 1024;
/// The largest absolute angle of a pattern, in radians. For far larger angles, rounding errors of sine and cosine would
/// exceed the tolerance of unit vectors.
pub(super) const MAX_ANGLE: f32 = 1e3;

// Bounds of the numbers of a ridge problem, about a hundred times as wide as those of trained recipes. Entries of its
// system, in either form, are at most 1024 components * (1e4)^2 / 1e-6 = 1e17. The square of 1e17 still fits f32.

/// The largest absolute entry of a basis.
pub const MAX_BASIS: f32 = 1e4;
/// The largest absolute mean, a mapped value. Unmapping takes its exponential, and that of 100 already overflows f32.
pub const MAX_MEAN: f32 = 100.0;
/// The largest absolute weight in the prediction of the loss.
pub const MAX_PREDICTION: f32 = 1e4;
/// The largest absolute exponent in the prediction of the loss.
pub const MAX_EXPONENT: f32 = 100.0;
/// The largest median of the BRDF in sr^-1, not times the cosine.
pub const MAX_MEDIAN: f32 = 1e6;
/// The largest weight of a sample, cos(theta_i) cos(theta_o), with a margin for rounding.
pub const MAX_WEIGHT: f32 = 1.001;
/// The largest number of virtual readings.
pub const MAX_VIRTUAL_READINGS: usize = 1024;
/// The largest sum of the weights of the pattern's readings in Gauss-Newton steps.
pub const MAX_READING_WEIGHT: f32 = 1e4;
/// The smallest precision of a coefficient.
pub const MIN_PRECISION: f32 = 1e-6;
/// The largest precision of a coefficient.
pub const MAX_PRECISION: f32 = 1e8;
