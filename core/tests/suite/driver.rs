//! The driver leads a scan to its end, whatever the host and the line do, and hangs nowhere.

mod bad_line;
mod bench;
mod failures;
mod missing;
mod reach;
mod reset;
mod silence;
mod stray;
mod update;
mod whole;
mod wrong_readings;
