//! Cook-Torrance, 8 readings completed, then one step.

#![no_std]
#![no_main]

use glimpse_bench::recipes::completed::COOK_TORRANCE;
use glimpse_core::model::CookTorrance;

glimpse_bench::fit!(CookTorrance, COOK_TORRANCE);
