//! Cook-Torrance, 20 steps on 8 samples.

#![no_std]
#![no_main]

use glimpse_core::model::CookTorrance;
use glimpse_fits::SAMPLES;
use glimpse_fits::recipes::COOK_TORRANCE;

glimpse_fits::fit!(CookTorrance, SAMPLES, COOK_TORRANCE);
