//! Neural, 8 readings completed, then one step.

#![no_std]
#![no_main]

use glimpse_bench::recipes::completed::NEURAL;
use glimpse_core::model::Neural;

glimpse_bench::fit!(Neural, NEURAL);
