//! Writing of a BRDF as PAB-Opto text, at the directions of a goniophotometer.

use std::f64::consts::PI;
use std::fmt::Write;

use rayon::prelude::*;

use super::file::{SET_THETA_I, VALUE_COUNT};
use super::pair;
use crate::color::{TO_XYZ, product};
use crate::{NotFinite, Tabulation};

/// The theta_i of the files, in degrees.
pub(crate) const THETA_I: [u32; 11] = [0, 10, 20, 30, 40, 50, 60, 70, 75, 80, 85];
/// The ends of the names of the files, with theta_i.
#[rustfmt::skip]
pub(crate) const ENDINGS: [&str; 11] = [
    "_in00.txt", "_in10.txt", "_in20.txt", "_in30.txt", "_in40.txt", "_in50.txt", "_in60.txt", "_in70.txt", "_in75.txt",
    "_in80.txt", "_in85.txt",
];
/// The step between theta_o, in degrees.
const THETA_O_STEP: usize = 2;
/// The step between phi_o, in degrees.
const PHI_O_STEP: usize = 3;
/// The largest theta_o, in degrees.
const MAX_THETA_O: usize = 88;
/// The radii in degrees of circles around the mirror direction. They add directions, for sharp highlights.
const MIRROR_CIRCLES: [f64; 9] = [0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0];
/// The number of directions on each circle.
const DIRECTIONS_PER_CIRCLE: usize = 24;

/// Tabulates an isotropic BRDF, with the light at phi_i = 0. Returns the text of each file, in the order of
/// [`ENDINGS`]. All contain the name of the material as that of the sample.
///
/// # Errors
/// If the BRDF is not finite at a direction.
pub(crate) fn to_pab(table: &Tabulation<'_>) -> Result<Vec<Vec<u8>>, NotFinite> {
    let texts = THETA_I.par_iter();
    texts.map(|theta_i| file_text(table, *theta_i)).collect()
}

/// Returns the text of the file of a theta_i in degrees.
fn file_text(table: &Tabulation<'_>, theta_i: u32) -> Result<Vec<u8>, NotFinite> {
    // A quotation mark would end the name.
    let name = table.name.replace(['"', '\n'], "_");
    let outgoing = outgoing_angles(f64::from(theta_i));
    let set_theta_i = THETA_I.map(|theta_i| theta_i.to_string()).join(" ");
    let mut text = format!(
        "#sample_name \"{name}\"\n#colorimetry: CIE-XYZ\n#format: theta phi BRDF\n#intheta {theta_i}\n\
         #inphi 0\n#upphi 0\n{SET_THETA_I} {set_theta_i}\n{VALUE_COUNT} {}\n",
        outgoing.len()
    );
    let at = outgoing
        .iter()
        .map(|[theta_o, phi_o]| pair(f64::from(theta_i), *theta_o, *phi_o));
    let values = table.rgb.written_values_at(&at.collect::<Vec<_>>())?;
    for ([theta_o, phi_o], rgb) in outgoing.iter().zip(values) {
        let [x, y, z] = product(&TO_XYZ, rgb.map(f64::from));
        // Writing to a string never fails.
        let _ = writeln!(text, "{theta_o:.3} {phi_o:.3} {x:.6e} {y:.6e} {z:.6e}");
    }
    Ok(text.into_bytes())
}

/// Returns theta_o and phi_o of a file's lines, in degrees.
pub(crate) fn outgoing_angles(theta_i: f64) -> Vec<[f64; 2]> {
    let mut angles = vec![[0.0, 0.0]];
    for theta in (THETA_O_STEP..=MAX_THETA_O).step_by(THETA_O_STEP) {
        angles.extend(
            (0..360)
                .step_by(PHI_O_STEP)
                .map(|phi| [theta as f64, phi as f64]),
        );
    }
    let (sin, cos) = theta_i.to_radians().sin_cos();
    for radius in MIRROR_CIRCLES {
        let count = if radius > 0.0 {
            DIRECTIONS_PER_CIRCLE
        } else {
            1
        };
        let (sin_radius, cos_radius) = radius.to_radians().sin_cos();
        angles.extend((0..count).filter_map(|step| {
            let azimuth = 2.0 * PI * step as f64 / DIRECTIONS_PER_CIRCLE as f64;
            let (along, across) = (sin_radius * azimuth.cos(), sin_radius * azimuth.sin());
            // A circle around the z axis, rotated to the mirror direction (-sin, 0, cos).
            let (x, z) = (
                along * cos - cos_radius * sin,
                along * sin + cos_radius * cos,
            );
            let theta = x.hypot(across).atan2(z).to_degrees();
            let phi = across.atan2(x).to_degrees().rem_euclid(360.0);
            (theta <= MAX_THETA_O as f64).then_some([theta, phi])
        }));
    }
    angles
}
