//! The tabulated basis: mean, median and principal components of mapped materials.
//!
//! A column is one channel of a training material. In formulas, f is the BRDF, w is cos(theta_i) cos(theta_o), e is
//! [`EPSILON`], and m is the number of components.

use crate::lists::{add_scaled, dot};
use std::io;
use std::path::{Path, PathBuf};

use glimpse_core::checksum::crc_32;
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::{Basis as CompactBasis, EPSILON, unmap};
use glimpse_core::numeric::Scalar;
use glimpse_kernels::AngleDual;
use rayon::prelude::*;

use super::grid::{Nodes, STEP, WeightedNode};
use super::kernels::{KernelSum, Kernels};
use crate::untrusted::read_at_most;

/// The number of values before the components of a node: the mean of the mapped columns, and ln(median w + e).
pub const NODE_HEADER: usize = 2;
/// The largest length of a file in bytes, twice that of 1,024 components at the nodes that a training writes.
const MAX_BYTES: u64 = 1 << 28;

/// An error while reading a basis file.
#[derive(Debug, thiserror::Error)]
pub enum BasisError {
    /// The operating system cannot read the file.
    #[error(
        "cannot read the basis {}: {source}; put the basis that was written with the recipe into the recipe's \
         directory", path.display()
    )]
    Read {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// The file is damaged, or is not the basis of the recipe.
    #[error(
        "{} is not the basis of this recipe ({defect}); replace it with the file that was written with the recipe",
        path.display()
    )]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The defect.
        defect: &'static str,
    },
}

/// The table of a basis. Each node has a mean, ln(median w + e), and m components. During a training, the nodes are those
/// of [`Grid`](super::Grid); in a file, they are [`Nodes`](glimpse_core::model::linear::Nodes).
#[derive(Clone, Debug, PartialEq)]
pub struct BasisTable {
    nodes: Nodes,
    table: Vec<f32>,
    components: usize,
    /// The kernels of a material, after the components; empty without readings at any directions.
    kernels: Kernels,
    /// The bytes of the file; empty for a basis without one.
    file: Vec<u8>,
}

/// The values of a basis at a pair of directions. Each array holds a value and its derivatives with respect to theta_h,
/// theta_d and phi_d.
#[derive(Clone, Debug)]
pub struct BasisValues {
    /// The mean of ln((f w + e) / e) over the columns. It is subtracted from mapped readings.
    pub center: [f64; 4],
    /// The components.
    pub components: Vec<[f64; 4]>,
}

impl BasisTable {
    /// Makes a basis from a table that holds the mean, ln(median w + e) and m components of each node of [`Grid`](super::Grid).
    #[must_use]
    pub fn from_table(table: Vec<f32>, components: usize) -> Self {
        Self {
            nodes: Nodes::Grid,
            table,
            components,
            kernels: Kernels::default(),
            file: Vec::new(),
        }
    }

    /// Returns the basis with the kernels of a material, which have coefficients after those of the components.
    #[must_use]
    pub fn with_kernels(&self, kernels: Kernels) -> Self {
        Self {
            kernels,
            ..self.clone()
        }
    }

    /// Returns the kernels.
    #[must_use]
    pub fn kernels(&self) -> &Kernels {
        &self.kernels
    }

    /// Returns the number of coefficients of a channel: of m components, and of the kernels of a material.
    #[must_use]
    pub fn coefficients(&self) -> usize {
        self.components + self.kernels.directions.len()
    }

    /// Replaces the components of a basis without a file by combinations of them: a column of the square matrix `map` holds the
    /// weights of all components in one combination.
    #[must_use]
    pub fn mapped(mut self, map: &[f32]) -> Self {
        for row in self.table.chunks_exact_mut(NODE_HEADER + self.components) {
            let components = row[NODE_HEADER..].to_vec();
            let columns = map.chunks_exact(self.components);
            for (entry, column) in row[NODE_HEADER..].iter_mut().zip(columns) {
                *entry = dot(&components, column);
            }
        }
        self
    }

    /// Returns the number of components, m.
    #[must_use]
    pub fn components(&self) -> usize {
        self.components
    }

    /// Returns the row of a node: the mean, ln(median w + e), and m components.
    ///
    /// # Panics
    /// If the node does not exist.
    #[must_use]
    pub fn row(&self, node: usize) -> &[f32] {
        let length = NODE_HEADER + self.components;
        &self.table[node * length..][..length]
    }

