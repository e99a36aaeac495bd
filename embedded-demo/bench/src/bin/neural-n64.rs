//! Neural, a step from where 64 samples are completed to.

#![no_std]
#![no_main]

use glimpse_bench::recipes::large::NEURAL_64;
use glimpse_core::model::Neural;

glimpse_bench::fit!(Neural, NEURAL_64);
