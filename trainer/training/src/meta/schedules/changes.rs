//! Plans for a part of what a recipe holds, or for more.

use glimpse_optimizer::Groups;

use crate::meta::phase::{InnerSamples, Phase, Start};
use crate::meta::plan::{Plan, PretrainedInit};

impl Plan {
    /// What the method Meta trains: all but the pattern. Where start and step sizes would learn
    /// on the pattern they learn on as many random samples.
    #[must_use]
    pub fn without_pattern(mut self, samples: usize) -> Self {
        self.phases.retain(|phase| {
            let Groups {
                initial,
                hyperparameters,
                ..
            } = phase.rates;
            phase.inner != InnerSamples::Pattern || initial > 0.0 || hyperparameters > 0.0
        });
        for phase in &mut self.phases {
            if phase.inner == InnerSamples::Pattern {
                phase.inner = InnerSamples::Random(samples);
                phase.rates.pattern = 0.0;
            }
        }
        self
    }

    /// The pattern alone, for a start and step sizes that are known; those stay as they are.
    #[must_use]
    pub fn pattern_only(mut self, known: PretrainedInit) -> Self {
        let mut begin = None;
        self.phases.retain_mut(|phase| {
            if phase.inner != InnerSamples::Pattern {
                begin = begin.or(Some(phase.start));
                return false;
            }
            // What a phase that is gone would have begun with.
            if let Some(start) = begin.take()
                && phase.start == Start::Previous
            {
                phase.start = start;
            }
            phase.rates.initial = 0.0;
            phase.rates.hyperparameters = 0.0;
            true
        });
        self.known = Some(known);
        self
    }

    /// Once more through the last stages after the end: start and step sizes, now on the pattern
    /// that was learned, and then the pattern (paper, "Convergence").
    #[must_use]
    pub fn twice(mut self) -> Self {
        let samples = self.phases.last().map_or(0, |phase| phase.samples);
        let learns_start = |phase: &&Phase| phase.rates.initial > 0.0;
        let start = self.phases.iter().rfind(learns_start).cloned();
        let pattern = self.phases.last().cloned();
        self.phases
            .extend(start.into_iter().chain(pattern).map(|phase| Phase {
                start: Start::Best,
                inner: InnerSamples::Pattern,
                samples,
                ..phase
            }));
        self
    }

    /// Step sizes (Linear: precisions) stay as they begin.
    #[must_use]
    pub fn without_step_sizes(mut self) -> Self {
        for phase in &mut self.phases {
            phase.rates.hyperparameters = 0.0;
        }
        self
    }
}
