//! Phong, a step from where 8 samples are completed to.

#![no_std]
#![no_main]

use glimpse_core::model::Phong;
use glimpse_fits::SAMPLES;
use glimpse_fits::recipes::completed::PHONG;

glimpse_fits::fit!(Phong, SAMPLES, PHONG);
