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
/// The largest number of components of a ridge solve.
pub const MAX_COMPONENTS: usize = 1024;
/// The largest absolute angle of a pattern, in radians. Sines and cosines of far larger angles would not form a unit
/// vector.
pub(super) const MAX_ANGLE: f32 = 1e3;

// Bounds of the numbers of a ridge problem, a hundred times as wide as the numbers of trained recipes. Then the largest
// entry of both forms of its system is 1e17 (1024 components of 1e4, squared, over 1e-6). Its square still fits f32.

/// The largest absolute entry of a basis.
pub const MAX_BASIS: f32 = 1e4;
/// The largest absolute mapped mean: e to the power of 100 exceeds f32.
pub const MAX_MEAN: f32 = 100.0;
/// The largest absolute weight of a prediction.
pub const MAX_PREDICTION: f32 = 1e4;
/// The largest median BRDF, sr^-1, not times the cosine.
pub const MAX_MEDIAN: f32 = 1e6;
/// The largest product of two cosines, with a margin for rounding.
pub const MAX_WEIGHT: f32 = 1.001;
/// The smallest precision of a coefficient.
pub const MIN_PRECISION: f32 = 1e-6;
/// The largest precision of a coefficient.
pub const MAX_PRECISION: f32 = 1e8;
