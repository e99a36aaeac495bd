//! Neural, 16 samples with every third reading missing, completed, then one step.

#![no_std]
#![no_main]

use glimpse_bench::recipes::masked::NEURAL;
use glimpse_core::model::Neural;

glimpse_bench::fit!(Neural, NEURAL, true);
