//! Neural, 8 readings completed, then one step.

#![no_std]
#![no_main]

glimpse_bench::fit!(Neural, COMPLETED_NEURAL);
