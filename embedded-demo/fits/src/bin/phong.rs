//! Phong, 20 steps on 8 samples.

#![no_std]
#![no_main]

use glimpse_core::model::Phong;
use glimpse_fits::SAMPLES;
use glimpse_fits::recipes::PHONG;

glimpse_fits::fit!(Phong, SAMPLES, PHONG);
