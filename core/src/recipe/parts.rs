//! The content of a recipe's sections.
//!
//! The order of fields and variants here is the format; see `core/docs/recipe.md`.

use serde::{Deserialize, Serialize};

use crate::fit::gauss_newton::GaussNewton;
use crate::fit::{Descent, FitMethod, InitNet, Target, Uncertainty};
use crate::model::ModelKind;

/// The parts of a recipe, for [`Recipe::write`](super::Recipe::write).
#[derive(Clone, Copy, Debug)]
pub struct RecipeParts<'a> {
    /// n x (theta_h, theta_d, phi_d), packed little-endian f32, radians.
    pub pattern: &'a [u8],
    /// The method that fits parameters to readings.
    pub method: PackedMethod<'a>,
    /// The expected loss on a material that was not in the training data.
    pub expected_loss: Option<f32>,
    /// The weights from a completion's coefficients to the logarithm of the predicted loss, packed little-endian f32:
    /// a bias, and a weight for each component.
    pub prediction: Option<&'a [u8]>,
    /// The evidence of the readings for the loss of a completed fit.
    pub uncertainty: Option<Uncertainty>,
    /// True if the samples are in the order of a path that takes little time.
    pub is_in_path_order: bool,
    /// The loss of completed fits with some of the readings. It has no effect without [`Self::uncertainty`].
    pub partial: Option<PackedPartialLoss<'a>>,
    /// The trainer's metadata. Empty bytes are not written.
    pub metadata: &'a [u8],
}

impl<'a> RecipeParts<'a> {
    /// Creates the parts of a recipe without optional sections.
    #[must_use]
    pub const fn new(pattern: &'a [u8], method: PackedMethod<'a>) -> Self {
        Self {
            pattern,
            method,
            expected_loss: None,
            prediction: None,
            uncertainty: None,
            is_in_path_order: false,
            partial: None,
            metadata: &[],
        }
    }
}

/// The method that fits parameters to readings, as bytes.
#[derive(Clone, Copy, Debug)]
#[allow(clippy::large_enum_variant)] // only one exists at a time, without an allocator
pub enum PackedMethod<'a> {
    /// A few steps of SGD.
    Descent(PackedDescent<'a>),
    /// A ridge solve, the model Linear.
    Ridge(PackedRidge<'a>),
    /// A completion, its correction, and the use of its coefficients.
    Completed(
        PackedCoefficientNet<'a>,
        Option<PackedCorrection<'a>>,
        PackedTarget<'a>,
    ),
}

/// A correction as bytes. Weights are signed bytes, all other lists packed little-endian f32.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct PackedCorrection<'a> {
    /// The components at the sampled directions: n rows of K weights.
    pub rows: &'a [u8],
    /// The scale of each component, K.
    pub row_scales: &'a [u8],
    /// The precision of each component, K.
    pub precision: &'a [u8],
}

/// The loss of completed fits with some of the readings, as bytes. Each list is packed little-endian f32, and has an
/// entry for each number of readings from 1 to n.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct PackedPartialLoss<'a> {
    /// The logarithm of a factor of the predicted loss, -100 to 100.
    pub loss: &'a [u8],
    /// The ratio of the upper bound to the predicted loss, above 0.
    pub bound: &'a [u8],
}

/// The use of a completion's coefficients, as bytes.
#[derive(Clone, Copy, Debug)]
pub enum PackedTarget<'a> {
    /// The model Linear.
    Linear,
    /// The start of a descent.
    Descent(PackedDescent<'a>, PackedInitNet<'a>),
    /// The start of Gauss-Newton steps.
    GaussNewton(PackedGaussNewton<'a>, PackedInitNet<'a>),
}

/// A descent as bytes.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct PackedDescent<'a> {
    /// The model.
    pub model: ModelKind,
    /// Number of SGD steps.
    pub inner_steps: u16,
    /// Initial parameters, packed little-endian f32.
    pub initial: &'a [u8],
    /// A step size for each parameter, packed little-endian f32.
    pub step_sizes: &'a [u8],
}

