//! Nothing: see `tests/board.rs`.
#![no_std]
