//! Eight numbers in memory.

use glimpse_core::geometry::HalfDifference;

/// How many numbers an [`Octet`] holds.
pub const WIDTH: usize = 8;

/// Eight numbers in memory, aligned so that they load as one vector.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(32))]
pub struct Octet(pub [f32; WIDTH]);

/// Half and difference vectors of eight samples.
pub type OctetAt = HalfDifference<Octet>;

impl Octet {
    /// Transposes up to eight half and difference vectors; missing ones repeat the last.
    #[must_use]
    pub fn transpose(list: &[HalfDifference<f32>]) -> OctetAt {
        let mut octets = OctetAt::default();
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

/// Where the lanes of a register come from: one octet after the other, as many of them as it has.
pub type Octets<'a> = [&'a Octet; MOST_OCTETS];

/// The largest number of octets in `Lanes`.
pub const MOST_OCTETS: usize = 4;
