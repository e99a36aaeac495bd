//! The completion of readings from a recipe, in slices of work.

use super::coefficient_net::{
    CHANNELS, CoefficientNet, Input, MissingPolicy, Packed, standardized,
};
use super::component_rows::ComponentRows;
use super::correction::{Correction, correction_words};
use super::gauss_newton::GaussNewton;
use super::learned::Descent;
use super::loss_estimate::{PartialLoss, Uncertainty};
use crate::model::{ModelKind, Sample, Samples};
use crate::numeric::Floats;
use crate::numeric::math::{exp, ln};

/// The largest number of rows of a completion: coefficients and hidden units.
pub const MAX_ROWS: usize = 96;
/// The largest number of units of an init net.
pub const MAX_UNITS: usize = 32;
/// Number of initial parameters that one unit of work computes.
pub(super) const PARAMETERS_PER_UNIT: usize = 64;

/// A completion: a small learned map from readings to the model Linear, or to the start of a descent.
#[derive(Clone, Copy, Debug)]
pub struct Completed<'a> {
    pub(crate) coefficient_net: CoefficientNet<'a, f32, Packed>,
    pub(crate) center: Floats<'a>,
    pub(crate) scale: f32,
    pub(crate) missing: MissingPolicy,
    pub(crate) correction: Option<Correction<'a>>,
    /// A bias, and a weight for each component; empty without a prediction.
    pub(crate) prediction: Floats<'a>,
    pub(crate) uncertainty: Option<Uncertainty>,
    pub(crate) partial: Option<PartialLoss<'a>>,
    pub(crate) target: Target<'a>,
}

/// The use of a completion's coefficients.
#[derive(Clone, Copy, Debug)]
pub enum Target<'a> {
    /// The model Linear, with its components at the pattern's samples.
    Linear(Components<'a>),
    /// A descent, and the net that computes its initial parameters.
    Descent(Descent<'a>, InitNet<'a>),
    /// Gauss-Newton steps, and the net that computes their initial parameters.
    GaussNewton(GaussNewton<'a>, InitNet<'a>),
}

/// The net that computes a descent's initial parameters, in a recipe's encoding.
pub type InitNet<'a> = super::coefficient_net::InitNet<'a, f32, Packed>;

/// The components of the model Linear at the pattern's samples.
#[derive(Clone, Copy, Debug)]
pub struct Components<'a> {
    /// Without components if the completion has a correction, which has them.
    pub(crate) at_samples: ComponentRows<'a>,
    pub(crate) basis_checksum: u32,
}

