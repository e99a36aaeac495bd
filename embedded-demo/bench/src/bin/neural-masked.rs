//! Neural, 16 readings completed, then one step, with a recipe that tolerates missing ones.

#![no_std]
#![no_main]

use glimpse_bench::recipes::masked::NEURAL;
use glimpse_core::model::Neural;

glimpse_bench::fit!(Neural, NEURAL);
