//! Cook-Torrance, a step from where 8 samples are completed to.

#![no_std]
#![no_main]

use glimpse_core::model::CookTorrance;
use glimpse_fits::SAMPLES;
use glimpse_fits::recipes::completed::COOK_TORRANCE;

glimpse_fits::fit!(CookTorrance, SAMPLES, COOK_TORRANCE);
