//! `glimpse-core` for firmware in C: scans by a recipe, fits, and returns the fitted BRDF.
//!
//! Every function is declared in `include/glimpse.h` with its contract; README.md is the introduction. The functions
//! here check the arguments, call `glimpse_core`, and turn its errors into a
//! [`glimpse_status`](status::glimpse_status). It has no global state, does not allocate, and never panics.
//!
//! # Aliasing
//! A handle points to a `Scan` or a `Driver` at the front of the caller's memory. The scan borrows the rest of that
//! memory. Every function makes one reference to the handle for the time of its call. Results are written through raw
//! pointers, so they may even overlap each other.

#![no_std]
#![cfg_attr(
    not(test),
    deny(
        clippy::undocumented_unsafe_blocks,
        clippy::panic,
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::indexing_slicing,
        clippy::arithmetic_side_effects,
        clippy::unreachable
    )
)]
#![allow(non_camel_case_types)] // C's names, so that a search finds both

#[cfg(not(target_os = "none"))]
extern crate std; // for its panic handler: tests, and C on a host

mod configuration;
mod driver;
mod fit;
mod place;
mod recipe;
mod scan;
mod status;
#[cfg(test)]
mod tests;
mod types;

#[cfg(target_os = "none")]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    #[cfg(feature = "prove-no-panic")]
    {
        unsafe extern "C" {
            fn glimpse_can_panic() -> !;
        }
        // SAFETY: it is undefined, so a program that reaches this cannot be linked.
        unsafe { glimpse_can_panic() }
    }
    #[cfg(not(feature = "prove-no-panic"))]
    loop {
        core::hint::spin_loop();
    }
}

/// A function that the proof must reject.
#[cfg(feature = "can-panic")]
#[unsafe(no_mangle)]
#[allow(clippy::indexing_slicing)]
pub extern "C" fn glimpse_any_of_three(index: usize) -> u8 {
    [7, 8, 9][index]
}
