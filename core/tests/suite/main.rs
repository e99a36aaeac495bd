//! All tests of the crate in one program, so that the crate's generic code is compiled once.
//!
//! Modules that compute in f64 require the feature `libm`: f64 implements `Scalar` only with it.

/// A number with libm, and with micromath.
macro_rules! by_math {
    ($libm:expr, $micromath:expr) => {
        if cfg!(feature = "micromath") {
            $micromath
        } else {
            $libm
        }
    };
}

mod basis;
mod documents;
mod driver;
mod estimator;
mod file;
mod forged;
mod geometry;
mod gonio;
#[cfg(feature = "libm")]
mod gradients;
mod link;
mod mapping;
mod math;
mod missing;
#[cfg(feature = "libm")]
mod net_adjoint;
mod random;
mod recipe;
mod recipe_document;
mod recipes;
mod reference;
mod ridge;
mod scan;
mod scanning;
mod store;
