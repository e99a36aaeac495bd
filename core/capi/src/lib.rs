//! C API of `glimpse-core`: scans with a recipe, fits, and returns the fitted BRDF.
//!
//! `include/glimpse.h` declares every function with its contract; README.md is the introduction. The functions check
//! their arguments, call `glimpse_core`, and convert its errors to a [`glimpse_status`](status::glimpse_status). The
//! library has no global state, does not allocate, and never panics.
//!
//! # Aliasing
//! A handle points to a tag at the front of the caller's memory, followed by a `Scan` or a `Driver`. The scan borrows the
//! rest of that memory. Every function checks the tag, and creates one reference to the handle for the duration of its
//! call. The handle of a driver's scan is the driver's, whose tag lets a scan be read but not changed.

#![no_std]
#![allow(non_camel_case_types)] // the names of the C API

#[cfg(not(target_os = "none"))]
extern crate std; // panic handler for tests and for C on a host

mod driver;
mod fit;
mod handle;
mod machine;
mod pointer;
mod scan;
mod status;
mod store;
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

/// A function that can panic, which the no-panic proof must reject.
#[cfg(feature = "can-panic")]
#[unsafe(no_mangle)]
#[allow(clippy::indexing_slicing)]
pub extern "C" fn glimpse_any_of_three(index: usize) -> u8 {
    [7, 8, 9][index]
}
