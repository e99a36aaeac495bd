//! Tests of glimpse-scanner on a host, with simulated arms and flash, in virtual time.

mod motion;
mod parts;
mod route;
mod scans;
mod store;
