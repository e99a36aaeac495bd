#![doc = include_str!("../README.md")]
#![no_std]
#![forbid(unsafe_code)]

pub mod angles;
pub mod fit;
pub mod linear;
pub mod link;
pub mod loss;
pub mod math;
pub mod model;
pub mod recipe;
pub mod scalar;
pub mod scan;
