//! Linear, 8 readings completed to 24 components.

#![no_std]
#![no_main]

glimpse_bench::fit!(Linear, COMPLETED_LINEAR);
