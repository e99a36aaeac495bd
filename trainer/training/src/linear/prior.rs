//! The Gaussian prior of the coefficients of the model Linear.

use serde::Serialize;

/// A prior of the coefficients.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Prior {
    /// m, the number of components; reduced if there are too few materials.
    pub components: usize,
    /// eta, the precision of all coefficients.
    pub eta: f32,
}

impl Prior {
    /// The paper's prior, after Nielsen et al.: five components, eta = 40.
    pub const PAPER: Self = Self {
        components: 5,
        eta: 40.0,
    };
}
