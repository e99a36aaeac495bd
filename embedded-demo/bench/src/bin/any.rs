//! The model that the recipe names at run time: Neural, 20 steps on 8 samples.

#![no_std]
#![no_main]

glimpse_bench::fit!(AnyModel, NEURAL);
