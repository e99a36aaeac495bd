//! MERL tables from values at their nodes, and from any BRDF.

use glimpse_core::geometry::Angles;
use memmap2::MmapMut;
use rayon::prelude::*;

use super::grid::{
    FILE_BYTES, HEADER_BYTES, MAX_UNMEASURED, NODES, NODES_PER_CHANNEL, Unmeasured,
    measured_values, node_angles, nodes_above_horizon,
};
use super::read::CHANNELS;
use super::{MerlTable, NOT_MEASURED, SCALE};
use crate::{Brdf, NotFinite};

/// An error in the values for a table.
#[derive(Debug, thiserror::Error)]
pub enum TabulateError {
    /// The number of values differs from that of [`table_nodes`].
    #[error(
        "there are {actual} values for {expected} directions; give one for each, in their order"
    )]
    Count {
        /// The number of values.
        actual: usize,
        /// The number of directions.
        expected: usize,
    },
    /// A value is infinite or negative.
    #[error(
        "value {index} is {value} in {channel} at theta_h {:.3}, theta_d {:.3} and phi_d {:.3} \
         degrees, and a BRDF must be finite and not negative; correct it, or give NaN where it is unknown",
        .angles[0], .angles[1], .angles[2]
    )]
    Value {
        /// The index of the direction in [`table_nodes`].
        index: usize,
        /// "red", "green" or "blue".
        channel: &'static str,
        /// The value.
        value: f32,
        /// theta_h, theta_d and phi_d of the direction, in degrees.
        angles: [f32; 3],
    },
    /// The BRDF is NaN at more than half of the directions.
    #[error(
        "the BRDF is NaN in a channel at {:.1} % of the directions, and at most {:.0} % may be unknown; give values at more \
         directions",
        100.0 * .0, 100.0 * MAX_UNMEASURED
    )]
    MostlyUnknown(f64),
    /// The operating system cannot allocate the table.
    #[error("cannot allocate a table of {FILE_BYTES} bytes: {0}; free some memory")]
    Memory(#[from] std::io::Error),
}

/// Returns the MERL nodes at which both directions are above the horizon, as angles in radians.
/// [`MerlTable::from_nodes`] takes one value for each. phi_d covers \[0, pi): in the other half, light and sensor are
/// exchanged.
#[must_use]
pub fn table_nodes() -> Vec<Angles<f32>> {
    nodes_above_horizon().map(node_angles).collect()
}

/// Writes a table into `bytes`, which have the length of a file: `brdf` is the BRDF at each of [`table_nodes`], and NaN
/// where it is unknown. Negative values are written as 0, because they would mean "not measured".
fn encode(brdf: &[[f32; 3]], bytes: &mut [u8]) {
    let (header, values) = bytes.split_at_mut(HEADER_BYTES);
    header.copy_from_slice(&NODES.map(|nodes| (nodes as i32).to_le_bytes()).concat());
    let (values, _) = values.as_chunks_mut();
    values.fill(NOT_MEASURED.to_le_bytes());
    for (index, rgb) in nodes_above_horizon().zip(brdf) {
        for (channel, value) in rgb.iter().enumerate().filter(|(_, value)| !value.is_nan()) {
            // The absolute value replaces -0 by 0.
            let stored = f64::from(value.max(0.0).abs()) / SCALE[channel];
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
    for (angles, rgb) in nodes.into_iter().zip(&values) {
        NotFinite::check(angles, *rgb)?;
    }
    let mut bytes = vec![0; FILE_BYTES];
    encode(&values, &mut bytes);
    Ok(bytes)
}

impl MerlTable {
    /// Makes a table from BRDFs in linear RGB, sr^-1, not times the cosine: one for each of [`table_nodes`], and NaN
    /// where the BRDF is unknown. These nodes are filled from known ones.
    ///
    /// Even small negative values are errors, because a negative value in the table means "not measured". Set the
    /// negative values that noise causes in a dark measurement to 0 first.
    ///
    /// # Errors
    /// If the number of values differs from that of the nodes, a value is infinite or negative, or fewer than half of the
    /// nodes have values in all channels.
    pub fn from_nodes(name: String, brdf: &[[f32; 3]]) -> Result<Self, TabulateError> {
        let nodes = table_nodes();
        if nodes.len() != brdf.len() {
            return Err(TabulateError::Count {
                actual: brdf.len(),
                expected: nodes.len(),
            });
        }
        for (index, (rgb, angles)) in brdf.iter().zip(nodes).enumerate() {
            let invalid = |value: &f32| value.is_infinite() || *value < 0.0;
            if let Some(channel) = rgb.iter().position(invalid) {
                let angles = angles.to_array();
                return Err(TabulateError::Value {
                    index,
                    channel: CHANNELS[channel],
                    value: rgb[channel],
                    angles: angles.map(f32::to_degrees),
                });
            }
        }
        let mut bytes = MmapMut::map_anon(FILE_BYTES)?;
        encode(brdf, &mut bytes);
        let unmeasured = Unmeasured::find(&bytes);
        if unmeasured.share() > MAX_UNMEASURED {
            return Err(TabulateError::MostlyUnknown(unmeasured.share()));
        }
        Ok(Self::filled(name, bytes.make_read_only()?, unmeasured)?)
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Material, Procedural};

    #[test]
    fn table_from_nodes_equals_the_written_table() {
        let material = &Procedural::set(1, 7)[0];
        let nodes = table_nodes();
        let brdf: Vec<[f32; 3]> = nodes
            .iter()
            .map(|angles| material.at_angles(*angles))
            .collect();
        let table = MerlTable::from_nodes("a".into(), &brdf).expect("complete values");
        let written = to_merl(material as &dyn Material).expect("a finite BRDF");
        assert!(*table.bytes == *written);
        let copy = MerlTable::from_nodes("a".into(), &table.to_nodes()).expect("valid values");
        assert!(*copy.bytes == *table.bytes);
        assert_eq!(table.name(), "a");
    }

    #[test]
    fn excludes_unknown_nodes_and_rejects_invalid_values() {
        let count = table_nodes().len();
        let mut brdf = vec![[0.5, 0.25, 0.125]; count];
        brdf[0] = [f32::NAN; 3];
        let table = MerlTable::from_nodes("a".into(), &brdf).expect("one unknown node");
        let angles = Angles {
            theta_h: 0.0,
            theta_d: 0.005,
            phi_d: 0.1,
        };
        let rgb = table.at_angles(angles);
        assert!((rgb[0] - 0.5).abs() < 1e-6 && (rgb[2] - 0.125).abs() < 1e-6);

        let rejection = |brdf: &[[f32; 3]]| match MerlTable::from_nodes("a".into(), brdf) {
            Ok(_) => panic!("the values are accepted"),
            Err(error) => error,
        };
        let error = rejection(&brdf[1..]);
        assert!(matches!(error, TabulateError::Count { actual, .. } if actual == count - 1));
        for invalid in [f32::INFINITY, -1.0, -1e-9] {
            brdf[3][1] = invalid;
            let error = rejection(&brdf);
            let TabulateError::Value {
                index: 3,
                channel: "green",
                value,
                angles,
            } = error
            else {
                panic!("{error}");
            };
            assert_eq!(value, invalid);
            let node = table_nodes()[3];
            assert_eq!(angles[1], node.theta_d.to_degrees());
        }
        brdf.fill([f32::NAN, 1.0, 1.0]);
        let error = rejection(&brdf);
        assert!(matches!(error, TabulateError::MostlyUnknown(1.0)));
    }
}
