//! Linear, 5 components, 8 samples.

#![no_std]
#![no_main]

glimpse_bench::fit!(Linear, LINEAR);