impl<'a> Completed<'a> {
    /// The net that maps readings to coefficients.
    #[must_use]
    pub fn coefficient_net(&self) -> &CoefficientNet<'a, f32, Packed> {
        &self.coefficient_net
    }

    /// The center that is subtracted from each sample's logarithm: the mean of the training columns there.
    #[must_use]
    pub fn center(&self) -> Floats<'a> {
        self.center
    }

    /// The factor of the centered logarithms.
    #[must_use]
    pub fn scale(&self) -> f32 {
        self.scale
    }

    /// The correction of the coefficients, if the recipe has one.
    #[must_use]
    pub fn correction(&self) -> Option<Correction<'a>> {
        self.correction
    }

    /// The components at the samples of the pattern: those of the correction or of the model Linear. None for a descent
    /// without a correction.
    #[must_use]
    pub fn at_samples(&self) -> Option<ComponentRows<'a>> {
        match (&self.correction, &self.target) {
            (Some(correction), _) => Some(correction.at_samples),
            (None, Target::Linear(components)) => Some(components.at_samples),
            (None, _) => None,
        }
    }

    /// The number of coefficients of a channel.
    #[must_use]
    pub fn components(&self) -> usize {
        match &self.correction {
            Some(correction) => correction.components(),
            None => self.coefficient_net.components,
        }
    }

    /// Returns the coefficients of each channel in the memory of a finished completion.
    pub(super) fn coefficients<'w>(&self, words: &'w [f32]) -> [&'w [f32]; CHANNELS] {
        match &self.correction {
            Some(correction) => {
                let words = words.get(self.coefficient_net.words()..);
                correction.coefficients(words.unwrap_or_default())
            }
            None => self.coefficient_net.coefficients(words),
        }
    }

    /// The treatment of missing readings in training.
    #[must_use]
    pub fn missing(&self) -> MissingPolicy {
        self.missing
    }

    /// Returns true if a fit tolerates missing readings.
    #[must_use]
    pub fn tolerates_missing(&self) -> bool {
        self.missing != MissingPolicy::AllRequired
    }

    /// The weights of the predicted logarithm of a fit's loss; empty without a prediction.
    ///
    /// They are a bias and a weight for each component, which multiplies the mean coefficient of the three channels.
    #[must_use]
    pub fn prediction(&self) -> Floats<'a> {
        self.prediction
    }

    /// The evidence of the readings for the loss, if the recipe has it.
    #[must_use]
    pub fn uncertainty(&self) -> Option<Uncertainty> {
        self.uncertainty
    }

    /// The loss of fits with some of the readings, if the recipe has it.
    #[must_use]
    pub fn partial(&self) -> Option<PartialLoss<'a>> {
        self.partial
    }

    /// The innovation, in the memory of a finished completion. None without a correction.
    pub(super) fn innovation(&self, words: &[f32]) -> Option<f32> {
        let correction = self.correction.as_ref()?;
        let words = words.get(self.coefficient_net.words()..self.coefficient_words())?;
        correction.innovation(words)
    }

    /// Returns the predicted loss, without the factor of the residual, in the memory of a finished completion. None
    /// without a prediction.
    ///
    /// Not inlined, because it runs once per fit.
    #[inline(never)]
    pub(super) fn predicted_loss(&self, words: &[f32]) -> Option<f32> {
        let [red, green, blue] = self.coefficients(words);
        let mut weights = self.prediction.iter();
        let mut sum = weights.next()?;
        for (weight, ((red, green), blue)) in weights.zip(red.iter().zip(green).zip(blue)) {
            sum += weight * (red + green + blue) * (1.0 / 3.0);
        }
        if let Some((uncertainty, innovation)) = self.uncertainty.zip(self.innovation(words)) {
            sum += uncertainty.innovation * ln(innovation + Uncertainty::MIN_INNOVATION);
        }
        Some(exp(sum))
    }

    /// The use of the coefficients.
    #[must_use]
    pub fn target(&self) -> &Target<'a> {
        &self.target
    }

    /// The model that the completion fits.
    #[must_use]
    pub fn model(&self) -> ModelKind {
        match &self.target {
            Target::Linear(_) => ModelKind::Linear,
            Target::Descent(descent, _) => descent.model,
            Target::GaussNewton(steps, _) => steps.model,
        }
    }

    /// The memory of the coefficients in words: that of the net, then that of the correction.
    pub(super) fn coefficient_words(&self) -> usize {
        let correction = self.correction.as_ref();
        let correction = correction.map_or(0, |each| correction_words(each.components()));
        self.coefficient_net.words().saturating_add(correction)
    }

    /// The memory of a completion in words, including the units of an [`InitNet`].
    #[must_use]
    pub fn words(&self) -> usize {
        let units = match &self.target {
            Target::Linear(_) => 0,
            Target::Descent(_, init_net) | Target::GaussNewton(_, init_net) => init_net.units(),
        };
        self.coefficient_words().saturating_add(units)
    }

    /// The units of work of all coefficients: one for each reading, one for the hidden units, and one for each channel;
    /// then those of the correction.
    pub(super) fn units(&self, samples: usize) -> u32 {
        let correction = self.correction.as_ref();
        let correction = correction.map_or(0, |correction| correction.units(samples));
        Self::net_units(samples).saturating_add(correction) as u32
    }

    fn net_units(samples: usize) -> usize {
        samples.saturating_add(1).saturating_add(CHANNELS)
    }

    /// Does a unit of work. Not inlined, so that its stack is released between slices.
    #[inline(never)]
    pub(super) fn advance(&self, unit: u32, samples: Samples<'_>, state: &mut [f32]) {
        let unit = unit as usize;
        if let Some(unit) = unit.checked_sub(Self::net_units(samples.len())) {
            let net_words = self.coefficient_net.words();
            if let (Some(correction), Some((state, words))) =
                (&self.correction, state.split_at_mut_checked(net_words))
            {
                let initial = self.coefficient_net.coefficients(state);
                correction.advance(unit, samples, self.center, initial, words);
            }
            return;
        }
        let state = state.get_mut(..self.coefficient_net.words());
        let state = state.unwrap_or_default();
        if let Some(sample) = samples.get(unit) {
            let center = self.center.iter().nth(unit).unwrap_or_default();
            let present = samples.iter().map(|sample| is_present(&sample));
            let scale = self.scale * self.missing.dropout_gain(present);
            let input = input(&sample, center, scale);
            self.coefficient_net.add(unit, &input, state);
            return;
        }
        match unit.checked_sub(samples.len().saturating_add(1)) {
            None => self.coefficient_net.activate(state),
            Some(channel) => self.coefficient_net.complete(channel, state),
        }
    }
}

/// Returns true if a sample has a reading that counts; otherwise it is missing.
fn is_present(sample: &Sample<f32>) -> bool {
    sample.weight > 0.0
}

/// Returns the input of the net for a sample.
fn input(sample: &Sample<f32>, center: f32, scale: f32) -> Input<f32> {
    if !is_present(sample) {
        return Input {
            channels: [0.0; 3],
            missing: 1.0,
        };
    }
    let weight = sample.at.cos_theta_i() * sample.at.cos_theta_o();
    let channels = sample
        .measured
        .map(|channel| standardized(channel, weight, center, scale));
    Input {
        channels,
        missing: 0.0,
    }
}

impl Components<'_> {
    /// The CRC-32 of the host's whole basis file, which turns coefficients into a BRDF. None without a basis.
    #[must_use]
    pub fn basis_checksum(&self) -> Option<u32> {
        Some(self.basis_checksum).filter(|checksum| *checksum != 0)
    }
}
