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
            octets.hx.0[lane] = at.hx;
            octets.hz.0[lane] = at.hz;
            octets.dx.0[lane] = at.dx;
            octets.dy.0[lane] = at.dy;
            octets.dz.0[lane] = at.dz;
        }
        octets
    }
}

/// The consecutive octets that lanes are loaded from. Only the first [`Lanes::OCTETS`](super::Lanes::OCTETS) are read.
pub type Octets<'a> = [&'a Octet; MAX_OCTETS];

/// The largest [`Lanes::OCTETS`](super::Lanes::OCTETS).
pub const MAX_OCTETS: usize = 4;
