//! Linear, 64 readings completed to 24 components.

#![no_std]
#![no_main]

glimpse_bench::fit!(Linear, LINEAR_64);
