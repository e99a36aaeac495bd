//! Conversions of angles.

use std::borrow::Borrow;
use std::f32::consts::TAU;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_kernels::AngleDual;

/// Returns the Rusinkiewicz angles of half and difference vectors, in radians. phi_d is in \[0, 2 pi).
#[must_use]
pub fn angles_of(at: &HalfDifference<f32>) -> Angles<f32> {
    let phi_d = at.dy.atan2(at.dx);
    Angles {
        theta_h: at.hx.atan2(at.hz),
        theta_d: at.dx.hypot(at.dy).atan2(at.dz),
        phi_d: if phi_d < 0.0 { phi_d + TAU } else { phi_d },
    }
}

/// Returns the half and difference vectors at angles in radians.
pub fn half_differences<A: Borrow<Angles<f32>>>(
    angles: impl IntoIterator<Item = A>,
) -> Vec<HalfDifference<f32>> {
    let angles = angles.into_iter();
    let at = angles.map(|angles| HalfDifference::from_angles(*angles.borrow()));
    at.collect()
}

/// Splits numbers into finite values and their derivatives, in f32.
pub(crate) fn split_duals(duals: [AngleDual<f64>; 3]) -> ([f32; 3], [[f32; 3]; 3]) {
    let (values, derivatives) = AngleDual::split(duals);
    (
        values.map(finite_f32),
        derivatives.map(|channel| channel.map(finite_f32)),
    )
}

/// Converts to f32. Finite numbers remain finite.
pub(crate) fn finite_f32(value: f64) -> f32 {
    (value as f32).clamp(f32::MIN, f32::MAX)
}
