//! MERL: a material as a table of 90 x 90 x 180 measurements (Matusik et al. 2003).
//!
//! `NAME.binary`: three little-endian i32, the dimensions (90, 90, 180), then little-endian f64,
//! color by color (red, green, blue), at index phi_d + 180 (theta_d + 90 theta_h). Values are
//! the BRDF divided by 1/1500, 1.15/1500 and 1.66/1500. Node k of theta_h is at
//! pi/2 (k/90)^2, the nodes of theta_d and phi_d at whole degrees; phi_d has period pi.
//!
//! A negative value was not measured; neither was one that is not a finite f32.

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

use super::mapped::{map, release};
use super::name;
use super::{Material, SourceError};
use glimpse_kernels::Dual;

/// Nodes of theta_h, theta_d and phi_d.
const NODES: [usize; 3] = [90, 90, 180];
/// Values of one color.
const PLANE: usize = NODES[0] * NODES[1] * NODES[2];
const HEADER_BYTES: usize = 3 * size_of::<i32>();
const FILE_BYTES: usize = HEADER_BYTES + 3 * PLANE * size_of::<f64>();
/// What values are multiplied by, in red, green and blue.
const SCALE: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];
/// What is written where a direction is below the horizon, or nothing was measured.
const NOT_MEASURED: f64 = -1.0;

/// A material that is a table, read in place.
///
/// Look-ups are trilinear between nodes, in theta_h, theta_d and phi_d, with the exact derivative
/// of that interpolant; past the last node of theta_h or theta_d they stay at its value. Nodes
/// that were not measured are left out and the others' weights made up to 1, channel by channel;
/// where no measured node has any weight, the BRDF is 0.
pub struct MerlTable {
    name: String,
    bytes: Mmap,
    /// Of one of many: how often it was looked up.
    one_of_many: Option<AtomicUsize>,
}

/// After so many look-ups one by one a table that is one of many lets go of what lies in memory. Each
/// brings 64 KiB for each of some six places of the file, and hundreds of tables would soon be there whole.
const HELD: usize = 16;

impl MerlTable {
    /// Opens a table and checks its header, its length and every value. (Look-ups at thousands of
    /// random places, as all commands do them, would read nearly all of the file too.)
    ///
    /// # Errors
    /// If the file cannot be read, has other dimensions or another length, a value is not finite
    /// (in f32, as look-ups are), or no value of a color was measured.
    pub fn read(path: &Path) -> Result<Self, SourceError> {
        let mut table = Self::open(path)?;
        table.one_of_many = None;
        table.check_values().map_err(|what| SourceError::Damaged {
            path: path.into(),
            what,
        })?;
        table.release();
        Ok(table)
    }

    /// Opens one of many tables and checks its header and its length alone: values are not read before
    /// they are needed, and not kept in memory for long. One that is no BRDF counts as not measured.
    ///
    /// # Errors
    /// If the file cannot be read, has other dimensions or another length.
    pub fn open(path: &Path) -> Result<Self, SourceError> {
        let damaged = |what| SourceError::Damaged {
            path: path.into(),
            what,
        };
        let name = name::name_of(path).ok_or_else(|| SourceError::UnknownFormat(path.into()))?;
        let bytes = map(path)?;

        let header = bytes.first_chunk::<HEADER_BYTES>().ok_or_else(|| {
            damaged(format!(
                "it has {} bytes, too few even for a MERL table's header; get it again",
                bytes.len()
            ))
        })?;
        if !Self::begins(header) {
            let (words, _) = header.as_chunks();
            let found: Vec<i32> = words.iter().copied().map(i32::from_le_bytes).collect();
            let swapped: Vec<u8> = found.iter().flat_map(|word| word.to_be_bytes()).collect();
            if Self::begins(&swapped) {
                return Err(damaged(
                    "its numbers are big-endian, and a MERL table's are little-endian; swap the \
                     bytes of the three 32-bit dimensions and of the 64-bit values"
                        .to_owned(),
                ));
            }
            return Err(damaged(format!(
                "its header gives the dimensions {found:?} where a MERL table has {NODES:?}; \
                 only isotropic materials of that size are read; take it away"
            )));
        }
        if bytes.len() != FILE_BYTES {
            let complaint = match bytes.len() < FILE_BYTES {
                true => "it was cut short",
                false => "something was appended",
            };
            return Err(damaged(format!(
                "{complaint}: it has {} bytes where a MERL table has {FILE_BYTES}; get it again",
                bytes.len()
            )));
        }
        Ok(Self {
            name,
            bytes,
            one_of_many: Some(AtomicUsize::new(0)),
        })
    }

    /// Looks at every value.
    fn check_values(&self) -> Result<(), String> {
        // Of what passes, f32 look-ups are finite. (NaN does not pass.)
        let passes = |value: f64| value.abs() <= f64::from(f32::MAX);
        let (values, _) = self.bytes[HEADER_BYTES..].as_chunks();
        for ((number, color), plane) in (0..)
            .zip(["red", "green", "blue"])
            .zip(values.chunks(PLANE))
        {
            let plane = plane.iter().copied().map(f64::from_le_bytes);
            if let Some((index, value)) =
                plane.clone().enumerate().find(|(_, value)| !passes(*value))
            {
                let index = number * PLANE + index;
                return Err(format!(
                    "value {index} is {value:e}, which is no BRDF; get the file again"
                ));
            }
            if !plane.clone().any(|value| value >= 0.0) {
                return Err(format!(
                    "none of its {color} values was measured: all are negative; get the file again"
                ));
            }
        }
        Ok(())
    }

