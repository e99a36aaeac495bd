//! The tests of the whole crate, in one program, because each program would compile the crate's generic code again.

mod basis;
mod blocks;
mod checksum;
mod completion;
mod documents;
mod driver;
#[cfg(feature = "libm")] // f64 is a scalar with libm only
mod finite_differences;
mod fitted;
mod geometry;
mod gonio;
#[cfg(feature = "libm")] // f64 is a scalar with libm only
mod gradients;
#[cfg(feature = "libm")]
// f64 is a scalar with libm only, and the solve has no elementary functions
mod linear;
mod link;
mod mapping;
mod math;
mod random;
mod recipe;
mod recipe_document;
mod recipe_sections;
mod recipes;
mod scan;
mod scanning;
