//! `glimpse-core` as WebAssembly for the page of `trainer render view`.
//!
//! An instance of the module represents one material: a scan with a recipe, whose readings the page can change and
//! fit again, or a table for display. The page allocates a buffer with [`allocate`], writes bytes or `f32` to it, calls
//! a function, and reads the result from a buffer. A fallible function returns 0 on success. After a failure,
//! [`message_address`] returns the address of an error message.
//!
//! This crate only computes the shading of a sphere; core computes fits, BRDFs and losses.

#![no_std]
#![cfg(target_arch = "wasm32")]

mod buffer;
mod error;
mod scene;
mod shading;
mod single_threaded;

use scene::Scene;
use single_threaded::SingleThreaded;

static SCENE: SingleThreaded<Scene> = SingleThreaded::new(Scene::new());

/// Allocates buffer `slot` with `bytes` bytes and returns its address. Returns null if the slot is invalid or memory is
/// exhausted.
///
/// The buffers are 0 the recipe, 1 Linear's compact basis, 2 a material's table, 3 the reference values of the loss
/// (for each direction theta_h, theta_d and phi_d in radians, and the BRDF there, red, green, blue), and 4 the numbers
/// that functions read and write.
///
/// [`load_recipe`] and [`load_table`] take ownership of buffers 0 to 2; the page must not write to them afterwards. The
/// others keep their content until they are allocated again.
#[unsafe(no_mangle)]
pub extern "C" fn allocate(slot: u32, bytes: usize) -> *mut u8 {
    SCENE.with(|scene| match scene.allocate(slot, bytes) {
        Some(buffer) => buffer.as_mut_ptr(),
        None => core::ptr::null_mut(),
    })
}

/// Returns the address of the last error message, in UTF-8.
#[unsafe(no_mangle)]
pub extern "C" fn message_address() -> *const u8 {
    SCENE.with(|scene| scene.message().as_ptr())
}

/// Returns the length of the last error message in bytes.
#[unsafe(no_mangle)]
pub extern "C" fn message_bytes() -> usize {
    SCENE.with(|scene| scene.message().len())
}

/// Begins a scan with the recipe in buffer 0, and for Linear the basis in buffer 1.
#[unsafe(no_mangle)]
pub extern "C" fn load_recipe() -> u32 {
    SCENE.with(|scene| scene.run(Scene::load_recipe))
}

/// Displays the table in buffer 2, a basis with the material's three channels as components.
#[unsafe(no_mangle)]
pub extern "C" fn load_table() -> u32 {
    SCENE.with(|scene| scene.run(Scene::load_table))
}

/// Returns the number of samples of the recipe; 0 for a table.
#[unsafe(no_mangle)]
pub extern "C" fn samples() -> usize {
    SCENE.with(|scene| scene.samples())
}

/// Fits the readings in buffer 4, in a complete fit as on the device. Each sample of the recipe has four numbers: red,
/// green, blue (the BRDF in sr^-1, not times the cosine), and 1 for a reading or 0 for a missing one.
#[unsafe(no_mangle)]
pub extern "C" fn fit() -> u32 {
    SCENE.with(|scene| scene.run(Scene::fit))
}

/// Writes the fitted values to buffer 4 and returns their number; 0 without a fit, or if the buffer is too small.
#[unsafe(no_mangle)]
pub extern "C" fn values() -> usize {
    SCENE.with(|scene| scene.values())
}

/// Returns the predicted loss of the fit; NaN if the recipe does not predict it.
#[unsafe(no_mangle)]
pub extern "C" fn predicted_loss() -> f32 {
    SCENE.with(|scene| {
        let loss = scene.fitted().and_then(|fitted| fitted.predicted_loss());
        loss.unwrap_or(f32::NAN)
    })
}

/// Returns the upper bound of the fit's loss, which holds for 90 % of materials; NaN if the recipe has none.
#[unsafe(no_mangle)]
pub extern "C" fn loss_bound() -> f32 {
    SCENE.with(|scene| {
        let bound = scene.fitted().and_then(|fitted| fitted.loss_bound());
        bound.unwrap_or(f32::NAN)
    })
}

/// Returns 1 if the readings are unlike those of all training materials; 0 if not, or if the recipe cannot tell.
#[unsafe(no_mangle)]
pub extern "C" fn is_unlike_training() -> u32 {
    SCENE.with(|scene| {
        let unlike = scene
            .fitted()
            .and_then(|fitted| fitted.is_unlike_training());
        u32::from(unlike.unwrap_or(false))
    })
}

/// Returns the mean cosine-weighted logarithmic error of the fit at its readings; NaN without a fit.
#[unsafe(no_mangle)]
pub extern "C" fn residual() -> f32 {
    SCENE.with(|scene| {
        let fitted = scene.fitted();
        fitted.map_or(f32::NAN, |fitted| fitted.residual().mean)
    })
}

/// Returns the paper's Loss against the reference values in buffer 3: the mean of |ln(1 + y c) - ln(1 + f c)|, c =
/// cos(theta_i). NaN without a fit or table, without reference values, or if the BRDF cannot be evaluated at one of them.
#[unsafe(no_mangle)]
pub extern "C" fn loss() -> f64 {
    SCENE.with(|scene| scene.loss())
}

/// Writes the BRDF at the recipe's samples to buffer 4, three numbers each, and returns the number of samples; 0
/// without a fit, or if the buffer is too small.
#[unsafe(no_mangle)]
pub extern "C" fn brdf_at_samples() -> usize {
    SCENE.with(|scene| scene.brdf_at_samples())
}

/// Writes the BRDF in the plane of incidence to buffer 4, three numbers for each of `steps` outgoing angles.
///
/// The angles are evenly spaced from -90 to 90 degrees, the outermost ones half a step above the horizon. `theta_i` is
/// the polar angle of the light in radians; a mirror peaks at the same positive angle. Returns `steps`, or 0 if the
/// buffer is too small.
#[unsafe(no_mangle)]
pub extern "C" fn lobe(theta_i: f32, steps: u32) -> u32 {
    SCENE.with(|scene| shading::lobe(scene, theta_i, steps))
}

/// Writes rows `first` to `end` (exclusive) of a picture of `size` x `size` pixels to buffer 4, three numbers per
/// pixel.
///
/// The picture shows a sphere that fills it, seen orthographically along -z with y up, under a distant light in the unit
/// direction x, y, z. A white Lambertian surface that faces the light has radiance 1. Pixels off the sphere repeat its
/// rim. Returns the number of pixels, or 0 if the buffer is too small.
#[unsafe(no_mangle)]
pub extern "C" fn shade(size: u32, first: u32, end: u32, x: f32, y: f32, z: f32) -> u32 {
    SCENE.with(|scene| shading::sphere(scene, size, first..end, [x, y, z]))
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    core::arch::wasm32::unreachable()
}