    /// True of bytes that begin as a table does: with its dimensions.
    #[must_use]
    pub fn begins(bytes: &[u8]) -> bool {
        let dimensions = NODES.map(|nodes| (nodes as i32).to_le_bytes());
        bytes.starts_with(dimensions.as_flattened())
    }

    /// A stored value; 0 past the table's end, which `read` has excluded.
    fn value(&self, index: usize) -> f64 {
        let (_, values) = self.bytes.split_at(HEADER_BYTES);
        let value = values.as_chunks().0.get(index);
        value.map_or(0.0, |bytes| f64::from_le_bytes(*bytes))
    }

    /// The BRDF at `angles`, which lie in `cells`; the shares of nodes may carry derivatives.
    fn interpolate<S: Scalar>(&self, cells: &[Cell; 3], angles: Angles<S>) -> [S; 3] {
        let [cell_h, cell_d, cell_phi] = cells;
        let zero = S::constant(0.0);
        let mut sums = [zero; 3];
        let mut weights = [zero; 3];
        for (h, weight_h) in cell_h.shares(angles.theta_h) {
            for (d, weight_d) in cell_d.shares(angles.theta_d) {
                for (phi, weight_phi) in cell_phi.shares(angles.phi_d) {
                    let index = phi + NODES[2] * (d + NODES[1] * h);
                    let weight = weight_h * weight_d * weight_phi;
                    for (channel, (sum, total)) in sums.iter_mut().zip(&mut weights).enumerate() {
                        let value = self.value(index + channel * PLANE);
                        if (0.0..=f64::from(f32::MAX)).contains(&value) {
                            *sum = *sum + weight * S::constant(value * SCALE[channel]);
                            *total = *total + weight;
                        }
                    }
                }
            }
        }
        for (sum, total) in sums.iter_mut().zip(weights) {
            let made_up = *sum / total.if_positive(total, S::constant(1.0));
            *sum = total.if_positive(made_up, zero);
        }
        sums
    }
}

impl Material for MerlTable {
    fn name(&self) -> &str {
        &self.name
    }

    fn brdf(&self, angles: Angles<f32>) -> [f32; 3] {
        let angles = in_table(angles);
        self.interpolate(&cells(angles), angles).map(|f| f as f32)
    }

    fn brdf_with_derivative(&self, angles: Angles<f32>) -> ([f32; 3], [[f32; 3]; 3]) {
        let angles = in_table(angles);
        let found = self.interpolate(&cells(angles), Dual::<f64, 3>::variables(angles));
        let (brdf, derivative) = Dual::split(found);
        if let Some(count) = &self.one_of_many
            && count.fetch_add(1, Ordering::Relaxed) % HELD == HELD - 1
        {
            self.release();
        }
        (
            brdf.map(|f| f as f32),
            derivative.map(|by_angles| by_angles.map(|slope| slope as f32)),
        )
    }

    fn release(&self) {
        release(&self.bytes);
    }
}

/// Angles in double precision, phi_d brought to \[0, pi).
fn in_table(angles: Angles<f32>) -> Angles<f64> {
    let phi_d = f64::from(angles.phi_d).rem_euclid(PI);
    Angles {
        theta_h: angles.theta_h.into(),
        theta_d: angles.theta_d.into(),
        // A tiny negative angle is rounded up to pi.
        phi_d: if phi_d < PI { phi_d } else { 0.0 },
    }
}

/// theta_h at node `k`.
fn theta_h(k: usize) -> f64 {
    let root = k as f64 / NODES[0] as f64;
    FRAC_PI_2 * root * root
}

/// theta_d or phi_d at node `k`.
fn degrees(k: usize) -> f64 {
    (k as f64).to_radians()
}

/// Two neighboring nodes of one angle.
#[derive(Clone, Copy)]
struct Cell {
    nodes: [usize; 2],
    /// Their angles.
    ends: [f64; 2],
}

/// The cells that angles lie in.
fn cells(angles: Angles<f64>) -> [Cell; 3] {
    let root = (angles.theta_h / FRAC_PI_2).sqrt();
    let mut phi_d = Cell::around(angles.phi_d, angles.phi_d.to_degrees(), NODES[2], degrees);
    // The node after the last one is the first again.
    phi_d.nodes[1] %= NODES[2];
    [
        Cell::around(
            angles.theta_h,
            NODES[0] as f64 * root,
            NODES[0] - 1,
            theta_h,
        ),
        Cell::around(
            angles.theta_d,
            angles.theta_d.to_degrees(),
            NODES[1] - 1,
            degrees,
        ),
        phi_d,
    ]
}

impl Cell {
    /// The cell of `angle`, whose position among nodes 0 to `last` at angles `node(k)` is
    /// `position`, but for rounding.
    fn around(angle: f64, position: f64, last: usize, node: fn(usize) -> f64) -> Self {
        let mut low = (position as usize).min(last);
        if angle < node(low) {
            low = low.saturating_sub(1);
        } else if low < last && angle >= node(low + 1) {
            low += 1;
        }
        // Past the ends, a cell of no width at the last or first node.
        let high = match angle >= node(low) {
            true => (low + 1).min(last),
            false => low,
        };
        Self {
            nodes: [low, high],
            ends: [node(low), node(high)],
        }
    }

    /// The nodes, each with its share at `angle`.
    fn shares<S: Scalar>(&self, angle: S) -> [(usize, S); 2] {
        let [low, high] = self.ends;
        let (rest, share) = if high > low {
            let per_radian = S::constant(1.0 / (high - low));
            (
                (S::constant(high) - angle) * per_radian,
                (angle - S::constant(low)) * per_radian,
            )
        } else {
            (S::constant(1.0), S::constant(0.0))
        };
        [(self.nodes[0], rest), (self.nodes[1], share)]
    }
}
