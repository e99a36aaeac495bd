//! The ridge solve agrees with an independent one in f64, in both of its forms and on every scalar,
//! and its adjoint with finite differences.

// f64 is a scalar with libm only. The solve has no elementary functions: the others say no more.
#![cfg(feature = "libm")]

mod adjoint;
mod case;
mod refusals;
mod solve;
