//! Neural, 16 samples with every third reading missing, completed, then one step.

#![no_std]
#![no_main]

glimpse_bench::fit!(Neural, MASKED_NEURAL, true, None);
