//! The part of a basis that a recipe holds.

use glimpse_core::geometry::Angles;
use glimpse_materials::basis::{Basis, ByAngles, widened};

use super::Reduced;

/// The model Linear, reduced to the directions that are measured.
#[derive(Clone, Debug, PartialEq)]
pub struct ReducedBasis {
    /// The components there, n rows of m: principal components of the mapped training columns,
    /// scaled as the precisions ask for.
    pub basis: Vec<f32>,
    /// The mean of the mapped training columns there, n.
    pub mean: Vec<f32>,
    /// The median BRDF of the training columns there, sr^-1 (not times a cosine), n.
    pub median: Vec<f32>,
    /// cos(theta_i) cos(theta_o) there, n.
    pub weight: Vec<f32>,
    /// The precision of each coefficient, m (the paper's eta, m times).
    pub precision: Vec<f32>,
    /// The CRC-32 of the file of the whole basis; 0 if there is none.
    pub basis_checksum: u32,
}

impl ReducedBasis {
    /// Evaluates a basis at a pattern; precisions and checksum are left open.
    #[must_use]
    pub fn new(basis: &Basis, pattern: &[Angles<f32>]) -> Self {
        let places: Vec<Angles<f64>> = pattern.iter().map(widened).collect();
        let found = Reduced::new(basis, &places);
        let values = |list: &[ByAngles]| list.iter().map(|dual| dual.value as f32).collect();
        Self {
            basis: found.basis.iter().map(|value| *value as f32).collect(),
            mean: values(&found.mean),
            median: values(&found.median),
            weight: values(&found.weight),
            precision: Vec::new(),
            basis_checksum: 0,
        }
    }
}
