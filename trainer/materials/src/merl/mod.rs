//! MERL: a material as a table of 90 x 90 x 180 measurements per channel (Matusik et al. 2003).
//!
//! `NAME.binary` starts with the dimensions (90, 90, 180) as three little-endian i32. The values follow as
//! little-endian f64, channel by channel (red, green, blue), at index phi_d + 180 (theta_d + 90 theta_h). They are the
//! BRDF divided by 1/1500, 1.15/1500 and 1.66/1500. Node k of theta_h is at pi/2 (k/90)^2. The nodes of theta_d and
//! phi_d are at whole degrees, and phi_d has period pi.
//!
//! Negative values, and values that are not finite as f32, count as not measured.
//!
//! Two other forms are converted when read: tables in single precision (f32), and tables of 360 nodes of phi_d, whose second
//! half must equal the first one.

mod nodes;

pub use nodes::{TabulateError, table_nodes, to_merl};

use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

use glimpse_core::geometry::Angles;
use glimpse_core::numeric::Scalar;
use glimpse_kernels::Dual;
use memmap2::{Mmap, MmapMut};

use crate::error::{Defect, ensure, index_of, read_error};
use crate::mapped::map_file;
use crate::name::name_of;
use crate::{Material, SourceError};

/// The number of nodes along theta_h, theta_d and phi_d.
const NODES: [usize; 3] = [90, 90, 180];
/// The number of values of one channel.
const NODES_PER_CHANNEL: usize = NODES[0] * NODES[1] * NODES[2];
const HEADER_BYTES: usize = 3 * size_of::<i32>();
const FILE_BYTES: usize = HEADER_BYTES + 3 * NODES_PER_CHANNEL * size_of::<f64>();
/// The number of nodes of phi_d in a table of all azimuths.
const ALL_AZIMUTHS: usize = 2 * NODES[2];
/// The largest relative difference of two values whose phi_d differ by pi.
const HALVES_TOLERANCE: f64 = 1e-3;
/// Scale factors from stored values to the BRDF, in red, green and blue.
const SCALE: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];
/// Names of the channels.
const CHANNELS: [&str; 3] = ["red", "green", "blue"];
/// The stored value of nodes that are below the horizon or were not measured.
const NOT_MEASURED: f64 = -1.0;

/// A material that is a memory-mapped table.
///
/// Look-ups are trilinear in theta_h, theta_d and phi_d, with the exact derivatives of the interpolant. Beyond the last
/// node of theta_h or theta_d the BRDF is constant. Nodes that were not measured are excluded, and the weights of the
/// others are normalized to sum 1, for each channel. The BRDF is 0 if no measured node has a weight.
pub struct MerlTable {
    name: String,
    bytes: Mmap,
}

impl MerlTable {
    /// Maps a table and checks its header, its length and every value. A table in single precision or of all azimuths is
    /// converted to a table in memory.
    ///
    /// # Errors
    /// If the file cannot be read or has the wrong dimensions or length, if a value is not finite as f32, if a
    /// channel has no measured value, or if values whose phi_d differ by pi differ by more than 0.1 %.
    pub fn read(path: &Path) -> Result<Self, SourceError> {
        let name = name_of(path)?;
        let mut bytes = map_file(path)?;
        let form = Form::of(&bytes).map_err(Defect::in_file(path))?;
        if form != Form::STANDARD {
            let mut converted = MmapMut::map_anon(FILE_BYTES).map_err(read_error(path))?;
            form.convert(&bytes, &mut converted)
                .map_err(Defect::in_file(path))?;
            bytes = converted.make_read_only().map_err(read_error(path))?;
        }
        check(&bytes).map_err(Defect::in_file(path))?;
        Ok(Self { name, bytes })
    }

    /// Returns true if the first bytes of a file are the dimensions of a table.
    #[must_use]
    pub fn has_signature(bytes: &[u8]) -> bool {
        phi_nodes(bytes).is_some()
    }

    /// Returns a stored value, or 0 past the end of the table. [`MerlTable::read`] checks the length, so that no index
    /// is past the end.
    fn value(&self, index: usize) -> f64 {
        let (_, values) = self.bytes.split_at(HEADER_BYTES);
        let value = values.as_chunks().0.get(index);
        value.map_or(0.0, |bytes| f64::from_le_bytes(*bytes))
    }

