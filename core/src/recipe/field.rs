//! The fields of a recipe, which errors name.

use serde::{Deserialize, Serialize};

use super::format::{
    MAX_ANGLE, MAX_BASIS, MAX_EXPONENT, MAX_MEAN, MAX_MEDIAN, MAX_PRECISION, MAX_PREDICTION,
    MAX_READING_WEIGHT, MAX_WEIGHT, MIN_PRECISION,
};

/// A field of the recipe, which errors name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Field {
    /// The body as a whole.
    Body,
    /// Number of SGD steps.
    InnerSteps,
    /// The directions to measure.
    Pattern,
    /// Initial parameters.
    Initial,
    /// A step size for each parameter.
    StepSizes,
    /// The expected loss.
    ExpectedLoss,
    /// m, the number of components.
    Components,
    /// The components at the sampled directions.
    Basis,
    /// The mean at the sampled directions.
    Mean,
    /// The median at the sampled directions.
    Median,
    /// The weights of the sampled directions.
    Weight,
    /// The precision of each coefficient.
    Precision,
    /// Of a completion: the center that is subtracted from each sample's logarithm.
    Center,
    /// Of a completion: the factor of the centered logarithms.
    Scale,
    /// Of a completion: the weights of readings.
    Readings,
    /// Of a completion: the scale of each row of `readings`.
    ReadingScales,
    /// Of a completion: the bias of each row.
    Bias,
    /// Of a completion: the weights from hidden units to coefficients.
    Output,
    /// Of a completion: the scale of each row of `output`.
    OutputScales,
    /// Of a completion: the components at the sampled directions.
    Rows,
    /// Of a completion: the scale of each component in `rows`.
    RowScales,
    /// Of a completion: the CRC-32 of the host's whole basis file.
    BasisChecksum,
    /// Of a start: the weights from coefficients to units.
    StartHidden,
    /// Of a start: the scale of each row of `hidden`.
    StartHiddenScales,
    /// Of a start: the bias of each unit.
    StartBias,
    /// Of a start: the weights from units to offsets of the initial parameters.
    StartOutput,
    /// Of a start: the scale of each row of `output`.
    StartOutputScales,
    /// The weights from a completion's coefficients to the predicted loss.
    Prediction,
    /// Of a completion: the treatment of missing readings.
    Missing,
    /// Of Gauss-Newton steps: their number.
    StepCount,
    /// Of Gauss-Newton steps: the initial parameters.
    StepInitial,
    /// Of Gauss-Newton steps: the precision of each active parameter.
    StepPrecision,
    /// Of Gauss-Newton steps: the sum of the weights of the pattern's readings.
    ReadingWeight,
    /// Of Gauss-Newton steps: the error at which the weight of a reading is halved.
    ErrorScale,
    /// Of Gauss-Newton steps: the directions of the virtual readings.
    VirtualDirections,
    /// Of Gauss-Newton steps: the mean at the virtual readings.
    VirtualCenter,
    /// Of Gauss-Newton steps: the components at the virtual readings.
    VirtualRows,
    /// Of Gauss-Newton steps: the scale of each component in `rows`.
    VirtualRowScales,
    /// Of a correction: the components at the sampled directions.
    CorrectionRows,
    /// Of a correction: the scale of each component.
    CorrectionRowScales,
    /// Of a correction: the precision of each component.
    CorrectionPrecision,
    /// The exponent of the innovation in the predicted loss.
    InnovationExponent,
    /// The exponent of the residual in the predicted loss.
    ResidualExponent,
    /// The ratio of the upper bound to the predicted loss.
    Bound,
    /// The largest innovation of a material like those of the training.
    MaxInnovation,
    /// The logarithm of a factor of the predicted loss, for each number of readings.
    PartialLoss,
    /// The ratio of the upper bound to the predicted loss, for each number of readings.
    PartialBound,
}

impl Field {
    /// The name, as in `core/docs/recipe.md`. If another section has a field of the same name, the name of the section
    /// and a dot precede it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Body => "body",
            Self::InnerSteps => "inner_steps",
            Self::Pattern => "pattern",
            Self::Initial => "initial",
            Self::StepSizes => "step_sizes",
            Self::ExpectedLoss => "expected_loss",
            Self::Components => "components",
            Self::Basis => "basis",
            Self::Mean => "mean",
            Self::Median => "median",
            Self::Weight => "weight",
            Self::Precision => "precision",
            Self::Center => "completion.center",
            Self::Scale => "completion.scale",
            Self::Readings => "completion.readings",
            Self::ReadingScales => "completion.reading_scales",
            Self::Bias => "completion.bias",
            Self::Output => "completion.output",
            Self::OutputScales => "completion.output_scales",
            Self::Rows => "completion.rows",
            Self::RowScales => "completion.row_scales",
            Self::BasisChecksum => "completion.basis_checksum",
            Self::StartHidden => "start.hidden",
            Self::StartHiddenScales => "start.hidden_scales",
            Self::StartBias => "start.bias",
            Self::StartOutput => "start.output",
            Self::StartOutputScales => "start.output_scales",
            Self::Prediction => "prediction",
            Self::Missing => "completion.missing",
            Self::StepCount => "gauss_newton.steps",
            Self::StepInitial => "gauss_newton.initial",
            Self::StepPrecision => "gauss_newton.precision",
            Self::ReadingWeight => "gauss_newton.reading_weight",
            Self::ErrorScale => "gauss_newton.error_scale",
            Self::VirtualDirections => "gauss_newton.directions",
            Self::VirtualCenter => "gauss_newton.center",
            Self::VirtualRows => "gauss_newton.rows",
            Self::VirtualRowScales => "gauss_newton.row_scales",
            Self::CorrectionRows => "correction.rows",
            Self::CorrectionRowScales => "correction.row_scales",
            Self::CorrectionPrecision => "correction.precision",
            Self::InnovationExponent => "uncertainty.innovation",
            Self::ResidualExponent => "uncertainty.residual",
            Self::Bound => "uncertainty.bound",
            Self::MaxInnovation => "uncertainty.max_innovation",
            Self::PartialLoss => "partial.loss",
            Self::PartialBound => "partial.bound",
        }
    }

    /// The smallest and the largest number that the field may hold. By default all finite numbers.
    #[must_use]
    pub const fn range(self) -> (f32, f32) {
        match self {
            Self::Pattern | Self::VirtualDirections => (-MAX_ANGLE, MAX_ANGLE),
            Self::Basis => (-MAX_BASIS, MAX_BASIS),
            Self::Prediction => (-MAX_PREDICTION, MAX_PREDICTION),
            Self::Missing => (0.0, 2.0),
            Self::InnovationExponent | Self::ResidualExponent | Self::PartialLoss => {
                (-MAX_EXPONENT, MAX_EXPONENT)
            }
            Self::ReadingWeight | Self::ErrorScale => (0.0, MAX_READING_WEIGHT),
            Self::Mean | Self::Center | Self::VirtualCenter => (-MAX_MEAN, MAX_MEAN),
            Self::Median => (0.0, MAX_MEDIAN),
            Self::Weight => (0.0, MAX_WEIGHT),
            Self::Precision | Self::StepPrecision | Self::CorrectionPrecision => {
                (MIN_PRECISION, MAX_PRECISION)
            }
            _ => (f32::MIN, f32::MAX),
        }
    }
}

impl core::fmt::Display for Field {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}
