//! Cook-Torrance, 8 readings completed, then one step.

#![no_std]
#![no_main]

glimpse_bench::fit!(CookTorrance, COMPLETED_COOK_TORRANCE);
