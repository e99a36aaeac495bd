//! Cook-Torrance, a step from where 8 samples are completed to.

#![no_std]
#![no_main]

use glimpse_bench::recipes::completed::COOK_TORRANCE;
use glimpse_core::model::CookTorrance;

glimpse_bench::fit!(CookTorrance, COOK_TORRANCE);
