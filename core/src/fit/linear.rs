//! The model Linear: a ridge solve in slices, in memory of the caller's.

use super::fitter::{Fitter, FitterError, is_finite};
use super::ridge::{dot, factor_length, scratch_length};
use super::{Learner, Ridge};
use crate::geometry::HalfDifference;
use crate::model::linear::{Basis, map, unmap};
use crate::model::{ModelKind, Sample};

/// The colour channels, each with coefficients of its own.
const CHANNELS: usize = 3;

/// The model Linear, with room for a solve of `WORDS` numbers: [`linear_words`] says how many that
/// are.
///
/// ```
/// use glimpse_core::fit::{Linear, linear_words};
/// use glimpse_core::scan::Memory;
///
/// // Up to 8 samples, and 5 components.
/// static mut MEMORY: Memory<Linear<{ linear_words(8, 5) }>, 8> = Memory::new();
/// ```
///
/// A unit of its work is a row of the factorization or a channel of the solve.
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

    fn accept(learner: &Learner<'_>, samples: usize) -> Result<(), FitterError> {
        let Learner::Ridge(ridge) = learner else {
            return Err(FitterError::Model {
                firmware: ModelKind::Linear,
                recipe: learner.model(),
            });
        };
        let needed = linear_words(samples, ridge.components());
        if needed > WORDS {
            let found = WORDS;
            return Err(FitterError::Words { needed, found });
        }
        Ok(())
    }

    fn total(learner: &Learner<'_>, _: usize) -> u32 {
        match learner {
            Learner::Ridge(ridge) => (ridge.problem.order() + CHANNELS) as u32,
            Learner::Descent(_) => 0,
        }
    }

    fn start(workspace: &mut [f32; WORDS], _: &Learner<'_>) {
        workspace.fill(0.0);
    }

    fn advance(
        workspace: &mut [f32; WORDS],
        learner: &Learner<'_>,
        samples: &[Sample<f32>],
        done: u32,
        budget: u32,
    ) -> u32 {
        let Learner::Ridge(ridge) = learner else {
            return done;
        };
        let rows = ridge.problem.order() as u32;
        let end = done
            .saturating_add(budget)
            .min(Self::total(learner, samples.len()));
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
        learner: Learner<'w>,
    ) -> impl Iterator<Item = f32> + 'w {
        coefficients(workspace, &learner).iter().copied()
    }

    fn is_finite(workspace: &[f32; WORDS], learner: &Learner<'_>) -> bool {
        is_finite(coefficients(workspace, learner))
    }

    fn at_sample(
        workspace: &[f32; WORDS],
        learner: &Learner<'_>,
        index: usize,
        _: &HalfDifference<f32>,
    ) -> [f32; 3] {
        let mut modelled = [0.0; CHANNELS];
        let Learner::Ridge(ridge) = learner else {
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
            let channels = coefficients(workspace, learner).chunks_exact(components);
            for (f, coefficients) in modelled.iter_mut().zip(channels) {
                *f = unmap(dot(row, coefficients) + mean, median, weight);
            }
        }
        modelled
    }

    fn brdf(
        workspace: &[f32; WORDS],
        learner: &Learner<'_>,
        basis: Option<&Basis<'_>>,
        at: &HalfDifference<f32>,
    ) -> Option<[f32; 3]> {
        let coefficients = coefficients(workspace, learner);
        let (red, rest) = coefficients.split_at_checked(coefficients.len() / CHANNELS)?;
        let (green, blue) = rest.split_at_checked(red.len())?;
        basis?.brdf([red, green, blue], at)
    }
}

/// Three runs of m.
fn coefficients<'w>(workspace: &'w [f32], learner: &Learner<'_>) -> &'w [f32] {
    let Learner::Ridge(ridge) = learner else {
        return &[];
    };
    workspace
        .get(..CHANNELS * ridge.components())
        .unwrap_or_default()
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
