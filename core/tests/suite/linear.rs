//! The ridge solve matches an independent solve in f64, in both of its forms and for every scalar. Its adjoint matches
//! finite differences.

mod adjoint;
mod case;
mod errors;
mod solve;
