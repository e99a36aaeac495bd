//! Linear interpolation between nodes.

use glimpse_core::numeric::Scalar;
use glimpse_kernels::dual::RealScalar;

/// Interpolates linearly: `a` at fraction 0, `b` at fraction 1.
#[inline(always)]
pub(crate) fn mix<S: Scalar>(a: S, b: S, fraction: S) -> S {
    a.plus_product(b - a, fraction)
}

/// A position between two neighboring nodes.
#[derive(Clone, Copy)]
pub(crate) struct Position<S> {
    /// Indices of the lower and the upper node. They are equal outside the range of the nodes.
    pub(crate) nodes: [usize; 2],
    /// The weights of both nodes.
    pub(crate) weights: [S; 2],
}

impl<S: RealScalar> Position<S> {
    /// Returns the position of `coordinate` among increasing `nodes`. Outside their range, this is the first or last
    /// node.
    #[inline(always)]
    pub(crate) fn new(coordinate: S, nodes: &[impl Copy + Into<f64>]) -> Self {
        let value = coordinate.value();
        let after = nodes.partition_point(|node| (*node).into() <= value);
        let low = after.saturating_sub(1);
        match (nodes.get(low), nodes.get(after)) {
            (Some(begin), Some(end)) if after > 0 => {
                let (begin, end): (f64, f64) = ((*begin).into(), (*end).into());
                let distances = [
                    S::constant(end) - coordinate,
                    coordinate - S::constant(begin),
                ];
                Self {
                    nodes: [low, after],
                    weights: distances.map(|distance| distance * S::constant(1.0 / (end - begin))),
                }
            }
            _ => Self {
                nodes: [low; 2],
                weights: [1.0, 0.0].map(S::constant),
            },
        }
    }

    /// Returns the position of a coordinate in \[0, 1\] among a number of evenly spaced nodes, at least 2.
    #[inline(always)]
    pub(crate) fn uniform(coordinate: S, nodes: usize) -> Self {
        let position = coordinate * S::constant((nodes - 1) as f64);
        let low = (position.value() as usize).min(nodes - 2);
        let fraction = position - S::constant(low as f64);
        Self {
            nodes: [low, low + 1],
            weights: [S::constant(1.0) - fraction, fraction],
        }
    }

    /// Interpolates a function of the node linearly.
    #[inline(always)]
    pub(crate) fn mix(&self, value: impl Fn(usize) -> S) -> S {
        let [low, high] = self.nodes.map(value);
        mix(low, high, self.weights[1])
    }

    /// Returns both nodes with their weights.
    #[inline(always)]
    pub(crate) fn weights(&self) -> [(usize, S); 2] {
        let [low, high] = self.nodes;
        [(low, self.weights[0]), (high, self.weights[1])]
    }
}

/// Returns the eight nodes around a point of a grid, as indices along each axis, with their weights.
#[inline(always)]
pub(crate) fn corners<S: RealScalar>(
    point: [S; 3],
    axes: &[Vec<impl Copy + Into<f64>>; 3],
) -> [([usize; 3], S); 8] {
    products([0, 1, 2].map(|axis| Position::new(point[axis], &axes[axis]).weights()))
}

/// Returns the eight combinations of two nodes along each axis, with the products of their weights.
#[inline(always)]
pub(crate) fn products<S: Scalar>([a, b, c]: [[(usize, S); 2]; 3]) -> [([usize; 3], S); 8] {
    std::array::from_fn(|index| {
        let [(a, weight_a), (b, weight_b), (c, weight_c)] =
            [a[index / 4], b[index / 2 % 2], c[index % 2]];
        ([a, b, c], weight_a * weight_b * weight_c)
    })
}