/// Gauss-Newton steps as bytes. Weights are signed bytes, all other lists packed little-endian f32.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct PackedGaussNewton<'a> {
    /// The model.
    pub model: ModelKind,
    /// Number of steps.
    pub steps: u16,
    /// Initial parameters.
    pub initial: &'a [u8],
    /// The precision of each active parameter of a system.
    pub precision: &'a [u8],
    /// The sum of the weights of the pattern's readings.
    pub reading_weight: f32,
    /// The error at which the weight of a reading is halved.
    pub error_scale: f32,
    /// V x (theta_h, theta_d, phi_d), radians: the directions of the virtual readings.
    pub directions: &'a [u8],
    /// The mean of the mapped training columns at each direction, V.
    pub center: &'a [u8],
    /// The components at the directions: V rows of m weights.
    pub rows: &'a [u8],
    /// The scale of each component in `rows`, m.
    pub row_scales: &'a [u8],
}

/// A ridge solve as bytes; all lists are packed little-endian f32.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct PackedRidge<'a> {
    /// m, the number of components.
    pub components: u16,
    /// The components at the sampled directions: n rows of m.
    pub basis: &'a [u8],
    /// The mean of the mapped training columns at the sampled directions, n.
    pub mean: &'a [u8],
    /// The median BRDF of the training columns at the sampled directions (sr^-1, not times a cosine), n.
    pub median: &'a [u8],
    /// cos(theta_i) cos(theta_o) at the sampled directions, n.
    pub weight: &'a [u8],
    /// The precision of each coefficient, m.
    pub precision: &'a [u8],
    /// The CRC-32 of the host's whole basis file, which turns coefficients into a BRDF; 0 without a basis.
    pub basis_checksum: u32,
}

/// A completion as bytes. Weights are signed bytes, all other lists packed little-endian f32.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct PackedCoefficientNet<'a> {
    /// m, the number of coefficients of a channel.
    pub components: u16,
    /// The treatment of missing readings: the number of a
    /// [`MissingPolicy`](crate::fit::coefficient_net::MissingPolicy).
    pub missing: u8,
    /// The center that is subtracted from each sample's logarithm, n.
    pub center: &'a [u8],
    /// The factor of the centered logarithms.
    pub scale: f32,
    /// The weights own, mean and missing of each sample: n x 3 x (m + h).
    pub readings: &'a [u8],
    /// The scale of each row of `readings`, m + h.
    pub reading_scales: &'a [u8],
    /// The bias of each row, m + h.
    pub bias: &'a [u8],
    /// The weights from hidden units to coefficients: m rows of h.
    pub output: &'a [u8],
    /// The scale of each row of `output`, m.
    pub output_scales: &'a [u8],
    /// The components at the sampled directions, n rows of m weights; empty with a start or a correction.
    pub rows: &'a [u8],
    /// The scale of each component in `rows`, m; empty with a start or a correction.
    pub row_scales: &'a [u8],
    /// The CRC-32 of the host's whole basis file, which turns coefficients into a BRDF; 0 without a basis.
    pub basis_checksum: u32,
}

/// The start of a descent as bytes. Weights are signed bytes, all other lists packed little-endian f32.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct PackedInitNet<'a> {
    /// The weights from the coefficients of red, green and blue to units: g rows of 3 m.
    pub hidden: &'a [u8],
    /// The scale of each row of `hidden`, g.
    pub hidden_scales: &'a [u8],
    /// The bias of each unit, g.
    pub bias: &'a [u8],
    /// The weights from units to the offset of each initial parameter: rows of g.
    pub output: &'a [u8],
    /// The scale of each row of `output`.
    pub output_scales: &'a [u8],
}

