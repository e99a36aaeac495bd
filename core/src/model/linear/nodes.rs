//! The nodes of a compact basis, and the interpolation between them.
//!
//! The axes are smooth functions of the angles, from 0 to 1. They need only divisions and square roots, no
//! trigonometric functions:
//!
//! - u = sqrt(hx / sqrt(1 + hz)). u^2 is sqrt(2) sin(theta_h / 2), so that nodes are dense at highlights.
//! - v = 1 - dz = 1 - cos(theta_d), dense towards grazing angles.
//! - p = sqrt(min(dy^2 / (s (s + |dx|)), min(cos(theta_i), cos(theta_o)) / (hz dz))), s = sin(theta_d). p is 0 in the
//!   plane of incidence and at the horizon, and 1 perpendicular to the plane of incidence.
//!
//! p bends the grid along the horizon, so that no node lies below it. It is equal for phi_d, -phi_d and phi_d + pi. A
//! basis on these nodes is therefore reciprocal, and has the mirror symmetry of an isotropic material.

use crate::geometry::HalfDifference;
use crate::numeric::math;

/// The sin(theta_d)^2 below which the azimuth of the difference vector is undefined.
const POLE: f32 = 1e-12;

/// Number of nodes of a compact basis along each of its axes, at least two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Nodes {
    /// Along u, a function of theta_h.
    pub theta_h: u16,
    /// Along v, a function of theta_d.
    pub theta_d: u16,
    /// Along p, which depends most on phi_d.
    pub phi_d: u16,
}

/// A node that takes part in an interpolation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Corner {
    /// Index of the node: (index along u times nodes along v + index along v) times nodes along p + index along p.
    pub node: usize,
    /// Weight in the interpolation, 0 to 1. The eight weights add up to 1.
    pub weight: f32,
}

impl Nodes {
    /// Number of nodes; None if it overflows.
    #[must_use]
    pub fn count(&self) -> Option<usize> {
        usize::from(self.theta_h)
            .checked_mul(usize::from(self.theta_d))?
            .checked_mul(usize::from(self.phi_d))
    }

    /// The eight nodes around half and difference vectors, with the weights of trilinear interpolation.
    ///
    /// The vectors have to be of unit length and above the horizon ([`HalfDifference::is_valid`]). For other vectors
    /// and NaNs, the eight nodes are meaningless.
    #[must_use]
    pub fn corners(&self, at: &HalfDifference<f32>) -> [Corner; 8] {
        let [u, v, p] = coordinates(at);
        let u = neighbors(u, self.theta_h);
        let v = neighbors(v, self.theta_d);
        let p = neighbors(p, self.phi_d);
        let rows = usize::from(self.theta_d);
        let columns = usize::from(self.phi_d);
        let mut corners = [Corner::default(); 8];
        let mut remaining = corners.iter_mut();
        for u in u {
            for v in v {
                let row = u.node.saturating_mul(rows).saturating_add(v.node);
                for (p, corner) in p.into_iter().zip(&mut remaining) {
                    *corner = Corner {
                        node: row.saturating_mul(columns).saturating_add(p.node),
                        weight: u.weight * v.weight * p.weight,
                    };
                }
            }
        }
        corners
    }
}

/// Returns u, v and p.
fn coordinates(at: &HalfDifference<f32>) -> [f32; 3] {
    // The material is its own mirror image in the xz plane and in the yz plane.
    let (hx, dx) = (at.hx.abs(), at.dx.abs());
    let u = math::sqrt(hx / math::sqrt(1.0 + at.hz));
    let square = dx * dx + at.dy * at.dy;
    let azimuth_term = if square > POLE {
        let sine = math::sqrt(square);
        at.dy * at.dy / (sine * (sine + dx))
    } else {
        1.0
    };
    let scale = at.hz * at.dz;
    let horizon_term = (scale - hx * dx) / scale;
    let smaller = if horizon_term < azimuth_term {
        horizon_term
    } else {
        azimuth_term
    };
    [u, 1.0 - at.dz, math::sqrt(smaller.max(0.0))]
}

/// Returns the two nodes of one axis around a coordinate, with indices along this axis. The coordinate is clamped to 0
/// to 1.
fn neighbors(coordinate: f32, nodes: u16) -> [Corner; 2] {
    let cells = nodes.saturating_sub(1);
    let position = coordinate.clamp(0.0, 1.0) * f32::from(cells);
    // The conversion truncates, and turns NaN into 0.
    let low = (position as u16).min(cells.saturating_sub(1));
    let weight = position - f32::from(low);
    [
        Corner {
            node: usize::from(low),
            weight: 1.0 - weight,
        },
        Corner {
            node: usize::from(low).saturating_add(1),
            weight,
        },
    ]
}
