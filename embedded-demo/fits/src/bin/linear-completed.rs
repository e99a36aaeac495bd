//! Linear, 8 samples completed to 24 components.

#![no_std]
#![no_main]

use glimpse_fits::recipes::completed::LINEAR;
use glimpse_fits::{CompletedLinear, SAMPLES};

glimpse_fits::fit!(CompletedLinear, SAMPLES, LINEAR);
