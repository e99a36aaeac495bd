//! MERL: a material as a table of 90 x 90 x 180 measurements per channel (Matusik et al. 2003).
//!
//! `NAME.binary` starts with the dimensions (90, 90, 180) as three little-endian i32. The values follow as
//! little-endian f64, channel by channel (red, green, blue), at index phi_d + 180 (theta_d + 90 theta_h). They are the
//! BRDF divided by 1/1500, 1.15/1500 and 1.66/1500. Node k of theta_h is at pi/2 (k/90)^2. The nodes of theta_d and
//! phi_d are at whole degrees, and phi_d has period pi.
//!
//! A node was measured if its values in all channels are finite as f32 and not negative. Two other forms are read.

mod table;

pub(super) use table::has_signature;

use std::f64::consts::PI;
use std::io;
use std::path::Path;

use glimpse_core::geometry::Angles;
use glimpse_kernels::AngleDual;
use glimpse_kernels::dual::RealScalar;
use memmap2::{Mmap, MmapMut};
use rayon::prelude::*;

use self::table::{
    AXES, CHANNELS, FILE_BYTES, Form, HEADER_BYTES, MAX_UNMEASURED, NODES, NODES_PER_CHANNEL,
    Unmeasured, check, measured_values, node_angles, nodes_above_horizon,
};
use crate::basis::split_duals;
use crate::error::{Defect, map_file};
use crate::interpolation::corners;
use crate::{Brdf, BrdfWithDerivative, Coverage, Material, NotFinite, Omission, SourceError};

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
    pub(super) omissions: Vec<Omission>,
}

impl MerlTable {
    /// Maps a table and checks its header, its length and every value. A table in single precision or of all azimuths is
    /// converted to a table in memory.
    ///
    /// # Errors
    /// If the file cannot be read or has the wrong dimensions or length, if a value is not finite as f32, if fewer than half of
    /// the nodes above the horizon were measured, or if values whose phi_d differ by pi differ by more than 0.1 %.
    pub(crate) fn read(path: &Path, name: String) -> Result<Self, SourceError> {
        Self::parse(name, map_file(path)?).map_err(Defect::in_file(path))
    }

    fn parse(name: String, mut bytes: Mmap) -> Result<Self, Defect> {
        let form = Form::of(&bytes)?;
        if form != Form::STANDARD {
            let mut converted = MmapMut::map_anon(FILE_BYTES).map_err(no_memory)?;
            form.convert(&bytes, &mut converted)?;
            bytes = converted.make_read_only().map_err(no_memory)?;
        }
        check(&bytes)?;
        Self::filled(name, bytes)
    }

    /// Creates a table and fills its unmeasured nodes, in memory only.
    fn filled(name: String, mut bytes: Mmap) -> Result<Self, Defect> {
        let unmeasured = Unmeasured::find(&bytes);
        let filled = unmeasured.share();
        if filled > MAX_UNMEASURED {
            let defect = format!(
                "a channel is NaN, or below 0 in a file, at {:.1} % of the directions above the horizon, and at most \
                 {:.0} % may be",
                100.0 * filled,
                100.0 * MAX_UNMEASURED
            );
            return Err(Defect::new(defect, "give values at more directions"));
        }
        if filled > 0.0 {
            let mut writable = bytes.make_mut().map_err(no_memory)?;
            unmeasured.fill(&mut writable);
            bytes = writable.make_read_only().map_err(no_memory)?;
        }
        Ok(Self {
            name,
            bytes,
            filled,
            omissions: Vec::new(),
        })
    }

