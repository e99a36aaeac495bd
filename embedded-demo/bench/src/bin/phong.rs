//! Phong, 20 steps on 8 samples.

#![no_std]
#![no_main]

glimpse_bench::fit!(Phong, PHONG);
