//! Eight numbers in memory, loaded as one SIMD vector.

use glimpse_core::geometry::HalfDifference;

/// The number of values in an [`Octet`].
pub const WIDTH: usize = 8;

/// Eight numbers in memory, aligned for loads of a whole vector.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(32))]
pub struct Octet(pub [f32; WIDTH]);

/// Half and difference vectors of eight samples.
pub type OctetDirections = HalfDifference<Octet>;

impl Octet {
    /// Transposes up to eight half and difference vectors; unused lanes repeat the last one.
    #[must_use]
    pub fn transpose(list: &[HalfDifference<f32>]) -> OctetDirections {
        let mut octets = OctetDirections::default();
        let Some(last) = list.last() else {
            return octets;
        };
        for lane in 0..WIDTH {
            let at = list.get(lane).unwrap_or(last);
            for (octet, value) in coordinates_mut(&mut octets).into_iter().zip(at.to_array()) {
                octet.0[lane] = value;
            }
        }
        octets
    }
}

/// Returns references to the coordinates hx, hz, dx, dy and dz.
#[inline(always)]
pub(crate) fn coordinates_mut<T>(at: &mut HalfDifference<T>) -> [&mut T; 5] {
    let HalfDifference { hx, hz, dx, dy, dz } = at;
    [hx, hz, dx, dy, dz]
}

/// The consecutive octets that lanes are loaded from. Only the first [`Lanes::OCTETS`](super::Lanes::OCTETS) are read.
pub type Octets<'a> = [&'a Octet; MAX_OCTETS];

/// The largest [`Lanes::OCTETS`](super::Lanes::OCTETS).
pub const MAX_OCTETS: usize = 8;
