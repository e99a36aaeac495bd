//! The driver completes or fails each scan, for any behavior of host and line, and never hangs.

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
mod target_loss;
mod timeouts;
