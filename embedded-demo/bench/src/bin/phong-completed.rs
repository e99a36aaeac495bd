//! Phong, 8 readings completed, then one step.

#![no_std]
#![no_main]

use glimpse_bench::recipes::completed::PHONG;
use glimpse_core::model::Phong;

glimpse_bench::fit!(Phong, PHONG);
