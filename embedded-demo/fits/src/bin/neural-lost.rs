//! Neural, a step from where 16 samples are completed to, of which every third reading is lost.

#![no_std]
#![no_main]

use glimpse_core::model::Neural;
use glimpse_fits::MASKED_SAMPLES;
use glimpse_fits::recipes::masked::NEURAL;

glimpse_fits::fit!(Neural, MASKED_SAMPLES, NEURAL, true);
