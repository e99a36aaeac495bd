//! Phong, 20 steps on 8 samples.

#![no_std]
#![no_main]

use glimpse_bench::recipes::PHONG;
use glimpse_core::model::Phong;

glimpse_bench::fit!(Phong, PHONG);
