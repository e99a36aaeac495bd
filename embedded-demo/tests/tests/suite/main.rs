//! Tests of glimpse-scanner on a host, in virtual time.

mod faults;
mod motion;
mod panel;
mod route;
mod scans;