    /// Interpolates the basis at angles in radians, with derivatives with respect to theta_h, theta_d and phi_d.
    #[must_use]
    pub fn look_up(&self, angles: Angles<f64>) -> BasisValues {
        let mut sums = vec![[0.0_f64; 4]; NODE_HEADER + self.components];
        for (node, weight) in self.nodes.corners_with_derivatives(angles) {
            let [h, d, p] = weight.tangent;
            let weights = [weight.value, h, d, p];
            for (sum, value) in sums.iter_mut().zip(self.row(node)) {
                add_scaled(sum, f64::from(*value), &weights);
            }
        }
        let components = sums.split_off(NODE_HEADER);
        let mut center = std::array::from_fn(|i| sums[0][i] + sums[1][i]);
        center[0] -= EPSILON.ln();
        BasisValues { center, components }
    }

    /// Tabulates the BRDF of [coefficients](Self::coefficients): those of red, then of green, then of blue. None if their
    /// number is another one.
    #[must_use]
    pub fn reconstruct(&self, coefficients: &[f32]) -> Option<Reconstruction> {
        if coefficients.len() != 3 * self.coefficients() {
            return None;
        }
        let lists = [0, 1, 2].map(|channel| {
            let list = &coefficients[channel * self.coefficients()..][..self.coefficients()];
            list.split_at(self.components)
        });
        let rows = || self.table.par_chunks_exact(NODE_HEADER + self.components);
        let table = rows().map(|row| {
            let (header, components) = row.split_at(NODE_HEADER);
            lists.map(|(coefficients, _)| {
                let products = components.iter().zip(coefficients);
                let sum: f64 = products.map(|(a, c)| f64::from(*a) * f64::from(*c)).sum();
                (sum + f64::from(header[0])) as f32
            })
        });
        Some(Reconstruction {
            nodes: self.nodes,
            table: table.collect(),
            log_medians: rows().map(|row| row[1]).collect(),
            kernels: self.kernels.sum(lists.map(|(_, weights)| weights)),
        })
    }

    /// Returns the bytes of the file. They are empty for a basis that was not read from one.
    #[must_use]
    pub fn file(&self) -> &[u8] {
        &self.file
    }

    /// Returns the number that a recipe and the files of its basis have in common, at any nodes and with any number of
    /// components: the CRC-32 of the table at the nodes of [`Grid`](super::Grid). 0 means that a recipe has no basis, so that a CRC-32 of 0
    /// is replaced by 1.
    #[must_use]
    pub fn checksum(&self) -> u32 {
        if let Ok(basis) = CompactBasis::parse(&self.file) {
            return basis.checksum();
        }
        let bytes = self.table.iter().flat_map(|value| value.to_le_bytes());
        crc_32(&bytes.collect::<Vec<u8>>()).max(1)
    }

    /// Returns the path of a recipe's basis.
    #[must_use]
    pub fn path_for(recipe: &Path) -> PathBuf {
        recipe.with_extension("basis")
    }

    /// Reads a basis with the checksum in a recipe.
    ///
    /// # Errors
    /// If the file cannot be read or is damaged, or the checksum differs.
    pub fn read(path: &Path, checksum: u32) -> Result<Self, BasisError> {
        let damaged = |defect| BasisError::Damaged {
            path: path.into(),
            defect,
        };
        // An untrusted material.json may refer to a device that never ends, such as /dev/zero.
        let bytes = match path.exists() && !path.is_file() {
            true => Err(io::Error::other("it is not a regular file")),
            false => read_at_most(path, MAX_BYTES),
        };
        let bytes = bytes.map_err(|source| BasisError::Read {
            path: path.into(),
            source,
        })?;
        Self::parse_for(&bytes, checksum).map_err(damaged)
    }

    /// Parses a basis with the checksum in a recipe.
    ///
    /// # Errors
    /// A description of the defect, if the bytes are not a basis or the checksum differs.
    pub fn parse_for(bytes: &[u8], checksum: u32) -> Result<Self, &'static str> {
        let basis = Self::parse(bytes)?;
        if basis.checksum() == checksum {
            Ok(basis)
        } else {
            Err("its checksum differs")
        }
    }

    /// Parses a basis. It is interpolated in the same way as on a device.
    ///
    /// # Errors
    /// A description of the defect, if the bytes are not a basis.
    pub fn parse(bytes: &[u8]) -> Result<Self, &'static str> {
        let damaged = "it is not a basis, or was cut short or altered";
        let basis = CompactBasis::parse(bytes).map_err(|_| damaged)?;
        let nodes = basis.nodes();
        let mut table = Vec::new();
        for node in 0..nodes.count().ok_or(damaged)? {
            let (mean, components) = basis.at_node(node).ok_or(damaged)?;
            // A file uses the mapping with median 0, so that ln(median w + e) is ln(e).
            table.extend([mean, EPSILON.ln() as f32]);
            table.extend(components);
        }
        Ok(Self {
            nodes: Nodes::File(nodes),
            table,
            components: basis.components(),
            kernels: Kernels::default(),
            file: bytes.to_vec(),
        })
    }
}

