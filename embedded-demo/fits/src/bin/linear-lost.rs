//! Linear, 16 samples completed to 24 components, of which every third reading is lost.

#![no_std]
#![no_main]

use glimpse_fits::recipes::masked::LINEAR;
use glimpse_fits::{CompletedLinear, MASKED_SAMPLES};

glimpse_fits::fit!(CompletedLinear, MASKED_SAMPLES, LINEAR, true);
