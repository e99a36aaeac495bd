//! MERL: a material as a table of 90 x 90 x 180 measurements per channel (Matusik et al. 2003).
//!
//! `NAME.binary` starts with the dimensions (90, 90, 180) as three little-endian i32. The values follow as
//! little-endian f64, channel by channel (red, green, blue), at index phi_d + 180 (theta_d + 90 theta_h). They are the
//! BRDF divided by 1/1500, 1.15/1500 and 1.66/1500. Node k of theta_h is at pi/2 (k/90)^2. The nodes of theta_d and
//! phi_d are at whole degrees, and phi_d has period pi.
//!
//! Negative values, and values that are not finite as f32, count as not measured.

mod nodes;
mod write;

pub use nodes::{TabulateError, table_nodes};
pub use write::{to_merl, write_merl};

use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use glimpse_core::geometry::Angles;
use glimpse_core::numeric::Scalar;
use memmap2::Mmap;

use super::mapped::{map_file, release};
use super::name;
use super::{Material, SourceError};
use glimpse_kernels::Dual;

/// The number of nodes along theta_h, theta_d and phi_d.
const NODES: [usize; 3] = [90, 90, 180];
/// The number of values of one channel.
const NODES_PER_CHANNEL: usize = NODES[0] * NODES[1] * NODES[2];
const HEADER_BYTES: usize = 3 * size_of::<i32>();
const FILE_BYTES: usize = HEADER_BYTES + 3 * NODES_PER_CHANNEL * size_of::<f64>();
/// Scale factors from stored values to the BRDF, in red, green and blue.
const SCALE: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];
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
    /// The number of look-ups since [`MerlTable::open`]. None for a table that does not release its pages regularly.
    lookups: Option<AtomicUsize>,
}

/// The number of look-ups between releases of pages, for a table from [`MerlTable::open`]. Each look-up reads 64 KiB at
/// each of about six places of the file. Without releases, hundreds of tables would soon be completely in memory.
const RELEASE_INTERVAL: usize = 16;

impl MerlTable {
    /// Opens a table and checks its header, its length and every value. The check reads the whole file. The thousands
    /// of look-ups at random directions of any command would read nearly all of it too.
    ///
    /// # Errors
    /// If the file cannot be read or has the wrong dimensions or length, if a value is not finite as f32, or if a
    /// channel has no measured value.
    pub fn read(path: &Path) -> Result<Self, SourceError> {
        let mut table = Self::open(path)?;
        table.lookups = None;
        table
            .check_values()
            .map_err(|defect| SourceError::Damaged {
                path: path.into(),
                defect,
            })?;
        table.release();
        Ok(table)
    }

    /// Opens a table and checks only its header and its length, for sets of many tables. Pages are read on first access
    /// and released regularly. Values that are not finite as f32 count as not measured.
    ///
    /// # Errors
    /// If the file cannot be read, or has the wrong dimensions or length.
    pub fn open(path: &Path) -> Result<Self, SourceError> {
        let damaged = |defect| SourceError::Damaged {
            path: path.into(),
            defect,
        };
        let name = name::name_of(path).ok_or_else(|| SourceError::UnknownFormat(path.into()))?;
        let bytes = map_file(path)?;

        let header = bytes.first_chunk::<HEADER_BYTES>().ok_or_else(|| {
            damaged(format!(
                "it has {} bytes, too few for the header of a MERL table; replace the file with an intact copy",
                bytes.len()
            ))
        })?;
        if !Self::has_signature(header) {
            let (words, _) = header.as_chunks();
            let dimensions: Vec<i32> = words.iter().copied().map(i32::from_le_bytes).collect();
            let swapped: Vec<u8> = dimensions
                .iter()
                .flat_map(|word| word.to_be_bytes())
                .collect();
            if Self::has_signature(&swapped) {
                return Err(damaged(
                    "its numbers are big-endian, and must be little-endian; swap the bytes of the three 32-bit \
                     dimensions and of the 64-bit values"
                        .to_owned(),
                ));
            }
            return Err(damaged(format!(
                "its header has the dimensions {dimensions:?}, and only isotropic MERL tables of {NODES:?} are \
                 supported; remove the file"
            )));
        }
        if bytes.len() != FILE_BYTES {
            let defect = match bytes.len() < FILE_BYTES {
                true => "it was cut short",
                false => "something was appended",
            };
            return Err(damaged(format!(
                "{defect}: it has {} bytes, and a MERL table has {FILE_BYTES}; replace the file with an intact copy",
                bytes.len()
            )));
        }
        Ok(Self {
            name,
            bytes,
            lookups: Some(AtomicUsize::new(0)),
        })
    }

    /// Checks every value.
    fn check_values(&self) -> Result<(), String> {
        // The comparison is false for NaN.
        let is_in_range = |value: f64| value.abs() <= f64::from(f32::MAX);
        let (values, _) = self.bytes[HEADER_BYTES..].as_chunks();
        for ((channel, color), values) in (0..)
            .zip(["red", "green", "blue"])
            .zip(values.chunks(NODES_PER_CHANNEL))
        {
            let values = values.iter().copied().map(f64::from_le_bytes);
            if let Some((index, value)) = values
                .clone()
                .enumerate()
                .find(|(_, value)| !is_in_range(*value))
            {
                let index = channel * NODES_PER_CHANNEL + index;
                return Err(format!(
                    "value {index} is {value:e}, which is not finite as a 32-bit float; replace the file with an \
                     intact copy"
                ));
            }
            if !values.clone().any(|value| value >= 0.0) {
                return Err(format!(
                    "all its {color} values are negative, so that none was measured; replace the file with an intact \
                     copy"
                ));
            }
        }
        Ok(())
    }

    /// Returns true if the first bytes of a file are the dimensions of a table.
    #[must_use]
    pub fn has_signature(bytes: &[u8]) -> bool {
        let dimensions = NODES.map(|nodes| (nodes as i32).to_le_bytes());
        bytes.starts_with(dimensions.as_flattened())
    }

    /// Returns a stored value, or 0 past the end of the table. [`MerlTable::open`] checks the length, so that no index
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
        if let Some(count) = &self.lookups
            && count.fetch_add(1, Ordering::Relaxed) % RELEASE_INTERVAL == RELEASE_INTERVAL - 1
        {
            self.release();
        }
        (
            brdf.map(|f| f as f32),
            derivative.map(|channel| channel.map(|value| value as f32)),
        )
    }

    fn release(&self) {
        release(&self.bytes);
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
