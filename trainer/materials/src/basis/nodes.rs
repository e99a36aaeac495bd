//! The nodes of a basis: those of [`Grid`] for a whole basis, and [`linear::Nodes`] for a compact basis.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear;

use super::Grid;
use super::grid::Corner;

/// The step of difference quotients, in radians. They replace the derivatives of a compact basis, which core does not
/// compute. The step is large compared with the rounding of angles to f32, and smaller than the distance between nodes.
const STEP: f64 = 1e-3;

/// The nodes of a whole or a compact basis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Nodes {
    Whole,
    Compact(linear::Nodes),
}

impl Nodes {
    /// Returns the eight nodes around angles in radians, each with its weight. The derivatives are set for a whole
    /// basis, and are 0 for a compact basis.
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
                    weight: f64::from(corner.weight),
                    derivatives: [0.0; 3],
                })
            }
        }
    }

    /// Returns the nodes around angles in radians, with weights and their derivatives. For a compact basis, the list
    /// also has the nodes around moved angles, with weight 0. Sums over all nodes then yield difference quotients as
    /// derivatives.
    pub(super) fn corners_with_derivatives(self, angles: Angles<f64>) -> Vec<Corner> {
        let mut corners = self.corners(angles).to_vec();
        if self == Self::Whole {
            return corners;
        }
        for axis in 0..3 {
            for sign in [-1.0, 1.0] {
                let mut moved = [angles.theta_h, angles.theta_d, angles.phi_d];
                moved[axis] += sign * 0.5 * STEP;
                let [theta_h, theta_d, phi_d] = moved;
                let moved = Angles {
                    theta_h,
                    theta_d,
                    phi_d,
                };
                corners.extend(self.corners(moved).map(|corner| {
                    let mut derivatives = [0.0; 3];
                    derivatives[axis] = sign * corner.weight / STEP;
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
