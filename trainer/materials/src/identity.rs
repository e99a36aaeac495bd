//! Identity of a material: its name and a digest of its BRDF.

use std::f32::consts::{FRAC_PI_2, PI};

use glimpse_core::checksum::crc_32;
use glimpse_core::geometry::Angles;
use serde::{Deserialize, Serialize};

use crate::Material;
use crate::lists::indices;

/// The number of sampled values of each angle.
const STEPS: usize = 4;

/// The name of a material and the digest of its BRDF. Recipes list the identities of their training materials.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// The name.
    pub name: String,
    /// The digest of the BRDF; see [`digest`].
    pub digest: u32,
}

impl Identity {
    /// Returns the identity of a material.
    #[must_use]
    pub fn new(material: &dyn Material) -> Self {
        Self {
            name: material.name().to_owned(),
            digest: digest(material),
        }
    }

    /// Returns the identities of materials.
    #[must_use]
    pub fn list(materials: &[Box<dyn Material>]) -> Vec<Self> {
        materials
            .iter()
            .map(|material| Self::new(&**material))
            .collect()
    }
}

/// Returns the CRC-32 (ISO-HDLC) of a material's BRDF at 64 fixed directions, three little-endian f32 each.
///
/// Tables, networks and formulas all have a digest. It distinguishes different materials of the same name.
///
/// The digest depends on every bit of the values. A different math library may therefore change the digest of a network
/// or a formula.
#[must_use]
pub fn digest(material: &dyn Material) -> u32 {
    let bytes: Vec<u8> = directions()
        .flat_map(|angles| material.at_angles(angles))
        .flat_map(f32::to_le_bytes)
        .collect();
    crc_32(&bytes)
}

/// Returns the 64 directions, all above the horizon.
///
/// In radians, theta_h is between 0 and pi/2, with more values near 0, where highlights are. theta_d is between 0 and
/// pi/2 - theta_h, and phi_d between 0 and pi.
fn directions() -> impl Iterator<Item = Angles<f32>> {
    let middle = |step: usize| (step as f32 + 0.5) / STEPS as f32;
    (0..STEPS.pow(3)).map(move |index| {
        let [h, d, p] = indices(index, [STEPS; 3]).map(middle);
        let theta_h = FRAC_PI_2 * h * h;
        Angles {
            theta_h,
            theta_d: (FRAC_PI_2 - theta_h) * d,
            phi_d: PI * p,
        }
    })
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use glimpse_core::geometry::HalfDifference;

    use super::*;

    #[test]
    fn directions_are_distinct_and_above_the_horizon() {
        let distinct: HashSet<[u32; 3]> = directions()
            .map(|angles| {
                assert!(HalfDifference::from_angles(angles).is_valid());
                angles.to_array().map(f32::to_bits)
            })
            .collect();
        assert_eq!(distinct.len(), 64);
    }
}
