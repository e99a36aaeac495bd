//! The part of a basis that a recipe holds.

use glimpse_core::geometry::Angles;
use glimpse_materials::basis::{AngleDual, Basis, angles_to_f64};

use super::ReducedBasis;

/// The basis of the model Linear at the directions of a pattern.
#[derive(Clone, Debug, PartialEq)]
pub struct RecipeBasis {
    /// The principal components, n rows of m values. Their scale matches the precisions.
    pub basis: Vec<f32>,
    /// The mean of the training BRDFs after [`map`](glimpse_core::model::linear::map), n values.
    pub mean: Vec<f32>,
    /// The median of the training BRDFs, sr⁻¹ (not times the cosine), n values.
    pub median: Vec<f32>,
    /// cos(theta_i) cos(theta_o), n values.
    pub weight: Vec<f32>,
    /// The precision of each coefficient (eta in the paper), m values.
    pub precision: Vec<f32>,
    /// The CRC-32 of the file of the whole basis; 0 without a file.
    pub basis_checksum: u32,
}

impl RecipeBasis {
    /// Evaluates a basis at a pattern. The caller sets the precisions and the checksum, which are empty and 0 here.
    #[must_use]
    pub fn new(basis: &Basis, pattern: &[Angles<f32>]) -> Self {
        let angles: Vec<Angles<f64>> = pattern.iter().map(angles_to_f64).collect();
        let reduced = ReducedBasis::new(basis, &angles);
        let values = |list: &[AngleDual]| list.iter().map(|dual| dual.value as f32).collect();
        Self {
            basis: reduced.basis.iter().map(|value| *value as f32).collect(),
            mean: values(&reduced.mean),
            median: values(&reduced.median),
            weight: values(&reduced.weight),
            precision: Vec::new(),
            basis_checksum: 0,
        }
    }
}
