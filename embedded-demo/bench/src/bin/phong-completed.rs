//! Phong, a step from where 8 samples are completed to.

#![no_std]
#![no_main]

use glimpse_bench::recipes::completed::PHONG;
use glimpse_core::model::Phong;

glimpse_bench::fit!(Phong, PHONG);
