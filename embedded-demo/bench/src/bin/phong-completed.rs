//! Phong, 8 readings completed, then one step.

#![no_std]
#![no_main]

glimpse_bench::fit!(Phong, COMPLETED_PHONG);