/// A BRDF of the model Linear: mapped values at the nodes, and kernels.
#[derive(Clone, Debug, PartialEq)]
pub struct Reconstruction {
    nodes: Nodes,
    table: Vec<[f32; 3]>,
    log_medians: Vec<f32>,
    kernels: KernelSum,
}

impl Reconstruction {
    /// Returns the BRDF in linear RGB, sr^-1 (not times the cosine), at angles in radians. `weight` is cos(theta_i)
    /// cos(theta_o).
    #[must_use]
    pub fn brdf(&self, angles: &Angles<f32>, weight: f64) -> [f32; 3] {
        let kernels = self.kernels.at(&HalfDifference::from_angles(*angles));
        self.value(&self.nodes.corners(angles.map(f64::from)), kernels, weight)
    }

    /// Returns the [BRDFs](Self::brdf) of reconstructions with the same basis, for which nodes and kernels are found once.
    pub fn brdf_of_all(all: &[&Self], angles: &Angles<f32>, weight: f64) -> Vec<[f32; 3]> {
        let Some(first) = all.first() else {
            return Vec::new();
        };
        let corners = first.nodes.corners(angles.map(f64::from));
        let at = HalfDifference::from_angles(*angles);
        let correlations: Vec<(usize, f32)> = first.kernels.correlations(&at).collect();
        let values = all.iter().map(|one| {
            let kernels = one.kernels.sum(correlations.iter().copied());
            one.value(&corners, kernels, weight)
        });
        values.collect()
    }

    fn value(&self, corners: &[WeightedNode<f64>], kernels: [f32; 3], weight: f64) -> [f32; 3] {
        let (mut mapped, log_median) = self.interpolate(corners.iter().copied());
        for (mapped, kernels) in mapped.iter_mut().zip(kernels) {
            *mapped += f64::from(kernels);
        }
        mapped.map(|mapped| unmap(mapped + log_median - EPSILON.ln(), weight) as f32)
    }

    /// Returns the BRDF at angles in radians, with the derivatives of the interpolant with respect to theta_h, theta_d
    /// and phi_d.
    #[must_use]
    pub fn brdf_with_derivative(&self, angles: &Angles<f32>) -> [AngleDual<f64>; 3] {
        let angles = angles.map(f64::from);
        let corners = self.nodes.corners_with_derivatives(angles);
        let (mut mapped, log_median) = self.interpolate(corners);
        for (mapped, kernels) in mapped.iter_mut().zip(self.kernels_with_derivatives(angles)) {
            *mapped = *mapped + kernels;
        }
        let at = HalfDifference::from_angles(AngleDual::variables(angles));
        let weight = at.cos_theta_i() * at.cos_theta_o();
        let center = log_median - AngleDual::from_value(EPSILON.ln());
        mapped.map(|mapped| unmap(mapped + center, weight))
    }

    /// Returns the sums of kernels, with difference quotients as derivatives.
    fn kernels_with_derivatives(&self, angles: Angles<f64>) -> [AngleDual<f64>; 3] {
        let variables = AngleDual::variables(angles);
        let sums = |axis: usize, step: f64| {
            let moved = variables.map(|angle| (angle.value + angle.tangent[axis] * step) as f32);
            let sums = self.kernels.at(&HalfDifference::from_angles(moved));
            sums.map(f64::from)
        };
        let mut duals = sums(0, 0.0).map(AngleDual::from_value);
        for axis in 0..3 {
            let ends = [0.5 * STEP, -0.5 * STEP].map(|step| sums(axis, step));
            for (channel, dual) in duals.iter_mut().enumerate() {
                dual.tangent[axis] = (ends[0][channel] - ends[1][channel]) / STEP;
            }
        }
        duals
    }

    /// Interpolates the mapped values and ln(median w + e) between nodes.
    fn interpolate<S: Scalar>(
        &self,
        corners: impl IntoIterator<Item = WeightedNode<S>>,
    ) -> ([S; 3], S) {
        let (mut mapped, mut log_median) = ([S::constant(0.0); 3], S::constant(0.0));
        for (node, weight) in corners {
            let weighted = |value: f32| weight * S::constant(f64::from(value));
            log_median = log_median + weighted(self.log_medians[node]);
            for (sum, value) in mapped.iter_mut().zip(self.table[node]) {
                *sum = *sum + weighted(value);
            }
        }
        (mapped, log_median)
    }
}
