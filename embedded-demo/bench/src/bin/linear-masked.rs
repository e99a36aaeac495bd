//! Linear, 16 readings completed to 24 components, with a recipe that tolerates missing ones.

#![no_std]
#![no_main]

glimpse_bench::fit!(Linear, MASKED_LINEAR);
