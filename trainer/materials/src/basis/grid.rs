//! The nodes that materials are tabulated at, and trilinear interpolation between them.

use std::f64::consts::{FRAC_PI_2, PI};

use glimpse_core::geometry::{Angles, HalfDifference};

/// Nodes along theta_h, denser towards 0 as in MERL's tables, along theta_d, and along phi_d,
/// which has period pi.
const NODES: [usize; 3] = [72, 46, 36];

/// The grid. All tables share it.
#[derive(Clone, Copy, Debug)]
pub struct Grid;

/// A node that takes part in an interpolation.
#[derive(Clone, Copy, Debug, Default)]
pub struct Corner {
    /// Which one.
    pub node: usize,
    /// Its share.
    pub weight: f64,
    /// The derivatives of its share by theta_h, theta_d and phi_d.
    pub derivatives: [f64; 3],
}

impl Grid {
    /// How many nodes there are.
    pub const LEN: usize = NODES[0] * NODES[1] * NODES[2];
    /// Its shape and kind, to recognise files by.
    pub const SHAPE: [u32; 3] = [NODES[0] as u32, NODES[1] as u32, NODES[2] as u32];

    /// The angles of a node, in radians.
    #[must_use]
    pub fn angles(node: usize) -> Angles<f64> {
        let [h, d, p] = [
            node / (NODES[1] * NODES[2]),
            node / NODES[2] % NODES[1],
            node % NODES[2],
        ];
        let share = |index: usize, nodes: usize| index as f64 / (nodes - 1) as f64;
        Angles {
            theta_h: FRAC_PI_2 * share(h, NODES[0]).powi(2),
            theta_d: FRAC_PI_2 * share(d, NODES[1]),
            phi_d: PI * p as f64 / NODES[2] as f64,
        }
    }

    /// True if both directions of a node are above the horizon.
    #[must_use]
    pub fn is_valid(node: usize) -> bool {
        let at = HalfDifference::from_angles(Self::angles(node));
        at.cos_theta_i() > 0.0 && at.cos_theta_o() > 0.0
    }

    /// The eight nodes around some angles in radians.
    #[must_use]
    pub fn corners(angles: Angles<f64>) -> [Corner; 8] {
        let last = |axis: usize| (NODES[axis] - 1) as f64;
        // Where the angles lie between the nodes of each axis, and how fast they move there.
        let share = (angles.theta_h / FRAC_PI_2).clamp(0.0, 1.0);
        let root = share.sqrt();
        // At the pole the root's slope is infinite; a large one will do.
        let slope = last(0) / (2.0 * root.max(1e-9) * FRAC_PI_2);
        let places = [
            (last(0) * root, slope),
            (
                last(1) * (angles.theta_d / FRAC_PI_2).clamp(0.0, 1.0),
                last(1) / FRAC_PI_2,
            ),
            (
                NODES[2] as f64 * (angles.phi_d / PI).rem_euclid(1.0),
                NODES[2] as f64 / PI,
            ),
        ];
        let mut axes = [[(0, 0.0, 0.0); 2]; 3];
        for (axis, (place, slope)) in places.into_iter().enumerate() {
            // phi_d goes round; the others end at their last node.
            let cells = if axis == 2 { NODES[2] } else { NODES[axis] - 1 };
            let low = (place.floor() as usize).min(cells - 1);
            let high = (low + 1) % if axis == 2 { cells } else { NODES[axis] };
            let between = place - low as f64;
            axes[axis] = [(low, 1.0 - between, -slope), (high, between, slope)];
        }
        let mut corners = [Corner::default(); 8];
        for (index, corner) in corners.iter_mut().enumerate() {
            let (h, a, by_h) = axes[0][index / 4];
            let (d, b, by_d) = axes[1][index / 2 % 2];
            let (p, c, by_p) = axes[2][index % 2];
            *corner = Corner {
                node: (h * NODES[1] + d) * NODES[2] + p,
                weight: a * b * c,
                derivatives: [by_h * b * c, a * by_d * c, a * b * by_p],
            };
        }
        corners
    }
}
