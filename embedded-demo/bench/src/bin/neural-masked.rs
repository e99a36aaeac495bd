//! Neural, a step from where 16 samples are completed to; any of them might be missing.

#![no_std]
#![no_main]

use glimpse_bench::recipes::masked::NEURAL;
use glimpse_core::model::Neural;

glimpse_bench::fit!(Neural, NEURAL);