    /// Interpolates the BRDF at `angles`, which lie in `cells`. The scalar type may have derivatives.
    fn interpolate<S: Scalar>(&self, cells: &[Cell; 3], angles: Angles<S>) -> [S; 3] {
        let [cell_h, cell_d, cell_phi] = cells;
        let zero = S::constant(0.0);
        let mut sums = [zero; 3];
        let mut total_weights = [zero; 3];
        for (h, weight_h) in cell_h.weights(angles.theta_h) {
            for (d, weight_d) in cell_d.weights(angles.theta_d) {
                for (phi, weight_phi) in cell_phi.weights(angles.phi_d) {
                    let index = phi + NODES[2] * (d + NODES[1] * h);
                    let weight = weight_h * weight_d * weight_phi;
                    for (channel, (sum, total)) in
                        sums.iter_mut().zip(&mut total_weights).enumerate()
                    {
                        let value = self.value(index + channel * NODES_PER_CHANNEL);
                        if (0.0..=f64::from(f32::MAX)).contains(&value) {
                            *sum = *sum + weight * S::constant(value * SCALE[channel]);
                            *total = *total + weight;
                        }
                    }
                }
            }
        }
        for (sum, total) in sums.iter_mut().zip(total_weights) {
            let normalized = *sum / total.if_positive(total, S::constant(1.0));
            *sum = total.if_positive(normalized, zero);
        }
        sums
    }
}

impl Material for MerlTable {
    fn name(&self) -> &str {
        &self.name
    }

    fn brdf(&self, angles: Angles<f32>) -> [f32; 3] {
        let angles = table_angles(angles);
        self.interpolate(&cells(angles), angles).map(|f| f as f32)
    }

    fn brdf_with_derivative(&self, angles: Angles<f32>) -> ([f32; 3], [[f32; 3]; 3]) {
        let angles = table_angles(angles);
        let duals = self.interpolate(&cells(angles), Dual::<f64, 3>::variables(angles));
        let (brdf, derivative) = Dual::split(duals);
        (
            brdf.map(|f| f as f32),
            derivative.map(|channel| channel.map(|value| value as f32)),
        )
    }
}

/// Returns the number of nodes of phi_d in a header; None if it is not that of a table.
fn phi_nodes(bytes: &[u8]) -> Option<usize> {
    [NODES[2], ALL_AZIMUTHS].into_iter().find(|phi| {
        let dimensions = [NODES[0], NODES[1], *phi].map(|nodes| (nodes as i32).to_le_bytes());
        bytes.starts_with(dimensions.as_flattened())
    })
}

/// The form of a table in a file.
#[derive(Clone, Copy, PartialEq)]
struct Form {
    phi_nodes: usize,
    /// The number of bytes of a value.
    width: usize,
}

impl Form {
    const STANDARD: Self = Self {
        phi_nodes: NODES[2],
        width: size_of::<f64>(),
    };

    /// Finds the form by the header and the length.
    fn of(bytes: &[u8]) -> Result<Self, Defect> {
        let Some(header) = bytes.first_chunk::<HEADER_BYTES>() else {
            return Err("it is too short for the header of a MERL table".into());
        };
        let Some(phi_nodes) = phi_nodes(header) else {
            let words = header.as_chunks().0.iter().copied();
            let dimensions: Vec<i32> = words.map(i32::from_le_bytes).collect();
            return Err(Defect::Unsupported(format!(
                "its header has the dimensions {dimensions:?}, and only isotropic MERL tables of {NODES:?} are supported"
            )));
        };
        let expected = [size_of::<f64>(), size_of::<f32>()].map(|width| {
            (
                HEADER_BYTES + 3 * NODES[0] * NODES[1] * phi_nodes * width,
                width,
            )
        });
        let length = bytes.len();
        match expected.iter().find(|(expected, _)| *expected == length) {
            Some((_, width)) => Ok(Self {
                phi_nodes,
                width: *width,
            }),
            None => Err(format!(
                "it has {length} bytes, and a MERL table has {}, or {} in single precision",
                expected[0].0, expected[1].0
            )
            .into()),
        }
    }

    /// Converts the values of a file to those of a file in the standard form.
    fn convert(self, bytes: &[u8], standard: &mut [u8]) -> Result<(), Defect> {
        let header = NODES.map(|nodes| (nodes as i32).to_le_bytes());
        standard[..HEADER_BYTES].copy_from_slice(header.as_flattened());
        let (converted, _) = standard[HEADER_BYTES..].as_chunks_mut();
        let (doubles, singles) = (
            bytes[HEADER_BYTES..].as_chunks().0,
            bytes[HEADER_BYTES..].as_chunks().0,
        );
        let value = |index: usize| match self.width {
            4 => f64::from(f32::from_le_bytes(singles[index])),
            _ => f64::from_le_bytes(doubles[index]),
        };
        for (position, converted) in converted.iter_mut().enumerate() {
            let index = position / NODES[2] * self.phi_nodes + position % NODES[2];
            let first = value(index);
            if self.phi_nodes == ALL_AZIMUTHS {
                let second = value(index + NODES[2]);
                let tolerance = HALVES_TOLERANCE * first.abs().max(second.abs());
                if !(first < 0.0 && second < 0.0 || (first - second).abs() <= tolerance) {
                    return Err(Defect::OtherForm(
                        format!(
                            "its value of {} is {first:e}, and {second:e} at the opposite phi_d",
                            place(position)
                        ),
                        "average both halves of phi_d to a table of 180 values",
                    ));
                }
            }
            *converted = first.to_le_bytes();
        }
        Ok(())
    }
}

