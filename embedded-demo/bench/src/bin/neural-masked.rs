//! Neural, 16 readings completed, then one step, with a recipe that tolerates missing ones.

#![no_std]
#![no_main]

glimpse_bench::fit!(Neural, MASKED_NEURAL);
