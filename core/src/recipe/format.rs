//! The numbers of the format: its beginning, its version, and how much may be in a recipe.

/// The first bytes of every recipe.
pub const MAGIC: [u8; 4] = *b"GLMP";
/// The format version that this crate writes, and the only one that it reads.
pub const VERSION: u16 = 3;
/// Bytes before the body.
pub const HEADER_BYTES: usize = 14;
/// The largest number of samples in a pattern.
pub const MAX_SAMPLES: usize = 4096;
/// The largest number of inner steps.
pub const MAX_INNER_STEPS: u16 = 10_000;
/// The largest number of components of a ridge solve.
pub const MAX_COMPONENTS: usize = 1024;
/// The largest angle of a pattern, in radians, either sign. Sines and cosines of far larger ones would not be
/// those of a unit vector.
pub(super) const MAX_ANGLE: f32 = 1e3;

// The numbers of a ridge problem lie within these, a hundred times as far out as those of recipes
// that were trained. The largest entry of either of its systems is then 1e17 (1024 components of
// 1e4, squared, over 1e-6), whose square still fits f32.

/// The largest entry of a basis, either sign.
pub const MAX_BASIS: f32 = 1e4;
/// The largest mapped mean, either sign: e to the power of 100 is no f32 any more.
pub const MAX_MEAN: f32 = 100.0;
/// The largest weight of a prediction, either sign.
pub const MAX_PREDICTION: f32 = 1e4;
/// The largest median BRDF, sr^-1.
pub const MAX_MEDIAN: f32 = 1e6;
/// The largest product of two cosines, with room for rounding.
pub const MAX_WEIGHT: f32 = 1.001;
/// The smallest precision.
pub const MIN_PRECISION: f32 = 1e-6;
/// The largest precision.
pub const MAX_PRECISION: f32 = 1e8;
