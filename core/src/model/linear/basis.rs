//! The compact basis, which turns coefficients into a BRDF on the device.

use super::format::{FORMAT, MAX_COMPONENTS, NODE_HEAD_BYTES, SHAPE_BYTES};
use super::{Nodes, unmap};
use crate::error::{Error, ErrorCode};
use crate::geometry::{HalfDifference, UNIT_TOLERANCE};
use crate::numeric::Floats;

/// The largest deviation of a vector's squared length from 1: twice the tolerance of its length.
const SQUARED_LENGTH_TOLERANCE: f32 = 2.0 * UNIT_TOLERANCE;

/// A valid compact basis in memory or in flash: principal components of the training materials on a coarse grid, as
/// bytes.
///
/// One file serves all recipes that were trained with the same basis, for any n. [`Basis::checksum`] equals the
/// `basis_checksum` of such a recipe. The format is documented in
/// [`docs/basis.md`](https://docs.rs/crate/glimpse-core/latest/source/docs/basis.md).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Basis<'a> {
    checksum: u32,
    nodes: Nodes,
    mean_scale: f32,
    /// A scale for each component.
    scales: Floats<'a>,
    /// For each node: its mean, the scale of its row, and the row: a signed byte for each component.
    table: &'a [u8],
}

/// A node's entries, and its weight in an interpolation.
struct Row<'a> {
    /// The weight times the row's scale.
    weight: f32,
    entries: core::slice::Iter<'a, u8>,
}

impl<'a> Basis<'a> {
    /// Reads a compact basis in place.
    ///
    /// # Errors
    /// The first defect of the bytes: [`ErrorCode::BasisMagic`] to [`ErrorCode::BasisMalformed`].
    pub fn parse(bytes: &'a [u8]) -> Result<Self, Error> {
        let (_, mut body) = FORMAT.read(bytes)?;
        let malformed = |field| Error::in_field(ErrorCode::BasisMalformed, field);
        let checksum = body.u32();
        let components = body.u16();
        if !(1..=MAX_COMPONENTS).contains(&components) {
            return Err(malformed("basis.components"));
        }
        let nodes = Nodes {
            theta_h: body.u16(),
            theta_d: body.u16(),
            phi_d: body.u16(),
        };
        let mean_scale = f32::from_le_bytes(body.take());
        let components = usize::from(components);
        let table_length = nodes
            .count()
            .filter(|_| nodes.theta_h.min(nodes.theta_d).min(nodes.phi_d) >= 2)
            .and_then(|count| count.checked_mul(components.saturating_add(NODE_HEAD_BYTES)))
            .ok_or(malformed("basis.nodes"))?;
        let scales_length = components.saturating_mul(size_of::<f32>());
        let lists_length = scales_length.saturating_add(table_length);
        let wrong_length =
            FORMAT.length_error(lists_length.saturating_add(SHAPE_BYTES), bytes.len());
        let lists = body.0.split_at_checked(scales_length);
        let (scales, table) = lists
            .filter(|(_, table)| table.len() == table_length)
            .ok_or(wrong_length)?;
        let scales = Floats::new(scales);
        let mut all = scales.iter().chain([mean_scale]);
        if !all.all(|scale| scale.is_finite() && scale >= 0.0) {
            return Err(malformed("basis.scales"));
        }
        Ok(Self {
            checksum,
            nodes,
            mean_scale,
            scales,
            table,
        })
    }

    /// Number of components.
    #[must_use]
    pub fn components(&self) -> usize {
        self.scales.len()
    }

    /// The number of nodes along each axis.
    #[must_use]
    pub fn nodes(&self) -> Nodes {
        self.nodes
    }

    /// The checksum of the basis, the same at any nodes and with any number of components. Only coefficients of recipes
    /// with this `basis_checksum` belong to it.
    #[must_use]
    pub fn checksum(&self) -> u32 {
        self.checksum
    }

