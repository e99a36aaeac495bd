//! The model Linear: a ridge solve in slices, in memory of the caller's.

use super::completed::{Completed, Components, Target};
use super::fitter::{Fitter, FitterError, is_finite};
use super::ridge::{dot, factor_length, scratch_length};
use super::{FitMethod, Ridge};
use crate::geometry::HalfDifference;
use crate::model::linear::{Basis, map, unmap};
use crate::model::{ModelKind, Sample};

/// The colour channels, each with coefficients of its own.
const CHANNELS: usize = 3;

/// The model Linear, with room for a solve of `WORDS` numbers: [`linear_words`] says how many that
/// are. By a recipe that completes readings there is no solve, and
/// [`CoefficientNet::words`](super::coefficient_net::CoefficientNet::words) says it, at most 4 times
/// [`MAX_ROWS`](super::MAX_ROWS).
///
/// ```
/// use glimpse_core::fit::{Linear, linear_words};
/// use glimpse_core::scan::Memory;
///
/// // Up to 8 samples, and 5 components.
/// static mut MEMORY: Memory<Linear<{ linear_words(8, 5) }>, 8> = Memory::new();
/// ```
///
/// A unit of its work is a row of the factorization or a channel of the solve; of a completion it is a
/// reading, the hidden units, or a channel.
#[derive(Clone, Copy, Debug)]
pub struct Linear<const WORDS: usize>;

/// Numbers that the solve takes in memory with so many samples and components (n and m): a constant,
/// for [`Linear`] and [`AnyModel`](super::AnyModel). `trainer inspect` shows both of a recipe.
///
/// ```
/// use glimpse_core::fit::linear_words;
///
/// const WORDS: usize = linear_words(8, 5);
/// assert!(4 * WORDS < 600); // bytes
/// ```
#[must_use]
pub const fn linear_words(samples: usize, components: usize) -> usize {
    CHANNELS * components
        + samples
        + factor_length(samples, components)
        + scratch_length(samples, components)
}

/// A workspace taken apart.
struct Parts<'w> {
    /// Three runs of m.
    coefficients: &'w mut [f32],
    /// t of one channel, n.
    mapped: &'w mut [f32],
    factors: &'w mut [f32],
    scratch: &'w mut [f32],
}

