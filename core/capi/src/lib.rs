//! `glimpse-core` for firmware in C: scans by a recipe, fits, tells the fitted BRDF.
//!
//! Every function stands in `include/glimpse.h`, with its contract; README.md leads there. The
//! functions here do three things: they check what C hands over, call `glimpse_core`, and turn its
//! errors into a [`glimpse_status`](status::glimpse_status). There is no global state, no
//! allocation, and nothing panics.
//!
//! # Aliasing
//! A handle points at a `Scan` or a `Driver` in the caller's memory; what it works on lies behind it
//! in the same memory and is borrowed by it. Every function makes one reference to the former, for
//! the time of its call. Through results only raw pointers write, so they may even overlap each other.

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
#![allow(non_camel_case_types)] // C's names, so that the header can be searched for in here

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
        // SAFETY: it is nowhere, so nothing that reaches this can be linked.
        unsafe { glimpse_can_panic() }
    }
    #[cfg(not(feature = "prove-no-panic"))]
    loop {
        core::hint::spin_loop();
    }
}

/// What the proof must not let through.
#[cfg(feature = "can-panic")]
#[unsafe(no_mangle)]
#[allow(clippy::indexing_slicing)]
pub extern "C" fn glimpse_any_of_three(index: usize) -> u8 {
    [7, 8, 9][index]
}
