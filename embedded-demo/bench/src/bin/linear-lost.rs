//! Linear, 16 samples with every third reading missing, completed to 24 components.

#![no_std]
#![no_main]

glimpse_bench::fit!(Linear, MASKED_LINEAR, true, None);
