//! MERL's tables of what is known at their nodes, without a file.

use glimpse_core::geometry::{Angles, HalfDifference};
use memmap2::MmapMut;

use super::{
    FILE_BYTES, HEADER_BYTES, MerlTable, NODES, NOT_MEASURED, PLANE, SCALE, degrees, theta_h,
};

/// Names of the channels.
const CHANNELS: [&str; 3] = ["red", "green", "blue"];

/// Why no table is made of values.
#[derive(Debug, thiserror::Error)]
pub enum TabulateError {
    /// There are more or fewer values than [`table_nodes`].
    #[error("{found} values for {expected} directions: give one for each, in their order")]
    Count {
        /// How many were given.
        found: usize,
        /// How many there are to be.
        expected: usize,
    },
    /// A value is infinite or negative.
    #[error(
        "value {index} is {value} in {channel} at theta_h {:.3}, theta_d {:.3} and phi_d {:.3} \
         degrees, and a BRDF is finite and not negative: correct it, or give NaN where it is not known",
        .angles[0], .angles[1], .angles[2]
    )]
    Value {
        /// The direction's place among [`table_nodes`].
        index: usize,
        /// "red", "green" or "blue".
        channel: &'static str,
        /// The value.
        value: f32,
        /// theta_h, theta_d and phi_d of the direction, in degrees.
        angles: [f32; 3],
    },
    /// A channel is NaN at all directions.
    #[error(
        "the BRDF is NaN in {channel} at all {count} directions: give values where it is known"
    )]
    NoValues {
        /// "red", "green" or "blue".
        channel: &'static str,
        /// The number of directions.
        count: usize,
    },
    /// The operating system has no memory for the table.
    #[error("no memory for a table of {FILE_BYTES} bytes: {0}")]
    Memory(#[from] std::io::Error),
}

/// The nodes of a table where both directions are above the horizon, angles in radians, in the order of
/// the table, and the place of each.
fn places() -> impl Iterator<Item = (usize, Angles<f32>)> {
    let [_, count_d, count_phi] = NODES;
    let all = (0..PLANE).map(move |place| {
        let angles = Angles {
            theta_h: theta_h(place / count_phi / count_d) as f32,
            theta_d: degrees(place / count_phi % count_d) as f32,
            phi_d: degrees(place % count_phi) as f32,
        };
        (place, angles)
    });
    all.filter(|(_, angles)| HalfDifference::from_angles(*angles).is_valid())
}

/// Where a material has to be known to be tabulated: MERL's nodes at which both directions are above the
/// horizon, angles in radians. phi_d takes half a turn: the other half is the same with light and sensor
/// exchanged.
#[must_use]
pub fn table_nodes() -> Vec<Angles<f32>> {
    places().map(|(_, angles)| angles).collect()
}

/// The first bytes of a file.
pub(super) fn header() -> Vec<u8> {
    let dimensions = NODES.map(|nodes| (nodes as i32).to_le_bytes());
    dimensions.concat()
}

