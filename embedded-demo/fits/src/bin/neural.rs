//! Neural, 20 steps on 8 samples.

#![no_std]
#![no_main]

use glimpse_core::model::Neural;
use glimpse_fits::SAMPLES;
use glimpse_fits::recipes::NEURAL;

glimpse_fits::fit!(Neural, SAMPLES, NEURAL);
