//! The driver leads a scan to its end, whatever the host and the line do, and hangs nowhere.

mod bench;
mod failures;
mod full_scans;
mod invalid_readings;
mod missing;
mod noisy_line;
mod reach;
mod recipe_update;
mod reset;
mod stale_replies;
mod timeouts;