    /// Makes a table from BRDFs in linear RGB, sr^-1, not times the cosine: one for each of [`table_nodes`], and NaN
    /// where the BRDF is unknown. These nodes are filled from known ones.
    ///
    /// Even small negative values are errors, because a negative value in the table means "not measured". Set the
    /// negative values that noise causes in a dark measurement to 0 first.
    ///
    /// # Errors
    /// If the number of values differs from that of the nodes, a value is infinite or negative, or fewer than half of the
    /// nodes have values in all channels.
    pub fn from_nodes(name: String, brdf: &[[f32; 3]]) -> Result<Self, Defect> {
        let nodes = table_nodes();
        if nodes.len() != brdf.len() {
            let defect = format!(
                "there are {} values for {} directions",
                brdf.len(),
                nodes.len()
            );
            return Err(Defect::new(defect, "give one for each, in their order"));
        }
        for (index, (rgb, angles)) in brdf.iter().zip(nodes).enumerate() {
            let invalid = |value: &f32| value.is_infinite() || *value < 0.0;
            if let Some(channel) = rgb.iter().position(invalid) {
                let [theta_h, theta_d, phi_d] = angles.to_array().map(f32::to_degrees);
                let defect = format!(
                    "value {index} is {} in {} at theta_h {theta_h:.3}, theta_d {theta_d:.3} and phi_d {phi_d:.3} \
                     degrees, and a BRDF must be finite and not negative",
                    rgb[channel], CHANNELS[channel]
                );
                return Err(Defect::new(
                    defect,
                    "correct it, or give NaN where it is unknown",
                ));
            }
        }
        let mut bytes = MmapMut::map_anon(FILE_BYTES).map_err(no_memory)?;
        encode(brdf, &mut bytes);
        Self::filled(name, bytes.make_read_only().map_err(no_memory)?)
    }

    /// Returns the BRDF at [`table_nodes`], in their order. [`MerlTable::from_nodes`] makes the same table from it.
    #[must_use]
    pub fn to_nodes(&self) -> Vec<[f32; 3]> {
        let stored = |index| measured_values(&self.bytes, index).unwrap_or_default();
        let nodes = nodes_above_horizon().map(stored);
        nodes
            .map(|values| [0, 1, 2].map(|channel| (values[channel] * SCALE[channel]) as f32))
            .collect()
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

    fn omissions(&self) -> Vec<Omission> {
        self.omissions.clone()
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

/// Makes the defect of a table that the operating system cannot allocate.
fn no_memory(error: io::Error) -> Defect {
    let defect = format!("a table of {FILE_BYTES} bytes cannot be allocated ({error})");
    Defect::new(defect, "free some memory")
}

/// Returns the MERL nodes at which both directions are above the horizon, as angles in radians.
/// [`MerlTable::from_nodes`] takes one value for each. phi_d covers \[0, pi): in the other half, light and sensor are
/// exchanged.
#[must_use]
pub fn table_nodes() -> Vec<Angles<f32>> {
    nodes_above_horizon().map(node_angles).collect()
}

/// Writes a table into `bytes`, which have the length of a file: `brdf` is the BRDF at each of [`table_nodes`], and NaN
/// where it is unknown.
fn encode(brdf: &[[f32; 3]], bytes: &mut [u8]) {
    let (header, values) = bytes.split_at_mut(HEADER_BYTES);
    header.copy_from_slice(&NODES.map(|nodes| (nodes as i32).to_le_bytes()).concat());
    let (values, _) = values.as_chunks_mut();
    values.fill(NOT_MEASURED.to_le_bytes());
    for (index, rgb) in nodes_above_horizon().zip(brdf) {
        for (channel, value) in rgb.iter().enumerate().filter(|(_, value)| !value.is_nan()) {
            // The absolute value replaces -0 by 0.
            let stored = f64::from(value.abs()) / SCALE[channel];
            values[channel * NODES_PER_CHANNEL + index] = stored.to_le_bytes();
        }
    }
}

/// Tabulates a BRDF at MERL's nodes. Returns the bytes of a `NAME.binary`.
///
/// Nodes below the horizon are marked as not measured. Negative values are written as 0.
///
/// # Errors
/// If the BRDF is not finite at a node.
pub fn to_merl(brdf: &dyn Brdf) -> Result<Vec<u8>, NotFinite> {
    let nodes = table_nodes();
    let values = nodes.par_iter().map(|angles| brdf.at_angles(*angles));
    let values: Vec<[f32; 3]> = values.collect();
    let pairs = nodes.into_iter().zip(values);
    let pairs = pairs.map(|(angles, rgb)| NotFinite::check(angles, rgb));
    let values = pairs.collect::<Result<Vec<_>, _>>()?;
    let mut bytes = vec![0; FILE_BYTES];
    encode(&values, &mut bytes);
    Ok(bytes)
}
