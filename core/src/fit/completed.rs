//! Recipes that complete readings, and the slices of the fit.

use super::coefficient_net::{
    CHANNELS, CoefficientNet, Input, MissingPolicy, Packed, standardized,
};
use super::learned::Descent;
use crate::model::{ModelKind, Sample, Samples};
use crate::numeric::Floats;
use crate::numeric::math::exp;

/// The largest number of rows of a completion: coefficients and hidden units.
pub const MAX_ROWS: usize = 96;
/// The largest number of units of a start.
pub const MAX_UNITS: usize = 32;
/// Parameters that a unit of work starts.
pub(super) const STARTED: usize = 64;

/// Readings, completed by a small learned map: to the model Linear, or to where a descent starts.
#[derive(Clone, Copy, Debug)]
pub struct Completed<'a> {
    pub(crate) coefficient_net: CoefficientNet<'a, f32, Packed>,
    pub(crate) center: Floats<'a>,
    pub(crate) scale: f32,
    pub(crate) missing: MissingPolicy,
    /// A bias, and a weight for each component; empty where nothing is predicted.
    pub(crate) prediction: Floats<'a>,
    pub(crate) target: Target<'a>,
}

/// The use of the coefficients.
#[derive(Clone, Copy, Debug)]
pub enum Target<'a> {
    /// The model Linear, of components at the pattern's samples.
    Linear(Components<'a>),
    /// The start of a descent, and the descent.
    Descent(Descent<'a>, InitNet<'a>),
}

/// The start of a descent in a recipe.
pub type InitNet<'a> = super::coefficient_net::InitNet<'a, f32, Packed>;

/// The components of the model Linear at the pattern's samples.
#[derive(Clone, Copy, Debug)]
pub struct Components<'a> {
    pub(crate) rows: &'a [u8],
    pub(crate) scales: Floats<'a>,
    pub(crate) basis_checksum: u32,
}

impl<'a> Completed<'a> {
    /// The map from readings to coefficients.
    #[must_use]
    pub fn coefficient_net(&self) -> &CoefficientNet<'a, f32, Packed> {
        &self.coefficient_net
    }

    /// The center of each sample's logarithm: the mean of the training columns there.
    #[must_use]
    pub fn center(&self) -> Floats<'a> {
        self.center
    }

    /// The factor of the centered logarithms.
    #[must_use]
    pub fn scale(&self) -> f32 {
        self.scale
    }

    /// The treatment of missing readings that it was trained for.
    #[must_use]
    pub fn missing(&self) -> MissingPolicy {
        self.missing
    }

    /// Returns true if it tolerates missing readings.
    #[must_use]
    pub fn tolerates_missing(&self) -> bool {
        self.missing != MissingPolicy::NoFit
    }

    /// The prediction of the logarithm of a fit's loss: a bias, and a weight for each component, which
    /// counts for the mean of the channels' coefficients. Empty where nothing is predicted.
    #[must_use]
    pub fn prediction(&self) -> Floats<'a> {
        self.prediction
    }

    /// The loss that a fit is likely to have whose readings were completed to these coefficients of
    /// red, green and blue; None where nothing is predicted. Out of line: it is asked for once.
    #[inline(never)]
    pub(super) fn predicted_loss(&self, [red, green, blue]: [&[f32]; 3]) -> Option<f32> {
        let mut weights = self.prediction.iter();
        let mut sum = weights.next()?;
        for (weight, ((red, green), blue)) in weights.zip(red.iter().zip(green).zip(blue)) {
            sum += weight * (red + green + blue) * (1.0 / 3.0);
        }
        Some(exp(sum))
    }

    /// The use of the coefficients.
    #[must_use]
    pub fn target(&self) -> &Target<'a> {
        &self.target
    }

    /// The model that it fits.
    #[must_use]
    pub fn model(&self) -> ModelKind {
        match &self.target {
            Target::Linear(_) => ModelKind::Linear,
            Target::Descent(descent, _) => descent.model,
        }
    }

    /// Numbers that a completion works in, those of the [`InitNet`] included.
    #[must_use]
    pub fn words(&self) -> usize {
        let units = match &self.target {
            Target::Linear(_) => 0,
            Target::Descent(_, start) => start.units(),
        };
        self.coefficient_net.words().saturating_add(units)
    }

    /// Units of work until all coefficients are there: one for each reading, one for the hidden units,
    /// and one for each channel.
    pub(super) fn units(&self, samples: usize) -> u32 {
        samples.saturating_add(1).saturating_add(CHANNELS) as u32
    }

    /// One of them. Out of line: what it takes of the stack is given back between slices.
    #[inline(never)]
    pub(super) fn advance(&self, unit: u32, samples: Samples<'_>, state: &mut [f32]) {
        let unit = unit as usize;
        if let Some(sample) = samples.get(unit) {
            let center = self.center.iter().nth(unit).unwrap_or_default();
            let scale = self.scale
                * self
                    .missing
                    .dropout_gain(samples.iter().map(|sample| is_there(&sample)));
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

/// Returns true if a sample's reading counts; otherwise it is missing.
fn is_there(sample: &Sample<f32>) -> bool {
    sample.weight > 0.0
}

/// A sample's reading as it enters.
fn input(sample: &Sample<f32>, center: f32, scale: f32) -> Input<f32> {
    if !is_there(sample) {
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

impl<'a> Components<'a> {
    /// For each sample of the pattern a byte for each component.
    #[must_use]
    pub fn rows(&self) -> &'a [u8] {
        self.rows
    }

    /// The factor of each component.
    #[must_use]
    pub fn scales(&self) -> Floats<'a> {
        self.scales
    }

    /// The CRC-32 of the host's file of the whole basis, which turns coefficients into a BRDF; None
    /// if there is none.
    #[must_use]
    pub fn basis_checksum(&self) -> Option<u32> {
        Some(self.basis_checksum).filter(|checksum| *checksum != 0)
    }
}
