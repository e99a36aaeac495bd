//! The estimator: four optional stages from readings to a fitted BRDF.

use super::channels::{Channels, Readings, keep_gray};
use super::coefficients::{Coefficients, Net, brdf_at};
use super::model::{Functions, RIDGE};
use super::prediction::{PredictedLoss, Prediction};
use super::sgd::Sgd;
use super::start::Refinement;
use crate::geometry::HalfDifference;
use crate::model::linear::{Basis, EPSILON};
use crate::model::{ModelKind, SLOT_WORDS};

/// The stages of a recipe. A fit uses a list of numbers, `words`, as its memory; with fewer of them, nothing is fitted.
#[derive(Clone, Copy, Debug)]
#[allow(clippy::large_enum_variant)] // a scan has one, without an allocator
pub enum Estimator<'a> {
    /// SGD from constant initial parameters: the paper's Phong, Cook-Torrance and Neural.
    Sgd(Sgd<'a>),
    /// Coefficients: the model Linear, or the start of the other models.
    Ridge {
        /// The stages net and ridge.
        coefficients: Coefficients<'a>,
        /// The stages start and steps. None for Linear.
        refinement: Option<Refinement<'a>>,
        /// The predicted loss, if the recipe has it.
        prediction: Option<Prediction<'a>>,
    },
}

impl<'a> Estimator<'a> {
    /// The model that is fitted.
    #[must_use]
    pub fn model(&self) -> ModelKind {
        match self {
            Self::Sgd(sgd) => sgd.model,
            Self::Ridge { refinement, .. } => match refinement {
                Some(refinement) => refinement.steps.model,
                None => ModelKind::Linear,
            },
        }
    }

