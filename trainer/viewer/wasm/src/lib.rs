//! What a page of `trainer render view` computes with: `glimpse-core` as WebAssembly.
//!
//! One instance of the module stands for one material: a scan by a recipe, whose readings the page
//! may change and fit again, or a table of a material that is only looked at. Everything is numbers:
//! the page asks for a [`room`], puts bytes or `f32` there, calls a function, and reads what it left.
//! A function that can fail returns 0 if it did not; else [`message_at`] says why, in a sentence.
//!
//! There is no formula here but that of light on a sphere: the fit, the BRDF and the loss are core's.

#![no_std]
#![cfg(target_arch = "wasm32")]

mod error;
mod room;
mod scene;
mod shading;
mod single;

use scene::Scene;
use single::Single;

static SCENE: Single<Scene> = Single::new(Scene::new());

/// Room for so many bytes: 0 the recipe, 1 Linear's compact basis, 2 a material's table, 3 what the loss
/// is judged by (for each direction theta_h, theta_d and phi_d in radians, and the BRDF there, red,
/// green, blue), 4 numbers that functions take and leave. Null if there is no such room, or no memory.
///
/// Rooms 0 to 2 are given up once [`begin`] or [`look_at_table`] has read them: what lies there has to
/// stay as it is. The others keep what they hold until they are asked for anew.
#[unsafe(no_mangle)]
pub extern "C" fn room(slot: u32, bytes: usize) -> *mut u8 {
    SCENE.with(|scene| match scene.room(slot, bytes) {
        Some(room) => room.as_mut_ptr(),
        None => core::ptr::null_mut(),
    })
}

/// Where the sentence is that says what went wrong last, in UTF-8.
#[unsafe(no_mangle)]
pub extern "C" fn message_at() -> *const u8 {
    SCENE.with(|scene| scene.message().as_ptr())
}

/// How many bytes it has.
#[unsafe(no_mangle)]
pub extern "C" fn message_bytes() -> usize {
    SCENE.with(|scene| scene.message().len())
}

/// Begins a scan by the recipe in room 0; of Linear with the basis in room 1.
#[unsafe(no_mangle)]
pub extern "C" fn begin() -> u32 {
    SCENE.with(|scene| {
        let outcome = scene.begin();
        scene.told(outcome)
    })
}

/// Stands for the material whose table is in room 2, a compact basis whose three components are its
/// channels.
#[unsafe(no_mangle)]
pub extern "C" fn look_at_table() -> u32 {
    SCENE.with(|scene| {
        let outcome = scene.look_at_table();
        scene.told(outcome)
    })
}

/// How many samples the recipe has; 0 of a table.
#[unsafe(no_mangle)]
pub extern "C" fn samples() -> usize {
    SCENE.with(|scene| scene.samples())
}

/// Fits the readings in room 4, for each sample of the recipe red, green, blue (the BRDF in sr^-1, not
/// times the cosine), and 0 if it is missing, else 1: all of the device's fit, from its beginning.
#[unsafe(no_mangle)]
pub extern "C" fn fit() -> u32 {
    SCENE.with(|scene| {
        let outcome = scene.fit();
        scene.told(outcome)
    })
}

/// Leaves the fitted values in room 4 and returns how many there are; 0 without a fit, or room.
#[unsafe(no_mangle)]
pub extern "C" fn values() -> usize {
    SCENE.with(|scene| scene.values())
}

/// The loss that the fit is likely to have; NaN if the recipe predicts none.
#[unsafe(no_mangle)]
pub extern "C" fn predicted_loss() -> f32 {
    SCENE.with(|scene| scene.predicted_loss())
}

/// The mean cosine-weighted logarithmic error of the fit at its readings; NaN without a fit.
#[unsafe(no_mangle)]
pub extern "C" fn residual() -> f32 {
    SCENE.with(|scene| scene.residual())
}

/// The paper's Loss against what lies in room 3: the mean of |ln(1 + y c) - ln(1 + f c)|, c =
/// cos(theta_i). NaN if there is nothing to compare.
#[unsafe(no_mangle)]
pub extern "C" fn loss() -> f64 {
    SCENE.with(|scene| scene.loss())
}

/// Leaves the BRDF at each of the recipe's samples in room 4, three numbers each, and returns how many
/// samples that are; 0 without a fit, or room.
#[unsafe(no_mangle)]
pub extern "C" fn at_samples() -> usize {
    SCENE.with(|scene| scene.at_samples())
}

/// Leaves the BRDF in the plane of incidence in room 4, three numbers for each of `steps` outgoing
/// angles, from -90 to 90 degrees and half a step off the horizon; `theta_i` is the light's, radians,
/// and a mirror's peak is at the same positive angle. Returns `steps`, or 0 if there is no room.
#[unsafe(no_mangle)]
pub extern "C" fn lobe(theta_i: f32, steps: u32) -> u32 {
    SCENE.with(|scene| shading::lobe(scene, theta_i, steps))
}

/// Leaves rows `first` to `end` (without it) of a picture of `size` x `size` pixels in room 4, three
/// numbers a pixel: a sphere that fills it, seen from far away along -z, y up, under a distant light
/// towards x, y, z, a vector of unit length. A white matt surface that faces the light has radiance 1.
/// What lies off the sphere is as its rim. Returns how many pixels there are, or 0 if there is no room.
#[unsafe(no_mangle)]
pub extern "C" fn shade(size: u32, first: u32, end: u32, x: f32, y: f32, z: f32) -> u32 {
    SCENE.with(|scene| shading::sphere(scene, size, first..end, [x, y, z]))
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    core::arch::wasm32::unreachable()
}
