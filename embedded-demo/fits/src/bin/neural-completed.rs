//! Neural, a step from where 8 samples are completed to.

#![no_std]
#![no_main]

use glimpse_core::model::Neural;
use glimpse_fits::SAMPLES;
use glimpse_fits::recipes::completed::NEURAL;

glimpse_fits::fit!(Neural, SAMPLES, NEURAL);
