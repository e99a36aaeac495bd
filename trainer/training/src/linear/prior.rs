//! What is assumed of coefficients before anything was measured.

use serde::Serialize;

/// The prior of the coefficients.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Prior {
    /// m, the number of components; fewer where there are too few materials.
    pub components: usize,
    /// The paper's eta: the precision of every coefficient. None: it is learned for each.
    pub eta: Option<f64>,
}

impl Prior {
    /// Five components and eta = 40 (paper, after Nielsen et al.).
    pub const PAPER: Self = Self {
        components: 5,
        eta: Some(40.0),
    };
    /// What does best on materials that were not trained on.
    pub const LEARNED: Self = Self {
        components: 60,
        eta: None,
    };
}
