//! Which material it is: a name, and a digest of its BRDF.

use std::f32::consts::{FRAC_PI_2, PI};

use glimpse_core::geometry::Angles;

use crate::Material;

/// Steps of each angle at which a digest looks.
const STEPS: usize = 4;

/// A material by its name and the digest of its BRDF, as recipes list those that they learned from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Its name.
    pub name: String,
    /// See [`digest`].
    pub digest: u32,
}

impl Identity {
    /// Of a material.
    #[must_use]
    pub fn new(material: &dyn Material) -> Self {
        Self {
            name: material.name().to_owned(),
            digest: digest(material),
        }
    }
}

/// The CRC-32 (ISO-HDLC) of a material's BRDF at 64 fixed directions, three little-endian f32 for
/// each. So a table, a network and a formula all have one, and two materials of one name that are
/// not the same are told apart.
///
/// It is of bits: another mathematical library than this machine's may give a network or a formula
/// another digest.
#[must_use]
pub fn digest(material: &dyn Material) -> u32 {
    let bytes: Vec<u8> = directions()
        .flat_map(|angles| material.brdf(angles))
        .flat_map(f32::to_le_bytes)
        .collect();
    material.release();
    crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&bytes)
}

/// All of theta_h, dense where highlights are; theta_d up to where theta_h + theta_d would be at the
/// horizon; half a turn of phi_d.
fn directions() -> impl Iterator<Item = Angles<f32>> {
    let middle = |step: usize| (step as f32 + 0.5) / STEPS as f32;
    (0..STEPS.pow(3)).map(move |index| {
        let [h, d, p] =
            [index / STEPS / STEPS, index / STEPS, index].map(|step| middle(step % STEPS));
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
    use crate::Procedural;

    #[test]
    fn a_digest_looks_at_64_places_above_the_horizon() {
        let places: HashSet<[u32; 3]> = directions()
            .map(|angles| {
                assert!(HalfDifference::from_angles(angles).is_valid());
                [angles.theta_h, angles.theta_d, angles.phi_d].map(f32::to_bits)
            })
            .collect();
        assert_eq!(places.len(), 64);
    }

    /// A BRDF that is the same everywhere.
    struct Flat(f32);

    impl Material for Flat {
        fn name(&self) -> &str {
            "flat"
        }
        fn brdf(&self, _: Angles<f32>) -> [f32; 3] {
            [self.0; 3]
        }
        fn brdf_with_derivative(&self, angles: Angles<f32>) -> ([f32; 3], [[f32; 3]; 3]) {
            (self.brdf(angles), [[0.0; 3]; 3])
        }
    }

    #[test]
    fn a_digest_is_of_what_a_material_is_and_not_of_its_name() {
        // 768 bytes 0, whose CRC-32 anybody can compute.
        let zeros = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&[0; 768]);
        assert_eq!(digest(&Flat(0.0)), zeros);
        assert_ne!(digest(&Flat(f32::from_bits(1))), zeros);

        let set = Procedural::set(50, 0);
        let digests: HashSet<u32> = set.iter().map(|material| digest(material)).collect();
        assert_eq!(digests.len(), 50);
        assert_eq!(digest(&set[7]), digest(&Procedural::set(8, 0)[7]));
        assert_ne!(digest(&set[7]), digest(&Procedural::set(8, 1)[7]));
    }
}
