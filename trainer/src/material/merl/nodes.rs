//! MERL's tables of what is known at their nodes, without a file.

use glimpse_core::geometry::{Angles, HalfDifference};
use memmap2::MmapMut;

use super::{
    FILE_BYTES, HEADER_BYTES, MerlTable, NODES, NOT_MEASURED, PLANE, SCALE, degrees, theta_h,
};

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
    /// A value is infinite.
    #[error("value {index} is {value}, and a BRDF is finite; give NaN where nothing is known")]
    Infinite {
        /// Which one.
        index: usize,
        /// What it is.
        value: f32,
    },
    /// A colour has no value at all.
    #[error("{0}")]
    Nothing(String),
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
    /// nothing is known. What is less than 0 becomes 0.
    ///
    /// # Errors
    /// If there are more or fewer, one is infinite, or a colour is known nowhere.
    pub fn of_nodes(name: String, brdf: &[[f32; 3]]) -> Result<Self, TabulateError> {
        let places: Vec<usize> = places().map(|(place, _)| place).collect();
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
        for (index, (place, rgb)) in places.into_iter().zip(brdf).enumerate() {
            for (channel, value) in rgb.iter().copied().enumerate() {
                if value.is_infinite() {
                    return Err(TabulateError::Infinite { index, value });
                }
                if !value.is_nan() {
                    let stored = f64::from(value).max(0.0) / SCALE[channel];
                    values[channel * PLANE + place] = stored.to_le_bytes();
                }
            }
        }
        let bytes = bytes.make_read_only()?;
        let table = Self {
            name,
            bytes,
            one_of_many: None,
        };
        table.check_values().map_err(TabulateError::Nothing)?;
        Ok(table)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{Material, Procedural, to_merl};

    #[test]
    fn a_table_of_nodes_is_the_one_that_is_written() {
        let material = &Procedural::set(1, 7)[0];
        let nodes = table_nodes();
        let brdf: Vec<[f32; 3]> = nodes.iter().map(|angles| material.brdf(*angles)).collect();
        let table = MerlTable::of_nodes("a".into(), &brdf).expect("all is known");
        let written = to_merl(material as &dyn Material).expect("it is finite");
        assert!(*table.bytes == *written);
        assert_eq!(table.name(), "a");
    }

    #[test]
    fn what_is_not_known_is_left_out() {
        let count = table_nodes().len();
        let mut brdf = vec![[0.5, 0.25, 0.125]; count];
        brdf[0] = [f32::NAN; 3];
        let table = MerlTable::of_nodes("a".into(), &brdf).expect("nearly all is known");
        let angles = Angles {
            theta_h: 0.0,
            theta_d: 0.005,
            phi_d: 0.1,
        };
        let found = table.brdf(angles);
        assert!((found[0] - 0.5).abs() < 1e-6 && (found[2] - 0.125).abs() < 1e-6);

        let refused = |brdf: &[[f32; 3]]| match MerlTable::of_nodes("a".into(), brdf) {
            Ok(_) => panic!("it is taken"),
            Err(error) => error,
        };
        let fewer = refused(&brdf[1..]);
        assert!(
            matches!(fewer, TabulateError::Count { found, expected } if (found, expected) == (count - 1, count)),
            "{fewer}"
        );
        brdf[3][1] = f32::INFINITY;
        let infinite = refused(&brdf);
        assert!(
            matches!(infinite, TabulateError::Infinite { index: 3, value } if value == f32::INFINITY),
            "{infinite}"
        );
        brdf.fill([f32::NAN, 1.0, 1.0]);
        let nothing = refused(&brdf);
        assert!(matches!(nothing, TabulateError::Nothing(_)), "{nothing}");
    }
}
