//! MERL: a material as a table of 90 x 90 x 180 measurements per channel (Matusik et al. 2003).
//!
//! `NAME.binary` starts with the dimensions (90, 90, 180) as three little-endian i32. The values follow as
//! little-endian f64, channel by channel (red, green, blue), at index phi_d + 180 (theta_d + 90 theta_h). They are the
//! BRDF divided by 1/1500, 1.15/1500 and 1.66/1500. Node k of theta_h is at pi/2 (k/90)^2. The nodes of theta_d and
//! phi_d are at whole degrees, and phi_d has period pi.
//!
//! A node was measured if its values in all channels are finite as f32 and not negative. [`read`] reads two other forms.

mod grid;
mod read;
mod write;

pub(super) use read::has_signature;
pub use write::{TabulateError, table_nodes, to_merl};

use std::f64::consts::PI;
use std::io;
use std::path::Path;

use glimpse_core::geometry::Angles;
use glimpse_kernels::dual::RealScalar;
use memmap2::{Mmap, MmapMut};

use self::grid::{AXES, FILE_BYTES, MAX_UNMEASURED, NODES, Unmeasured, measured_values};
use self::read::{Form, check};
use crate::basis::{AngleDual, split_duals};
use crate::error::{Defect, read_error};
use crate::interpolation::corners;
use crate::mapped::map_file;
use crate::{Brdf, BrdfWithDerivative, Coverage, Material, SourceError};

/// Scale factors from stored values to the BRDF, in red, green and blue.
const SCALE: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];
/// The stored value of nodes that are below the horizon or were not measured.
const NOT_MEASURED: f64 = -1.0;

/// A material that is a memory-mapped table.
///
/// Look-ups are trilinear in theta_h, theta_d and phi_d, with the exact derivatives of the interpolant. Beyond the last
/// node of theta_h or theta_d the BRDF is constant. Unmeasured nodes above the horizon are filled from measured ones. Nodes
/// below it are excluded, and the weights of the others are normalized to sum 1. The BRDF is 0 if no node has a weight.
pub struct MerlTable {
    name: String,
    bytes: Mmap,
    /// The share of nodes above the horizon that were not measured.
    filled: f64,
}

impl MerlTable {
    /// Maps a table and checks its header, its length and every value. A table in single precision or of all azimuths is
    /// converted to a table in memory.
    ///
    /// # Errors
    /// If the file cannot be read or has the wrong dimensions or length, if a value is not finite as f32, or if fewer than
    /// half of the nodes above the horizon were measured, or if values
    /// whose phi_d differ by pi differ by more than 0.1 %.
    pub(crate) fn read(path: &Path, name: String) -> Result<Self, SourceError> {
        let mut bytes = map_file(path)?;
        let form = Form::of(&bytes).map_err(Defect::in_file(path))?;
        if form != Form::STANDARD {
            let mut converted = MmapMut::map_anon(FILE_BYTES).map_err(read_error(path))?;
            form.convert(&bytes, &mut converted)
                .map_err(Defect::in_file(path))?;
            bytes = converted.make_read_only().map_err(read_error(path))?;
        }
        check(&bytes).map_err(Defect::in_file(path))?;
        let unmeasured = Unmeasured::find(&bytes);
        let share = unmeasured.share();
        if share > MAX_UNMEASURED {
            return Err(Defect::in_file(path)(format!(
                "{:.1} % of its directions above the horizon were not measured (negative in a channel), and at most \
                 {:.0} % may be",
                100.0 * share,
                100.0 * MAX_UNMEASURED
            )));
        }
        Self::filled(name, bytes, unmeasured).map_err(read_error(path))
    }

    /// Creates a table and fills its unmeasured nodes, in memory only.
    fn filled(name: String, mut bytes: Mmap, unmeasured: Unmeasured) -> io::Result<Self> {
        let filled = unmeasured.share();
        if filled > 0.0 {
            let mut writable = bytes.make_mut()?;
            unmeasured.fill(&mut writable);
            bytes = writable.make_read_only()?;
        }
        Ok(Self {
            name,
            bytes,
            filled,
        })
    }

    /// Interpolates the BRDF at angles. The scalar type may have derivatives.
    fn interpolate<S: RealScalar>(&self, angles: Angles<S>) -> [S; 3] {
        let zero = S::constant(0.0);
        let mut sums = [zero; 3];
        let mut total = zero;
        let point = angles.to_array();
        for ([h, d, phi], weight) in corners(point, &AXES) {
            let index = phi % NODES[2] + NODES[2] * (d + NODES[1] * h);
            let Some(values) = measured_values(&self.bytes, index) else {
                continue;
            };
            total = total + weight;
            for ((sum, value), scale) in sums.iter_mut().zip(values).zip(SCALE) {
                *sum = *sum + weight * S::constant(value * scale);
            }
        }
        sums.map(|sum| {
            let normalized = sum / total.if_positive(total, S::constant(1.0));
            total.if_positive(normalized, zero)
        })
    }
}

impl Brdf for MerlTable {
    fn at_angles(&self, angles: Angles<f32>) -> [f32; 3] {
        self.interpolate(table_angles(angles)).map(|f| f as f32)
    }
}

impl Material for MerlTable {
    fn name(&self) -> &str {
        &self.name
    }

    fn with_derivatives(&self, angles: &[Angles<f32>]) -> Vec<BrdfWithDerivative> {
        let variables = |angles: &Angles<f32>| AngleDual::variables(table_angles(*angles));
        let duals = angles
            .iter()
            .map(|angles| self.interpolate(variables(angles)));
        duals.map(split_duals).collect()
    }

    fn coverage(&self) -> Coverage {
        match self.filled {
            0.0 => Coverage::Complete,
            share => Coverage::Filled { share },
        }
    }
}

/// Converts angles to f64, with phi_d reduced to \[0, pi).
fn table_angles(angles: Angles<f32>) -> Angles<f64> {
    let phi_d = f64::from(angles.phi_d).rem_euclid(PI);
    Angles {
        theta_h: angles.theta_h.into(),
        theta_d: angles.theta_d.into(),
        // The remainder of a tiny negative angle is rounded to pi.
        phi_d: if phi_d < PI { phi_d } else { 0.0 },
    }
}
