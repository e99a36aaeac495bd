//! The model Linear: a ridge solve or a completion, in slices of work and in the caller's memory.

use super::algorithm::{Algorithm, Channels, wrong_model};
use super::learned::Ridge;
use super::method::{COMPLETION, FitMethod, RIDGE};
use super::ridge::{dot, factor_length, scratch_length};
use crate::error::Error;
use crate::geometry::HalfDifference;
use crate::model::linear::{Basis, map, unmap};
use crate::model::{ModelKind, Samples};

/// Number of color channels. Each has its own coefficients.
const CHANNELS: usize = 3;

/// The model Linear: principal components of measured materials, fitted by a ridge solve or a learned map.
///
/// The values of a fit are the coefficients: m for red, m for green, m for blue. A
/// [`Basis`](crate::model::linear::Basis) converts them to a BRDF.
///
/// A unit of work is a row of the factorization or a channel of the solve. In a completion it is a reading, the hidden
/// units, or a channel.
#[derive(Clone, Copy, Debug)]
pub struct Linear;

/// Returns the memory of a ridge solve in words, for n samples and m components.
pub(crate) const fn linear_words(samples: usize, components: usize) -> usize {
    CHANNELS * components
        + samples
        + factor_length(samples, components)
        + scratch_length(samples, components)
}

/// The memory of a ridge solve, split into its parts.
struct Parts<'w> {
    /// Three lists of m.
    coefficients: &'w mut [f32],
    /// The mapped readings t of one channel, n.
    mapped: &'w mut [f32],
    factors: &'w mut [f32],
    scratch: &'w mut [f32],
}

impl<'w> Parts<'w> {
    /// Splits the memory. None if there are fewer words than [`linear_words`].
    fn split(words: &'w mut [f32], ridge: &Ridge<'_>) -> Option<Self> {
        let (samples, components) = (ridge.problem.samples(), ridge.components());
        let (coefficients, rest) = words.split_at_mut_checked(CHANNELS * components)?;
        let (mapped, rest) = rest.split_at_mut_checked(samples)?;
        let (factors, scratch) = rest.split_at_mut_checked(factor_length(samples, components))?;
        Some(Self {
            coefficients,
            mapped,
            factors,
            scratch,
        })
    }
}

impl Algorithm for Linear {
    fn words(method: &FitMethod<'_>, samples: usize) -> Result<usize, Error> {
        match method {
            FitMethod::Ridge(ridge) => Ok(linear_words(samples, ridge.components())),
            FitMethod::Completed(completed) if completed.model() == ModelKind::Linear => {
                Ok(completed.words())
            }
            _ => Err(wrong_model(ModelKind::Linear, method.model())),
        }
    }

    fn total(method: &FitMethod<'_>, samples: usize) -> u32 {
        match method {
            FitMethod::Ridge(ridge) => (ridge.problem.order() + CHANNELS) as u32,
            FitMethod::Completed(completed) => completed.units(samples),
            FitMethod::Descent(_) => 0,
        }
    }

    fn start(words: &mut [f32], _: &FitMethod<'_>, _: Channels) {
        words.fill(0.0);
    }

    #[inline(never)] // because callers are compiled for speed
    fn advance(
        words: &mut [f32],
        method: &FitMethod<'_>,
        samples: Samples<'_>,
        _: Channels,
        done: u32,
        budget: u32,
    ) -> u32 {
        let end = done
            .saturating_add(budget)
            .min(Self::total(method, samples.len()));
        if COMPLETION && let FitMethod::Completed(completed) = method {
            (done..end).for_each(|unit| completed.advance(unit, samples, words));
            return end.max(done);
        }
        let (true, FitMethod::Ridge(ridge)) = (RIDGE, method) else {
            return done;
        };
        let rows = ridge.problem.order() as u32;
        for unit in done..end {
            let Some(parts) = Parts::split(words, ridge) else {
                return done;
            };
            match unit.checked_sub(rows) {
                None => {
                    let (factors, scratch) = (parts.factors, parts.scratch);
                    ridge.problem.factorize_row(factors, unit as usize, scratch);
                }
                Some(channel) => solve_channel(parts, ridge, samples, channel as usize),
            }
        }
        end.max(done)
    }

