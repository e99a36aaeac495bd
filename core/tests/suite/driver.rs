//! The driver completes or fails each scan, for any behavior of host and line, and never hangs.

mod bench;
mod defects;
mod histories;
mod scans;
mod table;
