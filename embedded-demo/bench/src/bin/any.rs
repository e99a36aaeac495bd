//! The model that the recipe names, at run time.

#![no_std]
#![no_main]

use glimpse_bench::recipes::NEURAL;
use glimpse_core::fit::AnyModel;

glimpse_bench::fit!(AnyModel, NEURAL);