/// Describes the color and the angles of a value.
fn place(position: usize) -> String {
    let index = index_of(position, &[3, NODES[0], NODES[1], NODES[2]]);
    format!(
        "{} at theta_h {:.3}, theta_d {} and phi_d {} degrees",
        CHANNELS[index[0]],
        node_theta_h(index[1]).to_degrees(),
        index[2],
        index[3]
    )
}

/// Checks the values of a file in the standard form.
fn check(bytes: &[u8]) -> Result<(), Defect> {
    let (values, _) = bytes[HEADER_BYTES..].as_chunks();
    let number = |bytes: &[u8; 8]| f64::from_le_bytes(*bytes);
    // The comparison is false for NaN.
    let is_in_range = |value: f64| value.abs() <= f64::from(f32::MAX);
    if let Some(position) = values.iter().position(|bytes| !is_in_range(number(bytes))) {
        let value = number(&values[position]);
        return Err(format!(
            "its value of {} is {value:e}, not finite as a 32-bit float",
            place(position)
        )
        .into());
    }
    for (color, values) in CHANNELS.iter().zip(values.chunks(NODES_PER_CHANNEL)) {
        ensure!(
            values.iter().any(|bytes| number(bytes) >= 0.0),
            "all its {color} values are negative, so that none was measured"
        );
    }
    Ok(())
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

/// Returns theta_h at node `k`, in radians.
fn node_theta_h(k: usize) -> f64 {
    let root = k as f64 / NODES[0] as f64;
    FRAC_PI_2 * root * root
}

/// Returns theta_d or phi_d at node `k`, which is `k` degrees, in radians.
fn whole_degree(k: usize) -> f64 {
    (k as f64).to_radians()
}

/// The interval between two neighboring nodes of one angle.
#[derive(Clone, Copy)]
struct Cell {
    nodes: [usize; 2],
    /// The angles at the nodes, in radians.
    ends: [f64; 2],
}

/// Returns the cell of each angle.
fn cells(angles: Angles<f64>) -> [Cell; 3] {
    let root = (angles.theta_h / FRAC_PI_2).sqrt();
    let mut phi_d = Cell::around(
        angles.phi_d,
        angles.phi_d.to_degrees(),
        NODES[2],
        whole_degree,
    );
    // phi_d is periodic: the node after the last one is the first.
    phi_d.nodes[1] %= NODES[2];
    [
        Cell::around(
            angles.theta_h,
            NODES[0] as f64 * root,
            NODES[0] - 1,
            node_theta_h,
        ),
        Cell::around(
            angles.theta_d,
            angles.theta_d.to_degrees(),
            NODES[1] - 1,
            whole_degree,
        ),
        phi_d,
    ]
}

impl Cell {
    /// Returns the cell of `angle`. Node k, from 0 to `last`, is at `node_angle(k)`. `position` is the position of
    /// `angle` among the nodes, up to rounding.
    fn around(angle: f64, position: f64, last: usize, node_angle: fn(usize) -> f64) -> Self {
        let mut low = (position as usize).min(last);
        if angle < node_angle(low) {
            low = low.saturating_sub(1);
        } else if low < last && angle >= node_angle(low + 1) {
            low += 1;
        }
        // Beyond the ends, the cell has width 0 at the first or last node_angle.
        let high = match angle >= node_angle(low) {
            true => (low + 1).min(last),
            false => low,
        };
        Self {
            nodes: [low, high],
            ends: [node_angle(low), node_angle(high)],
        }
    }

    /// Returns the nodes, each with its weight at `angle`.
    fn weights<S: Scalar>(&self, angle: S) -> [(usize, S); 2] {
        let [low, high] = self.ends;
        let (low_weight, high_weight) = if high > low {
            let per_radian = S::constant(1.0 / (high - low));
            (
                (S::constant(high) - angle) * per_radian,
                (angle - S::constant(low)) * per_radian,
            )
        } else {
            (S::constant(1.0), S::constant(0.0))
        };
        [(self.nodes[0], low_weight), (self.nodes[1], high_weight)]
    }
}