impl MerlTable {
    /// Of BRDFs in linear RGB, sr^-1, not times the cosine: one for each of [`table_nodes`], NaN where
    /// nothing is known.
    ///
    /// Negative values are refused, small ones too: in the table they would mean that nothing was
    /// measured. Noise of a dark measurement has to be set to 0 before.
    ///
    /// # Errors
    /// If there are more or fewer, one is infinite or negative, or a channel is known nowhere.
    pub fn from_nodes(name: String, brdf: &[[f32; 3]]) -> Result<Self, TabulateError> {
        let places: Vec<_> = places().collect();
        if places.len() != brdf.len() {
            return Err(TabulateError::Count {
                found: brdf.len(),
                expected: places.len(),
            });
        }
        let mut bytes = MmapMut::map_anon(FILE_BYTES)?;
        let (head, values) = bytes.split_at_mut(HEADER_BYTES);
        head.copy_from_slice(&header());
        let (values, _) = values.as_chunks_mut();
        values.fill(NOT_MEASURED.to_le_bytes());
        let mut known = [0; 3];
        for (index, ((place, angles), rgb)) in places.into_iter().zip(brdf).enumerate() {
            for (channel, value) in rgb.iter().copied().enumerate() {
                if value.is_infinite() || value < 0.0 {
                    let angles = [angles.theta_h, angles.theta_d, angles.phi_d];
                    return Err(TabulateError::Value {
                        index,
                        channel: CHANNELS[channel],
                        value,
                        angles: angles.map(f32::to_degrees),
                    });
                }
                if !value.is_nan() {
                    known[channel] += 1;
                    // No negative zero: it would be stored with a sign.
                    let stored = f64::from(value.abs()) / SCALE[channel];
                    values[channel * PLANE + place] = stored.to_le_bytes();
                }
            }
        }
        if let Some(channel) = known.iter().position(|known| *known == 0) {
            return Err(TabulateError::NoValues {
                channel: CHANNELS[channel],
                count: brdf.len(),
            });
        }
        let bytes = bytes.make_read_only()?;
        Ok(Self {
            name,
            bytes,
            one_of_many: None,
        })
    }

    /// The BRDF at [`table_nodes`], in their order: what [`MerlTable::from_nodes`] makes the same table
    /// of. NaN where nothing is known.
    #[must_use]
    pub fn to_nodes(&self) -> Vec<[f32; 3]> {
        let at = |place: usize| {
            std::array::from_fn(|channel| match self.value(channel * PLANE + place) {
                value if value >= 0.0 => (value * SCALE[channel]) as f32,
                _ => f32::NAN,
            })
        };
        places().map(|(place, _)| at(place)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Material, Procedural, to_merl};

    #[test]
    fn a_table_of_nodes_is_the_one_that_is_written() {
        let material = &Procedural::set(1, 7)[0];
        let nodes = table_nodes();
        let brdf: Vec<[f32; 3]> = nodes.iter().map(|angles| material.brdf(*angles)).collect();
        let table = MerlTable::from_nodes("a".into(), &brdf).expect("all is known");
        let written = to_merl(material as &dyn Material).expect("it is finite");
        assert!(*table.bytes == *written);
        let again = MerlTable::from_nodes("a".into(), &table.to_nodes()).expect("it is a table");
        assert!(*again.bytes == *table.bytes);
        assert_eq!(table.name(), "a");
    }

    #[test]
    fn what_is_not_known_is_left_out() {
        let count = table_nodes().len();
        let mut brdf = vec![[0.5, 0.25, 0.125]; count];
        brdf[0] = [f32::NAN; 3];
        let table = MerlTable::from_nodes("a".into(), &brdf).expect("nearly all is known");
        let angles = Angles {
            theta_h: 0.0,
            theta_d: 0.005,
            phi_d: 0.1,
        };
        let found = table.brdf(angles);
        assert!((found[0] - 0.5).abs() < 1e-6 && (found[2] - 0.125).abs() < 1e-6);

        let refused = |brdf: &[[f32; 3]]| match MerlTable::from_nodes("a".into(), brdf) {
            Ok(_) => panic!("it is taken"),
            Err(error) => error,
        };
        let error = refused(&brdf[1..]);
        assert!(matches!(error, TabulateError::Count { found, .. } if found == count - 1));
        for broken in [f32::INFINITY, -1.0, -1e-9] {
            brdf[3][1] = broken;
            let error = refused(&brdf);
            let TabulateError::Value {
                index: 3,
                channel: "green",
                value,
                angles,
            } = error
            else {
                panic!("{error}");
            };
            assert_eq!(value, broken);
            let node = table_nodes()[3];
            assert_eq!(angles[1], node.theta_d.to_degrees());
        }
        brdf.fill([f32::NAN, 1.0, 1.0]);
        let error = refused(&brdf);
        assert!(matches!(
            error,
            TabulateError::NoValues { channel: "red", .. }
        ));
    }
}
