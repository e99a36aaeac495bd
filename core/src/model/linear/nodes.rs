//! The nodes of a compact basis, and those around a direction.
//!
//! The axes are not angles but smooth functions of them that need two kinds of arithmetic only,
//! divisions and square roots, all from 0 to 1:
//!
//! - u = sqrt(hx / sqrt(1 + hz)): u^2 is sqrt(2) sin(theta_h / 2), so that nodes are dense at
//!   highlights;
//! - v = 1 - dz = 1 - cos(theta_d): dense towards grazing angles;
//! - p = sqrt(min(dy^2 / (s (s + |dx|)), min(cos(theta_i), cos(theta_o)) / (hz dz))), s =
//!   sin(theta_d): 0 in the plane of incidence or, where that is nearer, at the horizon; 1 across
//!   the plane of incidence.
//!
//! The third bends the grid along the horizon, so that no node lies below it. It is the same for
//! phi_d, -phi_d and phi_d + pi: a basis on these nodes is reciprocal and has the mirror symmetry
//! of an isotropic material, by construction.

use crate::geometry::HalfDifference;
use crate::numeric::math;

/// Below this sin(theta_d)^2 the azimuth of the difference vector has no meaning.
const POLE: f32 = 1e-12;

/// Number of nodes of a compact basis along each of its axes, two at least.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Nodes {
    /// Along u, which theta_h moves.
    pub theta_h: u16,
    /// Along v, which theta_d moves.
    pub theta_d: u16,
    /// Along p, which phi_d moves.
    pub phi_d: u16,
}

/// A node that takes part in an interpolation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Corner {
    /// Which one: (index along u times nodes along v + index along v) times nodes along p + index
    /// along p.
    pub node: usize,
    /// Its share, 0 to 1; the eight shares add up to 1.
    pub share: f32,
}

impl Nodes {
    /// Number of nodes; None if no memory could hold them.
    #[must_use]
    pub fn count(&self) -> Option<usize> {
        usize::from(self.theta_h)
            .checked_mul(usize::from(self.theta_d))?
            .checked_mul(usize::from(self.phi_d))
    }

    /// The eight nodes around a half and difference vector, trilinear.
    ///
    /// The vectors have to be of unit length and above the horizon
    /// ([`HalfDifference::is_valid`]); of others, NaNs among them, the answer is eight nodes
    /// without a meaning.
    #[must_use]
    pub fn corners(&self, at: &HalfDifference<f32>) -> [Corner; 8] {
        let [u, v, p] = place(at);
        let u = between(u, self.theta_h);
        let v = between(v, self.theta_d);
        let p = between(p, self.phi_d);
        let rows = usize::from(self.theta_d);
        let columns = usize::from(self.phi_d);
        let mut corners = [Corner::default(); 8];
        let mut places = corners.iter_mut();
        for u in u {
            for v in v {
                let row = u.node.saturating_mul(rows).saturating_add(v.node);
                for (p, corner) in p.into_iter().zip(&mut places) {
                    *corner = Corner {
                        node: row.saturating_mul(columns).saturating_add(p.node),
                        share: u.share * v.share * p.share,
                    };
                }
            }
        }
        corners
    }
}

/// u, v and p.
fn place(at: &HalfDifference<f32>) -> [f32; 3] {
    // The material is its own mirror image in the xz plane and in the yz plane.
    let (hx, dx) = (at.hx.abs(), at.dx.abs());
    let u = math::sqrt(hx / math::sqrt(1.0 + at.hz));
    let square = dx * dx + at.dy * at.dy;
    let across = if square > POLE {
        let sine = math::sqrt(square);
        at.dy * at.dy / (sine * (sine + dx))
    } else {
        1.0
    };
    let scale = at.hz * at.dz;
    let above = (scale - hx * dx) / scale;
    let least = if above < across { above } else { across };
    [u, 1.0 - at.dz, math::sqrt(least.max(0.0))]
}

/// The two nodes of an axis around a number from 0 to 1; what lies outside counts as the nearest
/// end.
fn between(place: f32, nodes: u16) -> [Corner; 2] {
    let cells = nodes.saturating_sub(1);
    let along = place.clamp(0.0, 1.0) * f32::from(cells);
    // A conversion cuts off what follows the point, and makes 0 of NaN.
    let low = (along as u16).min(cells.saturating_sub(1));
    let share = along - f32::from(low);
    [
        Corner {
            node: usize::from(low),
            share: 1.0 - share,
        },
        Corner {
            node: usize::from(low).saturating_add(1),
            share,
        },
    ]
}
