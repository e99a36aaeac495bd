//! Directions, angles, half and difference vectors, compared with independent trigonometry.

// f64 is a scalar with libm only.
mod arms;
mod errors;
#[cfg(feature = "libm")]
mod half_difference;
