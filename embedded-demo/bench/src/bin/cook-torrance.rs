//! Cook-Torrance, 20 steps on 8 samples.

#![no_std]
#![no_main]

use glimpse_bench::recipes::COOK_TORRANCE;
use glimpse_core::model::CookTorrance;

glimpse_bench::fit!(CookTorrance, COOK_TORRANCE);
