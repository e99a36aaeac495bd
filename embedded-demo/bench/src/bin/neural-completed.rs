//! Neural, a step from where 8 samples are completed to.

#![no_std]
#![no_main]

use glimpse_bench::recipes::completed::NEURAL;
use glimpse_core::model::Neural;

glimpse_bench::fit!(Neural, NEURAL);
