//! Where a basis has its nodes: a whole one on a [`Grid`], a compact one where core has them.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear;

use super::Grid;
use super::grid::Corner;

/// How far apart, in radians, a compact basis is looked up for its derivatives, which core does not
/// have: far enough for directions in single precision, and less than a node is wide.
const APART: f64 = 1e-3;

/// The nodes of one of the two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Nodes {
    Whole,
    Compact(linear::Nodes),
}

impl Nodes {
    /// The eight nodes around some angles in radians, and the share of each.
    pub(super) fn corners(self, angles: Angles<f64>) -> [Corner; 8] {
        match self {
            Self::Whole => Grid::corners(angles),
            Self::Compact(nodes) => {
                let at = HalfDifference::from_angles(Angles {
                    theta_h: angles.theta_h as f32,
                    theta_d: angles.theta_d as f32,
                    phi_d: angles.phi_d as f32,
                });
                nodes.corners(&at).map(|corner| Corner {
                    node: corner.node,
                    weight: f64::from(corner.share),
                    derivatives: [0.0; 3],
                })
            }
        }
    }

    /// The same with the derivatives of shares: of a compact basis by differences, so that there are more
    /// nodes than eight, the same one several times.
    pub(super) fn with_derivatives(self, angles: Angles<f64>) -> Vec<Corner> {
        let mut corners = self.corners(angles).to_vec();
        if self == Self::Whole {
            return corners;
        }
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                let mut moved = [angles.theta_h, angles.theta_d, angles.phi_d];
                moved[axis] += side * 0.5 * APART;
                let [theta_h, theta_d, phi_d] = moved;
                let moved = Angles {
                    theta_h,
                    theta_d,
                    phi_d,
                };
                corners.extend(self.corners(moved).map(|corner| {
                    let mut derivatives = [0.0; 3];
                    derivatives[axis] = side * corner.weight / APART;
                    Corner {
                        node: corner.node,
                        weight: 0.0,
                        derivatives,
                    }
                }));
            }
        }
        corners
    }
}