    /// The stages net and ridge, if the recipe has them.
    #[must_use]
    pub fn coefficients(&self) -> Option<&Coefficients<'a>> {
        match self {
            Self::Ridge { coefficients, .. } if RIDGE => Some(coefficients),
            _ => None,
        }
    }

    /// The stage net, if the recipe has it.
    #[must_use]
    pub fn net(&self) -> Option<&Net<'a>> {
        self.coefficients()?.net.as_ref()
    }

    /// The stages start and Gauss-Newton steps, if the recipe has them.
    #[must_use]
    pub fn refinement(&self) -> Option<&Refinement<'a>> {
        match self {
            Self::Ridge { refinement, .. } if RIDGE => refinement.as_ref(),
            _ => None,
        }
    }

    /// The predicted loss, if the recipe has it.
    #[must_use]
    pub fn prediction(&self) -> Option<&Prediction<'a>> {
        match self {
            Self::Ridge { prediction, .. } if RIDGE => prediction.as_ref(),
            _ => None,
        }
    }

    /// The number of parameters; 0 for Linear.
    fn parameters(&self) -> usize {
        match self {
            Self::Sgd(sgd) => sgd.initial.len(),
            Self::Ridge { .. } => self.refinement().map_or(0, |each| each.steps.initial.len()),
        }
    }

    /// The number of values of a fit: the model's parameters, or a coefficient for each component and channel.
    #[must_use]
    pub fn values(&self) -> usize {
        let components = self.coefficients().map_or(0, Coefficients::components);
        match self.parameters() {
            0 => components.saturating_mul(3),
            parameters => parameters,
        }
    }

    /// Returns true if a fit tolerates missing readings.
    #[must_use]
    pub fn tolerates_missing(&self) -> bool {
        self.coefficients().is_some_and(|each| match each.net {
            Some(net) => net.missing != 0,
            None => each.noise.is_some(),
        })
    }

    /// The checksum of the host's basis, which turns Linear's coefficients into a BRDF. None without a basis.
    #[must_use]
    pub fn basis_checksum(&self) -> Option<u32> {
        let checksum = self.coefficients()?.ridge.basis_checksum;
        Some(checksum).filter(|checksum| *checksum != 0)
    }

    /// Returns the smallest BRDF y (sr^-1) that the loss or the mapping accepts at a sample.
    ///
    /// A dark-subtracted reading may be below 0, but the argument of the logarithm has to stay positive. At the bound,
    /// 1 + y cos(theta_i) is 1/2, or y w + e is e / 2.
    #[must_use]
    pub fn min_reading(&self, at: &HalfDifference<f32>) -> f32 {
        let of_loss = -0.5 / at.cos_theta_i();
        let weight = at.cos_theta_i() * at.cos_theta_o();
        match self {
            Self::Sgd(_) => of_loss,
            Self::Ridge { .. } => of_loss.max(-0.5 * EPSILON as f32 / weight),
        }
    }

    /// Words before those of the coefficients.
    fn refinement_words(&self) -> usize {
        self.refinement().map_or(0, Refinement::words)
    }

    /// The memory of a fit, in words and without the samples.
    #[must_use]
    pub fn words(&self, samples: usize) -> usize {
        match self {
            Self::Sgd(sgd) => sgd.words(),
            Self::Ridge { coefficients, .. } => {
                let words = coefficients.words(samples);
                self.refinement_words().saturating_add(words)
            }
        }
    }

    /// The memory of a scan in words: the samples, and the fit. Not inlined, because parsing and a scan compute it.
    #[inline(never)]
    #[must_use]
    pub fn scan_words(&self, samples: usize) -> usize {
        let slots = samples.saturating_mul(SLOT_WORDS);
        slots.saturating_add(self.words(samples))
    }

    /// The units of work of a fit.
    #[must_use]
    pub fn units(&self, samples: usize) -> u32 {
        match self {
            Self::Sgd(sgd) => sgd.units(samples),
            Self::Ridge { coefficients, .. } => {
                let refinement = self.refinement().map_or(0, |each| each.units(samples));
                coefficients.units(samples).saturating_add(refinement)
            }
        }
    }

    /// Initializes `words` for a fit.
    #[inline(never)]
    pub fn start(&self, words: &mut [f32], channels: Channels) {
        words.fill(0.0);
        let initial = match self {
            Self::Sgd(sgd) => sgd.initial,
            Self::Ridge { .. } => match self.refinement() {
                Some(refinement) => refinement.steps.initial,
                None => return,
            },
        };
        for (parameter, value) in words.iter_mut().zip(initial.iter()) {
            *parameter = value;
        }
        keep_gray(words, self.model(), channels);
    }

    /// Writes the coefficients of each channel, instead of the units of work that compute them. Returns their number.
    #[cfg(feature = "training")]
    pub(crate) fn set_coefficients(
        &self,
        words: &mut [f32],
        samples: usize,
        values: [&[f32]; 3],
    ) -> u32 {
        let Some(coefficients) = self.coefficients() else {
            return 0;
        };
        let state = words.get_mut(self.refinement_words()..).unwrap_or_default();
        let lists = state.chunks_exact_mut(coefficients.components().max(1));
        for (list, values) in lists.zip(values) {
            for (entry, value) in list.iter_mut().zip(values) {
                *entry = *value;
            }
        }
        coefficients.units(samples)
    }

    /// Does the units of work from `done` to before `end`. The result of a fit does not depend on these ranges.
    #[inline(never)]
    pub fn advance(
        &self,
        functions: &Functions,
        words: &mut [f32],
        readings: Readings<'_>,
        done: u32,
        end: u32,
    ) {
        if let Self::Sgd(sgd) = self {
            return (functions.descend)(sgd, words, readings, done..end);
        }
        let Some(coefficients) = self.coefficients() else {
            return;
        };
        let before = coefficients.units(readings.0.len());
        let split = words.split_at_mut_checked(self.refinement_words());
        let (words, state) = split.unwrap_or_default();
        coefficients.advance(done..end.min(before), readings.0, state);
        if let Some(refinement) = self.refinement()
            && end > before
        {
            let units = done.saturating_sub(before)..end.saturating_sub(before);
            let lists = coefficients.coefficients(state);
            (functions.refine)(refinement, words, readings, lists, units);
        }
    }

    /// The words of the stages net and ridge.
    fn state<'w>(&self, words: &'w [f32]) -> &'w [f32] {
        words.get(self.refinement_words()..).unwrap_or_default()
    }

    /// The values of a fit: the parameters in the first list, or the coefficients of each channel.
    #[must_use]
    pub fn values_of<'w>(&self, words: &'w [f32]) -> [&'w [f32]; 3] {
        match (self.parameters(), self.coefficients()) {
            (0, Some(coefficients)) => coefficients.coefficients(words),
            (parameters, _) => [words.get(..parameters).unwrap_or_default(), &[], &[]],
        }
    }

    /// Returns true if all results of a complete fit are finite.
    #[inline(never)]
    pub(crate) fn is_finite(&self, words: &[f32]) -> bool {
        let state = self.state(words);
        let coefficients = self.coefficients();
        let coefficients = coefficients.map_or([&[][..]; 3], |each| each.coefficients(state));
        let mut lists = self.values_of(words).into_iter().chain(coefficients);
        lists.all(is_finite)
            && self
                .refinement()
                .is_none_or(|each| each.has_finite_start(words))
    }

    /// Returns the loss of a complete fit, predicted from its readings and its mean residual. None if the recipe has no
    /// prediction.
    pub(crate) fn predicted_loss(
        &self,
        words: &[f32],
        residual: f32,
        readings: u16,
    ) -> Option<PredictedLoss> {
        let (coefficients, prediction) = self.coefficients().zip(self.prediction())?;
        let state = self.state(words);
        let innovation = coefficients.innovation(state);
        let lists = coefficients.coefficients(state);
        Some(prediction.loss(lists, innovation, residual, readings))
    }

    /// Returns true if the recipe bounds the loss of a fit with some of the readings.
    pub(crate) fn bounds_partial_loss(&self) -> bool {
        let prediction = self.prediction();
        self.tolerates_missing() && prediction.is_some_and(|each| !each.partial_bound.is_empty())
    }

    /// Returns the modeled BRDF (linear RGB, sr^-1, not times the cosine) at a sample of the pattern.
    #[inline(never)]
    #[must_use]
    pub fn at_sample(
        &self,
        functions: &Functions,
        words: &[f32],
        index: usize,
        at: &HalfDifference<f32>,
    ) -> [f32; 3] {
        match (self.parameters(), self.coefficients()) {
            (0, Some(coefficients)) => {
                let lists = coefficients.coefficients(words);
                let center = coefficients.ridge.center;
                brdf_at(coefficients.rows(), center, index, at, lists)
            }
            (parameters, _) => (functions.brdf)(words.get(..parameters).unwrap_or_default(), at),
        }
    }

    /// Returns the modeled BRDF (linear RGB, sr^-1, not times the cosine) anywhere above the horizon. None for Linear
    /// without a basis.
    #[inline(never)]
    pub(crate) fn brdf(
        &self,
        functions: &Functions,
        words: &[f32],
        basis: Option<&Basis<'_>>,
        at: &HalfDifference<f32>,
    ) -> Option<[f32; 3]> {
        match self.parameters() {
            0 => (functions.look_up)(basis?, self.values_of(words), at),
            parameters => Some((functions.brdf)(
                words.get(..parameters).unwrap_or_default(),
                at,
            )),
        }
    }
}

/// Returns true if all values of a list are finite. Not inlined, because it is called for each list.
#[inline(never)]
pub(crate) fn is_finite(list: &[f32]) -> bool {
    list.iter().all(|value| value.is_finite())
}
