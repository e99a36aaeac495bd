//! The Gaussian prior of the coefficients of the model Linear.

use serde::Serialize;

/// A prior of the coefficients.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Prior {
    /// m, the number of components; reduced if there are too few materials.
    pub components: usize,
    /// The paper's eta, the precision of all coefficients. None if one precision per coefficient is learned.
    pub eta: Option<f64>,
}

impl Prior {
    /// The paper's prior, after Nielsen et al.: five components, eta = 40.
    pub const PAPER: Self = Self {
        components: 5,
        eta: Some(40.0),
    };
    /// The prior with the lowest loss on materials held out of training.
    pub const LEARNED: Self = Self {
        components: 60,
        eta: None,
    };
}
