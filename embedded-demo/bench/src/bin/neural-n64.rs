//! Neural, 64 readings completed, then one step.

#![no_std]
#![no_main]

use glimpse_bench::recipes::large::NEURAL_64;
use glimpse_core::model::Neural;

glimpse_bench::fit!(Neural, NEURAL_64);
