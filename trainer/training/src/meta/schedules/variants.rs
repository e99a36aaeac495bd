//! Variants of plans that train fewer or more parts of a recipe.

use glimpse_optimizer::Groups;

use crate::meta::phase::{Initialization, InnerSamples, Phase};
use crate::meta::plan::{Plan, PretrainedInit};

impl Plan {
    /// Removes the pattern, as in the method Meta. Phases that train initial parameters and step sizes on the pattern
    /// use `samples` fixed random samples instead.
    #[must_use]
    pub fn without_pattern(mut self, samples: usize) -> Self {
        self.phases.retain(|phase| {
            let Groups {
                initial,
                hyperparameters,
                ..
            } = phase.rates;
            phase.inner_samples != InnerSamples::Pattern || initial > 0.0 || hyperparameters > 0.0
        });
        for phase in &mut self.phases {
            if phase.inner_samples == InnerSamples::Pattern {
                phase.inner_samples = InnerSamples::Fixed(samples);
                phase.rates.pattern = 0.0;
            }
        }
        self
    }

    /// Trains only the pattern. The initial parameters and step sizes stay constant: the pretrained ones, or else those
    /// of an untrained run.
    #[must_use]
    pub fn pattern_only(mut self, pretrained: Option<PretrainedInit>) -> Self {
        let mut removed = None;
        self.phases.retain_mut(|phase| {
            if phase.inner_samples != InnerSamples::Pattern {
                removed = removed.or(Some(phase.initialization));
                return false;
            }
            // A removed phase passes its initialization to its successor.
            if let Some(initialization) = removed.take()
                && phase.initialization == Initialization::Previous
            {
                phase.initialization = initialization;
            }
            phase.rates.initial = 0.0;
            phase.rates.hyperparameters = 0.0;
            true
        });
        self.pretrained = pretrained;
        self
    }

    /// Appends the last stages again: initial parameters and step sizes, now on the trained pattern, and then the
    /// pattern (paper, "Convergence").
    #[must_use]
    pub fn twice(mut self) -> Self {
        let samples = self.phases.last().map_or(0, |phase| phase.samples);
        let trains_parameters = |phase: &&Phase| phase.rates.initial > 0.0;
        let parameters = self.phases.iter().rfind(trains_parameters).cloned();
        let pattern = self.phases.last().cloned();
        self.phases
            .extend(parameters.into_iter().chain(pattern).map(|phase| Phase {
                initialization: Initialization::Best,
                inner_samples: InnerSamples::Pattern,
                samples,
                ..phase
            }));
        self
    }

    /// Keeps the initial step sizes (Linear: precisions) constant.
    #[must_use]
    pub fn without_step_sizes(mut self) -> Self {
        for phase in &mut self.phases {
            phase.rates.hyperparameters = 0.0;
        }
        self
    }
}
