//! Scans over stops, restarts and faults of the line.

use std::cell::Cell;
use std::f32::consts::TAU;

use glimpse_core::driver::Host;
use glimpse_core::error::ErrorCode;
use glimpse_desk::optics::{SensorFault, black, metal, plastic, tile};
use glimpse_desk::{Desk, Line, separation};
use glimpse_scanner::Command;

use crate::faults::{N8, N16};
