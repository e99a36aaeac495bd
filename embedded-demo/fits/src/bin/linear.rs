//! Linear, 5 components, 8 samples.

#![no_std]
#![no_main]

use glimpse_fits::recipes::LINEAR;
use glimpse_fits::{Linear, SAMPLES};

glimpse_fits::fit!(Linear, SAMPLES, LINEAR);