impl<'a> PackedDescent<'a> {
    fn new(descent: &Descent<'a>) -> Self {
        Self {
            model: descent.model(),
            inner_steps: descent.inner_steps(),
            initial: descent.initial().words().as_flattened(),
            step_sizes: descent.step_sizes().words().as_flattened(),
        }
    }
}

impl<'a> PackedGaussNewton<'a> {
    fn new(steps: &GaussNewton<'a>) -> Self {
        let readings = steps.virtual_readings();
        Self {
            model: steps.model(),
            steps: steps.steps(),
            initial: steps.initial().words().as_flattened(),
            precision: steps.precision().words().as_flattened(),
            reading_weight: steps.reading_weight(),
            error_scale: steps.error_scale(),
            directions: readings.directions().as_flattened(),
            center: readings.center().words().as_flattened(),
            rows: readings.components().rows(),
            row_scales: readings.components().scales().words().as_flattened(),
        }
    }
}

impl<'a> PackedInitNet<'a> {
    fn new(init_net: &InitNet<'a>) -> Self {
        Self {
            hidden: init_net.hidden,
            hidden_scales: init_net.hidden_scales.as_flattened(),
            bias: init_net.bias.as_flattened(),
            output: init_net.output,
            output_scales: init_net.output_scales.as_flattened(),
        }
    }
}

/// The prediction of a completed fit's loss is not included, because it is a separate section:
/// [`Completed::prediction`](crate::fit::Completed::prediction) goes into [`RecipeParts::prediction`].
impl<'a> From<FitMethod<'a>> for PackedMethod<'a> {
    fn from(method: FitMethod<'a>) -> Self {
        match method {
            FitMethod::Descent(descent) => Self::Descent(PackedDescent::new(&descent)),
            FitMethod::Completed(completed) => {
                let net = completed.coefficient_net();
                let (rows, row_scales, target): (&[u8], &[u8], _) = match completed.target() {
                    Target::Linear(components) => {
                        let rows = components.at_samples;
                        let scales = rows.scales().words().as_flattened();
                        (rows.rows(), scales, PackedTarget::Linear)
                    }
                    Target::Descent(descent, init_net) => {
                        let (descent, init_net) =
                            (PackedDescent::new(descent), PackedInitNet::new(init_net));
                        (&[], &[], PackedTarget::Descent(descent, init_net))
                    }
                    Target::GaussNewton(steps, init_net) => {
                        let (steps, init_net) =
                            (PackedGaussNewton::new(steps), PackedInitNet::new(init_net));
                        (&[], &[], PackedTarget::GaussNewton(steps, init_net))
                    }
                };
                let packed = PackedCoefficientNet {
                    // At most MAX_ROWS, which a u16 holds.
                    components: net.components as u16,
                    missing: completed.missing() as u8,
                    center: completed.center().words().as_flattened(),
                    scale: completed.scale(),
                    readings: net.readings,
                    reading_scales: net.scales.as_flattened(),
                    bias: net.bias.as_flattened(),
                    output: net.output,
                    output_scales: net.output_scales.as_flattened(),
                    rows,
                    row_scales,
                    basis_checksum: method.basis_checksum().unwrap_or_default(),
                };
                let correction = completed.correction().map(|each| PackedCorrection {
                    rows: each.at_samples().rows(),
                    row_scales: each.at_samples().scales().words().as_flattened(),
                    precision: each.precision().words().as_flattened(),
                });
                Self::Completed(packed, correction, target)
            }
            FitMethod::Ridge(ridge) => Self::Ridge(PackedRidge {
                // At most MAX_COMPONENTS, which a u16 holds.
                components: ridge.components() as u16,
                basis: ridge.basis().words().as_flattened(),
                mean: ridge.mean().words().as_flattened(),
                median: ridge.median().words().as_flattened(),
                weight: ridge.weight().words().as_flattened(),
                precision: ridge.precision().words().as_flattened(),
                basis_checksum: ridge.basis_checksum().unwrap_or_default(),
            }),
        }
    }
}