impl<'w> Parts<'w> {
    /// None if there are fewer words than [`linear_words`].
    fn of(words: &'w mut [f32], ridge: &Ridge<'_>) -> Option<Self> {
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

impl<const WORDS: usize> Fitter for Linear<WORDS> {
    type Workspace = [f32; WORDS];
    const EMPTY: [f32; WORDS] = [0.0; WORDS];

    fn accept(method: &FitMethod<'_>, samples: usize) -> Result<(), FitterError> {
        let needed = match method {
            FitMethod::Ridge(ridge) => linear_words(samples, ridge.components()),
            FitMethod::Completed(completed) if completed.model() == ModelKind::Linear => {
                completed.completion.words()
            }
            _ => {
                return Err(FitterError::Model {
                    firmware: ModelKind::Linear,
                    recipe: method.model(),
                });
            }
        };
        if needed > WORDS {
            let found = WORDS;
            return Err(FitterError::Words { needed, found });
        }
        Ok(())
    }

    fn total(method: &FitMethod<'_>, samples: usize) -> u32 {
        match method {
            FitMethod::Ridge(ridge) => (ridge.problem.order() + CHANNELS) as u32,
            FitMethod::Completed(completed) => completed.units(samples),
            FitMethod::Descent(_) => 0,
        }
    }

    fn start(workspace: &mut [f32; WORDS], _: &FitMethod<'_>) {
        workspace.fill(0.0);
    }

    fn advance(
        workspace: &mut [f32; WORDS],
        method: &FitMethod<'_>,
        samples: &[Sample<f32>],
        done: u32,
        budget: u32,
    ) -> u32 {
        let end = done
            .saturating_add(budget)
            .min(Self::total(method, samples.len()));
        if let FitMethod::Completed(completed) = method {
            (done..end).for_each(|unit| completed.advance(unit, samples, workspace));
            return end.max(done);
        }
        let FitMethod::Ridge(ridge) = method else {
            return done;
        };
        let rows = ridge.problem.order() as u32;
        for unit in done..end {
            let Some(parts) = Parts::of(workspace, ridge) else {
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

    fn values<'w>(
        workspace: &'w [f32; WORDS],
        method: FitMethod<'w>,
    ) -> impl Iterator<Item = f32> + 'w {
        let channels = channels(workspace, &method);
        channels.into_iter().flatten().copied()
    }

    fn is_finite(workspace: &[f32; WORDS], method: &FitMethod<'_>) -> bool {
        channels(workspace, method).into_iter().all(is_finite)
    }

    fn predicted_loss(workspace: &[f32; WORDS], method: &FitMethod<'_>) -> Option<f32> {
        match method {
            FitMethod::Completed(completed) => {
                completed.predicted_loss(completed.completion.coefficients(workspace))
            }
            _ => None,
        }
    }

    fn at_sample(
        workspace: &[f32; WORDS],
        method: &FitMethod<'_>,
        index: usize,
        at: &HalfDifference<f32>,
    ) -> [f32; 3] {
        let mut modelled = [0.0; CHANNELS];
        let channels = channels(workspace, method);
        if let FitMethod::Completed(completed) = method
            && let Target::Linear(components) = &completed.target
        {
            let weight = at.cos_theta_i() * at.cos_theta_o();
            for (f, coefficients) in modelled.iter_mut().zip(channels) {
                let mapped = mapped_at(completed, components, index, coefficients);
                *f = unmap(mapped, 0.0, weight);
            }
        }
        let FitMethod::Ridge(ridge) = method else {
            return modelled;
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
            for (f, coefficients) in modelled.iter_mut().zip(channels) {
                *f = unmap(dot(row, coefficients) + mean, median, weight);
            }
        }
        modelled
    }

    fn brdf(
        workspace: &[f32; WORDS],
        method: &FitMethod<'_>,
        basis: Option<&Basis<'_>>,
        at: &HalfDifference<f32>,
    ) -> Option<[f32; 3]> {
        basis?.brdf(channels(workspace, method), at)
    }
}

/// The coefficients of each channel.
fn channels<'w>(workspace: &'w [f32], method: &FitMethod<'_>) -> [&'w [f32]; CHANNELS] {
    match method {
        FitMethod::Ridge(ridge) => {
            let mut channels = workspace.chunks_exact(ridge.components().max(1));
            [(); CHANNELS].map(|()| channels.next().unwrap_or_default())
        }
        FitMethod::Completed(completed) => completed.completion.coefficients(workspace),
        FitMethod::Descent(_) => [&[]; CHANNELS],
    }
}

/// What coefficients make of a sample of the pattern, mapped. Out of line: it is there once, and its
/// temporaries are off the stack afterwards.
#[inline(never)]
fn mapped_at(
    completed: &Completed<'_>,
    components: &Components<'_>,
    index: usize,
    coefficients: &[f32],
) -> f32 {
    let length = components.scales.len();
    let mut sum = completed.centre.iter().nth(index).unwrap_or_default();
    if let Some(row) = components.rows.chunks_exact(length.max(1)).nth(index) {
        for ((entry, scale), a) in row.iter().zip(components.scales.iter()).zip(coefficients) {
            sum += f32::from(entry.cast_signed()) * scale * a;
        }
    }
    sum
}

/// The coefficients of a channel, the problem being factorized. Out of line: what it takes of the
/// stack is given back between slices.
#[inline(never)]
fn solve_channel(parts: Parts<'_>, ridge: &Ridge<'_>, samples: &[Sample<f32>], channel: usize) {
    let at = ridge.mean.iter().zip(ridge.median.iter());
    let at = at.zip(ridge.weight.iter());
    for ((t, sample), ((mean, median), weight)) in parts.mapped.iter_mut().zip(samples).zip(at) {
        let brdf = sample.measured.get(channel).copied().unwrap_or_default();
        *t = map(brdf, median, weight) - mean;
    }
    let mut channels = parts
        .coefficients
        .chunks_exact_mut(ridge.components().max(1));
    if let Some(coefficients) = channels.nth(channel) {
        // All lengths fit, or `accept` would have refused the recipe: this cannot fail.
        let factors = ridge.problem.factors(&*parts.factors);
        let _ = factors.coefficients(parts.mapped, coefficients, parts.scratch);
    }
}
