//! The nodes of a basis: those of [`Grid`] in a training, and [`linear::Nodes`] in a file.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear;

use super::angles::AngleDual;
use super::grid::{Corner, Grid};

/// The step of difference quotients, in radians. They replace derivatives between core's nodes, which core does not
/// compute. The step is large compared with the rounding of angles to f32, and smaller than the distance between nodes
/// outside of highlights.
const STEP: f64 = 1e-3;

/// The nodes of a basis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Nodes {
    Grid,
    File(linear::Nodes),
}

impl Nodes {
    /// Returns the eight nodes around angles in radians, each with its weight.
    pub(super) fn corners(self, angles: Angles<f64>) -> [Corner<f64>; 8] {
        match self {
            Self::Grid => Grid::corners(angles),
            Self::File(nodes) => {
                let at = HalfDifference::from_angles(angles.map(|angle| angle as f32));
                nodes
                    .corners(&at)
                    .map(|corner| (corner.node, f64::from(corner.weight)))
            }
        }
    }

    /// Returns the nodes around angles in radians, with weights and their derivatives. For a file, the list
    /// also has the nodes around moved angles, with weight 0. Sums over all nodes then yield difference quotients as
    /// derivatives.
    pub(super) fn corners_with_derivatives(self, angles: Angles<f64>) -> Vec<Corner<AngleDual>> {
        let variables = AngleDual::variables(angles);
        if self == Self::Grid {
            return Grid::corners(variables).to_vec();
        }
        let values = self.corners(angles);
        let mut corners = values
            .map(|(node, weight)| (node, AngleDual::from_value(weight)))
            .to_vec();
        for axis in 0..3 {
            for sign in [-1.0, 1.0] {
                let moved =
                    variables.map(|angle| angle.value + angle.tangent[axis] * sign * 0.5 * STEP);
                corners.extend(self.corners(moved).map(|(node, value)| {
                    let mut weight = AngleDual::from_value(0.0);
                    weight.tangent[axis] = sign * value / STEP;
                    (node, weight)
                }));
            }
        }
        corners
    }
}
