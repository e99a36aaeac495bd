//! Parameters of shading models.

/// A parameter of a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// The name in the model's files. The three channels of a color follow one another and have the same name.
    pub name: &'static str,
    /// The smallest and the largest value.
    pub bounds: [f64; 2],
    /// The purpose, by which a fit starts.
    pub(super) role: Role,
}

/// The purpose of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Role {
    /// A channel of the color.
    BaseColor,
    /// The share of metal.
    Metallic,
    /// The roughness of the surface below a coat.
    Roughness,
    /// The weight of a coat.
    Coat,
    /// Any other, with the value at which a fit starts.
    Other(f64),
}

impl Parameter {
    pub(super) const fn share(name: &'static str, role: Role) -> Self {
        Self::new(name, [0.0, 1.0], role)
    }

    pub(super) const fn new(name: &'static str, bounds: [f64; 2], role: Role) -> Self {
        Self { name, bounds, role }
    }
}

/// The smallest roughness. Below it, a highlight is narrower than the distance between two directions of a fit.
pub(super) const MIN_ROUGHNESS: f64 = 0.05;
