//! A scan takes readings in any order, refuses what cannot be read, and ends in numbers or in an
//! error that says why.

mod counts;
mod fits;
mod linear;
mod memory;
mod order;
mod readings;
mod saved;
