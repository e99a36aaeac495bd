//! The nodes of a basis, and trilinear interpolation between them: those of [`Grid`] in a training, and [`linear::Nodes`]
//! in a file.

use crate::lists::indices;
use std::f64::consts::{FRAC_PI_2, PI};

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear;
use glimpse_kernels::AngleDual;
use glimpse_kernels::dual::RealScalar;

use crate::interpolation::products;

/// The number of nodes along theta_h (denser towards 0, as in MERL tables), theta_d, and phi_d (with period pi).
const NODES: [usize; 3] = [72, 46, 36];

/// The grid of every basis in a training.
#[derive(Clone, Copy, Debug)]
pub struct Grid;

/// The index of a node, and its weight in an interpolation, which may have derivatives.
pub type WeightedNode<S> = (usize, S);

impl Grid {
    /// The number of nodes.
    pub const LEN: usize = NODES[0] * NODES[1] * NODES[2];

    /// Returns the angles of a node, in radians.
    #[must_use]
    pub fn angles(node: usize) -> Angles<f64> {
        let [h, d, p] = indices(node, NODES);
        let fraction = |index: usize, nodes: usize| index as f64 / (nodes - 1) as f64;
        Angles {
            theta_h: FRAC_PI_2 * fraction(h, NODES[0]).powi(2),
            theta_d: FRAC_PI_2 * fraction(d, NODES[1]),
            phi_d: PI * p as f64 / NODES[2] as f64,
        }
    }

    /// Returns true if both directions of a node are above the horizon.
    #[must_use]
    pub fn is_valid(node: usize) -> bool {
        let at = HalfDifference::from_angles(Self::angles(node));
        at.cos_theta_i() > 0.0 && at.cos_theta_o() > 0.0
    }

    /// Returns the eight nodes around angles in radians, with their weights.
    #[must_use]
    pub fn corners<S: RealScalar>(angles: Angles<S>) -> [WeightedNode<S>; 8] {
        let last_node = |axis: usize| (NODES[axis] - 1) as f64;
        let [h, d, p] = angles.to_array().map(S::value);
        let root = (h / FRAC_PI_2).clamp(0.0, 1.0).sqrt();
        // The derivative is infinite at the pole, and is limited to a large value.
        let derivative_h = last_node(0) / (2.0 * root.max(1e-9) * FRAC_PI_2);
        let position_d = last_node(1) * (d / FRAC_PI_2).clamp(0.0, 1.0);
        let position_p = NODES[2] as f64 * (p / PI).rem_euclid(1.0);
        // The two nodes along each axis, with their weights. `position` is the position of the angle along the axis in
        // units of nodes, and `derivative` its derivative with respect to the angle.
        let neighbors = |axis: usize, angle: S, position: f64, derivative: f64| {
            // phi_d is periodic. The other axes end at their last node.
            let cells = if axis == 2 { NODES[2] } else { NODES[axis] - 1 };
            let low = (position.floor() as usize).min(cells - 1);
            let high = (low + 1) % if axis == 2 { cells } else { NODES[axis] };
            let moved = (angle - S::constant(angle.value())) * S::constant(derivative);
            let weight = S::constant(position - low as f64) + moved;
            [(low, S::constant(1.0) - weight), (high, weight)]
        };
        let h = neighbors(0, angles.theta_h, last_node(0) * root, derivative_h);
        let d = neighbors(1, angles.theta_d, position_d, last_node(1) / FRAC_PI_2);
        let p = neighbors(2, angles.phi_d, position_p, NODES[2] as f64 / PI);
        products([h, d, p]).map(|([h, d, p], weight)| ((h * NODES[1] + d) * NODES[2] + p, weight))
    }
}

/// The step of difference quotients, in radians. They replace derivatives between core's nodes, which core does not
/// compute. The step is large compared with the rounding of angles to f32, and smaller than the distance between nodes
/// outside of highlights.
pub(super) const STEP: f64 = 1e-3;

/// The nodes of a basis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Nodes {
    Grid,
    File(linear::Nodes),
}

impl Nodes {
    /// Returns the eight nodes around angles in radians, each with its weight.
    pub(super) fn corners(self, angles: Angles<f64>) -> [WeightedNode<f64>; 8] {
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
    pub(super) fn corners_with_derivatives(
        self,
        angles: Angles<f64>,
    ) -> Vec<WeightedNode<AngleDual<f64>>> {
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