    fn values<'w>(words: &'w [f32], method: &FitMethod<'_>) -> [&'w [f32]; CHANNELS] {
        channels(words, method)
    }

    fn predicted_loss(words: &[f32], method: &FitMethod<'_>) -> Option<f32> {
        match method {
            FitMethod::Completed(completed) if COMPLETION => completed.predicted_loss(words),
            _ => None,
        }
    }

    fn innovation(words: &[f32], method: &FitMethod<'_>) -> Option<f32> {
        match method {
            FitMethod::Completed(completed) if COMPLETION => completed.innovation(words),
            _ => None,
        }
    }

    #[inline(never)] // because callers are compiled for speed
    fn at_sample(
        words: &[f32],
        method: &FitMethod<'_>,
        index: usize,
        at: &HalfDifference<f32>,
    ) -> [f32; 3] {
        let mut modeled = [0.0; CHANNELS];
        let channels = channels(words, method);
        if COMPLETION
            && let FitMethod::Completed(completed) = method
            && let Some(at_samples) = completed.at_samples()
        {
            let weight = at.cos_theta_i() * at.cos_theta_o();
            let center = completed.center.iter().nth(index).unwrap_or_default();
            for (f, coefficients) in modeled.iter_mut().zip(channels) {
                let mapped = at_samples.combine(index, center, coefficients);
                *f = unmap(mapped, 0.0, weight);
            }
        }
        let (true, FitMethod::Ridge(ridge)) = (RIDGE, method) else {
            return modeled;
        };
        let components = ridge.components().max(1);
        let mut rows = ridge.basis.words().chunks_exact(components);
        let number = |list: crate::numeric::Floats<'_>| list.iter().nth(index).unwrap_or_default();
        let (mean, median, weight) = (
            number(ridge.mean),
            number(ridge.median),
            number(ridge.weight),
        );
        if let Some(row) = rows.nth(index) {
            for (f, coefficients) in modeled.iter_mut().zip(channels) {
                *f = unmap(dot(row, coefficients) + mean, median, weight);
            }
        }
        modeled
    }

    #[inline(never)] // because callers are compiled for speed
    fn brdf(
        words: &[f32],
        method: &FitMethod<'_>,
        basis: Option<&Basis<'_>>,
        at: &HalfDifference<f32>,
    ) -> Option<[f32; 3]> {
        basis?.brdf(channels(words, method), at)
    }
}

/// Returns the coefficients of each channel.
fn channels<'w>(words: &'w [f32], method: &FitMethod<'_>) -> [&'w [f32]; CHANNELS] {
    match method {
        FitMethod::Ridge(ridge) => {
            let mut channels = words.chunks_exact(ridge.components().max(1));
            [(); CHANNELS].map(|()| channels.next().unwrap_or_default())
        }
        FitMethod::Completed(completed) => completed.coefficients(words),
        FitMethod::Descent(_) => [&[]; CHANNELS],
    }
}

/// Computes the coefficients of a channel with the factorized problem. Not inlined, so that its stack is released
/// between slices.
#[inline(never)]
fn solve_channel(parts: Parts<'_>, ridge: &Ridge<'_>, samples: Samples<'_>, channel: usize) {
    let at = ridge.mean.iter().zip(ridge.median.iter());
    let at = at.zip(ridge.weight.iter());
    for ((t, sample), ((mean, median), weight)) in
        parts.mapped.iter_mut().zip(samples.iter()).zip(at)
    {
        let brdf = sample.measured.get(channel).copied().unwrap_or_default();
        *t = map(brdf, median, weight) - mean;
    }
    let mut channels = parts
        .coefficients
        .chunks_exact_mut(ridge.components().max(1));
    if let Some(coefficients) = channels.nth(channel) {
        // This cannot fail, because `accept` has refused recipes with other lengths.
        let factors = ridge.problem.factors(&*parts.factors);
        let _ = factors.coefficients(parts.mapped, coefficients, parts.scratch);
    }
}