    /// The BRDF in linear RGB, sr^-1, not times the cosine. It is finite and not negative.
    ///
    /// `coefficients` are the result of a fit of the model Linear: those of red, green and blue. A compact basis may
    /// have fewer components than the fit: it ignores further coefficients, and most of its loss of accuracy is due to
    /// this. Missing coefficients count as 0.
    ///
    /// None if `at` is below the horizon, if its vectors are not of unit length, or if the BRDF is not finite, because
    /// a coefficient is too large or NaN.
    #[must_use]
    pub fn brdf(&self, coefficients: [&[f32]; 3], at: &HalfDifference<f32>) -> Option<[f32; 3]> {
        if !(at.is_valid() && is_unit(at)) {
            return None;
        }
        let (mean, components) = self.look_up(at)?;
        let mut mapped = [mean; 3];
        let mut channels = coefficients.map(<[f32]>::iter);
        for component in components {
            for (mapped, channel) in mapped.iter_mut().zip(&mut channels) {
                *mapped += component * channel.next().copied().unwrap_or_default();
            }
        }
        let weight = at.cos_theta_i() * at.cos_theta_o();
        let brdf = mapped.map(|mapped| unmap(mapped, weight));
        brdf.iter().all(|value| value.is_finite()).then_some(brdf)
    }

    /// Returns the mean and an iterator over the components at half and difference vectors of unit length. The mean is
    /// that of ln(1 + f w / e) over the training columns, with the BRDF f and w = cos(theta_i) cos(theta_o). Below the
    /// horizon, it returns the values at the horizon. The result is never None.
    #[must_use]
    #[inline]
    pub fn look_up(&self, at: &HalfDifference<f32>) -> Option<(f32, impl Iterator<Item = f32>)> {
        let mut mean = 0.0;
        let [a, b, c, d, e, f, g, h] = self.nodes.corners(at).map(|corner| {
            let (value, scale, row) = self.node(corner.node)?;
            mean += corner.weight * value;
            Some(Row {
                weight: corner.weight * scale,
                entries: row.iter(),
            })
        });
        let mut rows = [a?, b?, c?, d?, e?, f?, g?, h?];
        let components = self.scales.iter().map(move |scale| {
            let mut component = 0.0;
            for row in &mut rows {
                let entry = row.entries.next().copied().unwrap_or_default();
                component += row.weight * f32::from(entry.cast_signed());
            }
            component * scale
        });
        Some((mean, components))
    }

    /// Returns the mean and the components at a node of the grid. None if the index is too large.
    #[cfg(feature = "training")]
    #[must_use]
    pub fn at_node(&self, node: usize) -> Option<(f32, impl Iterator<Item = f32>)> {
        let (mean, row_scale, row) = self.node(node)?;
        let entries = row.iter().zip(self.scales.iter());
        let components =
            entries.map(move |(entry, scale)| row_scale * f32::from(entry.cast_signed()) * scale);
        Some((mean, components))
    }

    /// A node's mean, its row's scale, and its row.
    fn node(&self, index: usize) -> Option<(f32, f32, &'a [u8])> {
        let length = self.components().saturating_add(NODE_HEAD_BYTES);
        let start = index.saturating_mul(length);
        let node = self.table.get(start..start.saturating_add(length))?;
        let ([m0, m1, s0, s1], row) = node.split_first_chunk()?;
        let mean = f32::from(i16::from_le_bytes([*m0, *m1])) * self.mean_scale;
        Some((mean, f32::from(u16::from_le_bytes([*s0, *s1])), row))
    }
}

fn is_unit(at: &HalfDifference<f32>) -> bool {
    let half = at.hx * at.hx + at.hz * at.hz;
    let difference = at.dx * at.dx + at.dy * at.dy + at.dz * at.dz;
    (half - 1.0).abs() < SQUARED_LENGTH_TOLERANCE
        && (difference - 1.0).abs() < SQUARED_LENGTH_TOLERANCE
}
