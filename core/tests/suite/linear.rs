//! The ridge solve agrees with an independent one in f64, in both of its forms and on every scalar,
//! and its adjoint with finite differences.

mod adjoint;
mod case;
mod errors;
mod solve;
