//! Directions, angles, half and difference vectors against independent trigonometry.

// f64 is a scalar with libm only.
#[cfg(feature = "libm")]
mod half_difference;
mod refusals;
mod spherical;
mod turning;
