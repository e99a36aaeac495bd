//! Linear, 8 readings completed to 24 components, and the BRDF by their basis.

#![no_std]
#![no_main]

glimpse_bench::fit!(Linear, COMPLETED_LINEAR, false, Some(BASIS));
