//! Schedules: what is trained when, for how long, at which rates.

use glimpse_core::model::ModelKind;
use rand_chacha::ChaCha8Rng;

use super::parameters::Groups;
pub use super::phase::{Added, InnerSamples, Keep, Phase, Search, Start, StepSizeForm};
use super::start::{first_guess, random_start};

/// How the parts of a recipe are trained.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Schedule {
    /// Start, step sizes and pattern together, for the n at hand, from the best of several tries.
    Joint,
    /// The paper's two stages: initialisation and step sizes on fresh samples, then the pattern
    /// alone.
    Paper,
}

/// How long to train.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Effort {
    /// Seconds: to try things out. (Schedule paper: 1/100 of the paper's steps.)
    Quick,
    /// Minutes: for use. (Schedule paper: 1/10.)
    Standard,
    /// An hour or so: for the last few per cent. (Schedule paper: all of the paper's steps.)
    Long,
}

/// A whole training run, but for the materials.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The phases, in order. The last one trains for the n at hand.
    pub phases: Vec<Phase>,
    /// How many materials there are to train on.
    pub tasks: usize,
    /// Where initial parameters begin.
    pub first_guess: fn(ModelKind, &mut ChaCha8Rng) -> Vec<f32>,
    /// What is optimized for the step sizes.
    pub step_size_form: StepSizeForm,
    /// The step size that all parameters begin with.
    pub first_step_size: f32,
    /// Start and step sizes that are known already, instead of the first guess.
    pub known: Option<Known>,
}

/// A start and step sizes that are trained already.
#[derive(Clone, Debug, PartialEq)]
pub struct Known {
    /// theta_0.
    pub initial: Vec<f32>,
    /// alpha.
    pub step_sizes: Vec<f32>,
}

impl Plan {
    /// The plan for a model and a number of samples; `tasks` is the number of materials.
    #[must_use]
    pub fn new(
        schedule: Schedule,
        effort: Effort,
        model: ModelKind,
        samples: usize,
        tasks: usize,
    ) -> Self {
        match schedule {
            Schedule::Joint if model == ModelKind::Linear => joint_linear(effort, samples, tasks),
            Schedule::Joint if model != ModelKind::Neural => joint_small(effort, samples, tasks),
            Schedule::Joint => joint(effort, samples, tasks),
            Schedule::Paper => paper(effort, model, samples, tasks),
        }
    }

    /// What the method Meta trains: all but the pattern. Where start and step sizes would learn
    /// on the pattern they learn on as many random samples.
    #[must_use]
    pub fn without_pattern(mut self, samples: usize) -> Self {
        self.phases.retain(|phase| {
            let Groups {
                initial,
                step_sizes,
                ..
            } = phase.rates;
            phase.inner != InnerSamples::Pattern || initial > 0.0 || step_sizes > 0.0
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
    pub fn pattern_only(mut self, known: Known) -> Self {
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
            phase.rates.step_sizes = 0.0;
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
            phase.rates.step_sizes = 0.0;
        }
        self
    }

    /// Outer steps of all phases.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.phases.iter().map(|phase| phase.steps).sum()
    }

    /// The phase, and the step in it, that come after so many outer steps; None at the end.
    #[must_use]
    pub fn at(&self, done: usize) -> Option<(usize, usize)> {
        let mut step = done;
        for (index, phase) in self.phases.iter().enumerate() {
            if step < phase.steps {
                return Some((index, step));
            }
            step -= phase.steps;
        }
        None
    }
}

/// Which of several starts is good shows only after a while, and not by its training loss: each
/// is trained for a short time, and the one that does best on unseen materials goes on.
fn joint(effort: Effort, samples: usize, tasks: usize) -> Plan {
    let initial = 1e-3;
    let (starts, first, second, last, gentle, generations) = match effort {
        Effort::Quick => (3, 500, 1_500, 12_000, 0.5, 150),
        Effort::Standard => (6, 1_000, 4_000, 80_000, 0.3, 500),
        Effort::Long => (12, 2_000, 8_000, 240_000, 0.3, 2_000),
    };
    // A step takes the longer the more samples there are, and brings less.
    let last = (last * 64 / samples.max(64)).max(last / 6);
    let learning = Phase {
        name: "trying starts",
        start: Start::Previous,
        search: Search::Gradient,
        keep: Keep::Nothing,
        samples,
        added: Added::Sobol,
        steps: first,
        batch: 16,
        // More than n: a few random samples alone say too little to begin on.
        inner: InnerSamples::Random(samples.max(32)),
        outer: 256,
        rates: Groups {
            initial,
            step_sizes: 1e-2,
            pattern: 0.0,
        },
        final_rate: 0.3,
        warm_up: 100,
        largest_norm: 1.0,
        weight_decay: 0.0,
        gain: Some(1.5),
    };
    let sampling = Phase {
        keep: Keep::BestValidation,
        steps: second,
        inner: InnerSamples::Pattern,
        rates: Groups {
            initial,
            step_sizes: 1e-2,
            pattern: 1e-2,
        },
        final_rate: 0.1,
        ..learning.clone()
    };
    let mut phases = Vec::new();
    for guess in 0..starts {
        phases.push(Phase {
            start: Start::Guess(guess),
            ..learning.clone()
        });
        phases.push(sampling.clone());
    }
    phases.push(Phase {
        name: "the best start",
        start: Start::Best,
        steps: last,
        // At the rates above a long run wanders off to worse places.
        rates: Groups {
            initial: gentle * initial,
            step_sizes: gentle * 1e-2,
            pattern: gentle * 1e-2,
        },
        final_rate: 0.01,
        warm_up: 200,
        ..sampling.clone()
    });
    if samples <= UNDOUBLED {
        phases.push(Phase {
            name: "evolving the pattern",
            start: Start::Best,
            search: Search::Evolution(24),
            steps: generations,
            outer: 512,
            rates: Groups {
                pattern: 0.1,
                ..Groups::default()
            },
            gain: None,
            ..sampling
        });
    }
    Plan {
        phases,
        tasks,
        first_guess,
        step_size_form: StepSizeForm::Logarithm,
        first_step_size: 3e-3,
        known: None,
    }
}

/// Patterns of more samples are doubled from those.
const UNDOUBLED: usize = 16;

/// How many samples there are after each doubling, from `first` until there are those `wanted`.
fn doubled(first: usize, wanted: usize) -> impl Iterator<Item = usize> {
    std::iter::successors(Some(first), move |n| {
        (*n < wanted).then_some((2 * n).min(wanted))
    })
    .skip(1)
}

/// For models of a few parameters: each of several starts follows its gradient for a while and then
/// evolves; the fittest one evolves on. Many samples make every start look like every other: they
/// come from doubling a pattern, as in the paper.
fn joint_small(effort: Effort, samples: usize, tasks: usize) -> Plan {
    let (starts, descent, first, last) = match effort {
        Effort::Quick => (3, 800, 150, 400),
        Effort::Standard => (8, 2_000, 500, 1_500),
        Effort::Long => (32, 4_000, 800, 4_000),
    };
    let wanted = samples;
    let samples = wanted.min(UNDOUBLED);
    let descending = Phase {
        name: "trying starts",
        start: Start::Previous,
        search: Search::Gradient,
        keep: Keep::Nothing,
        samples,
        added: Added::Sobol,
        steps: descent,
        batch: 16,
        inner: InnerSamples::Pattern,
        outer: 256,
        rates: Groups {
            initial: 3e-3,
            step_sizes: 1e-2,
            pattern: 1e-2,
        },
        final_rate: 0.1,
        warm_up: 100,
        largest_norm: 1.0,
        weight_decay: 0.0,
        gain: Some(1.2),
    };
    let evolving = Phase {
        name: "evolving starts",
        search: Search::Evolution(24),
        added: Added::Repeated,
        keep: Keep::Fittest,
        steps: first,
        outer: 512,
        rates: Groups {
            initial: 0.1,
            step_sizes: 0.1,
            pattern: 0.1,
        },
        gain: None,
        ..descending.clone()
    };
    let mut phases = Vec::new();
    for guess in 0..starts {
        phases.push(Phase {
            start: Start::Guess(guess),
            ..descending.clone()
        });
        phases.push(evolving.clone());
    }
    phases.push(Phase {
        name: "evolving the fittest",
        start: Start::Best,
        steps: last,
        ..evolving.clone()
    });
    phases.extend(doubled(samples, wanted).map(|samples| Phase {
        name: "evolving twice the samples",
        start: Start::Best,
        samples,
        steps: first,
        ..evolving.clone()
    }));
    Plan {
        phases,
        tasks,
        first_guess,
        step_size_form: StepSizeForm::Logarithm,
        first_step_size: 0.3,
        known: None,
    }
}

/// Precisions and pattern together, from the best of several patterns: which of them is good shows
/// early.
fn joint_linear(effort: Effort, samples: usize, tasks: usize) -> Plan {
    let (starts, first, last) = match effort {
        Effort::Quick => (3, 250, 1_000),
        Effort::Standard => (8, 1_000, 6_000),
        Effort::Long => (24, 2_000, 30_000),
    };
    let sampling = Phase {
        name: "trying patterns",
        start: Start::Previous,
        search: Search::Gradient,
        keep: Keep::BestValidation,
        samples,
        added: Added::Sobol,
        steps: first,
        batch: 16,
        inner: InnerSamples::Pattern,
        outer: 256,
        rates: Groups {
            initial: 0.0,
            step_sizes: 3e-2,
            pattern: 3e-2,
        },
        final_rate: 0.02,
        warm_up: 0,
        largest_norm: 1.0,
        weight_decay: 0.0,
        gain: None,
    };
    let mut phases: Vec<Phase> = (0..starts)
        .map(|guess| Phase {
            start: Start::Guess(guess),
            ..sampling.clone()
        })
        .collect();
    phases.push(Phase {
        name: "the best pattern",
        start: Start::Best,
        steps: last,
        rates: Groups {
            initial: 0.0,
            step_sizes: 1.5e-2,
            pattern: 1.5e-2,
        },
        ..sampling
    });
    Plan {
        phases,
        tasks,
        first_guess,
        step_size_form: StepSizeForm::Logarithm,
        first_step_size: 0.0,
        known: None,
    }
}

/// Of so many random patterns of one sample the best begins stage 2.
const GUESSES: usize = 50;

/// The paper's settings. Stage 1: initialisation and step sizes, 10,000 epochs. Stage 2: the
/// pattern, from the best of random guesses at n = 1, doubled until it has the n asked for, and
/// each n trained for 500 epochs. All of them with one task a step.
fn paper(effort: Effort, model: ModelKind, samples: usize, tasks: usize) -> Plan {
    let share = match effort {
        Effort::Quick => 100,
        Effort::Standard => 10,
        Effort::Long => 1,
    };
    let (rate, final_rate) = match model {
        ModelKind::Linear => (1e-3, 0.5),
        _ => (5e-4, 0.2),
    };
    let mut phases = Vec::new();
    let first = Phase {
        name: "start and step sizes",
        start: Start::Guess(0),
        search: Search::Gradient,
        keep: Keep::Last,
        // No pattern yet, but Meta is judged on one.
        samples,
        added: Added::Sobol,
        steps: 10_000 / share * tasks,
        batch: 1,
        inner: InnerSamples::Fresh(512),
        outer: 512,
        rates: Groups {
            initial: 1e-4,
            step_sizes: 1e-4,
            pattern: 0.0,
        },
        final_rate: 1.0,
        warm_up: 0,
        largest_norm: f32::INFINITY,
        weight_decay: 1e-6,
        gain: None,
    };
    let guesses = Phase {
        name: "guesses",
        start: Start::Patterns,
        keep: Keep::BestEpoch,
        samples: 1,
        steps: GUESSES * tasks,
        inner: InnerSamples::Pattern,
        outer: 25_000,
        rates: Groups::default(),
        weight_decay: 0.0,
        ..first.clone()
    };
    let pattern = Phase {
        name: "pattern",
        start: Start::Best,
        steps: 500 / share * tasks,
        rates: Groups {
            pattern: rate,
            ..Groups::default()
        },
        final_rate,
        ..guesses.clone()
    };
    if model != ModelKind::Linear {
        phases.push(first);
    }
    phases.push(guesses);
    let counts = std::iter::once(1).chain(doubled(1, samples));
    phases.extend(counts.map(|samples| Phase {
        samples,
        ..pattern.clone()
    }));
    Plan {
        phases,
        tasks,
        first_guess: random_start,
        step_size_form: StepSizeForm::Plain,
        first_step_size: 1e-3,
        known: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paper_s_stages() {
        let tasks = 80;
        let plan = Plan::new(Schedule::Paper, Effort::Long, ModelKind::Neural, 5, tasks);
        let [first, guesses, patterns @ ..] = &plan.phases[..] else {
            panic!("{plan:?}");
        };
        assert_eq!(
            (first.steps, first.inner),
            (800_000, InnerSamples::Fresh(512))
        );
        assert_eq!((guesses.steps, guesses.samples), (50 * tasks, 1));
        let samples: Vec<_> = patterns.iter().map(|phase| phase.samples).collect();
        assert_eq!(samples, [1, 2, 4, 5]);
        for phase in patterns {
            assert_eq!((phase.start, phase.keep), (Start::Best, Keep::BestEpoch));
            assert_eq!(phase.steps, 500 * tasks);
            assert!(phase.rates_at(0).pattern == 5e-4 && phase.rates.initial == 0.0);
            let last = phase.rates_at(phase.steps).pattern;
            assert!((last - 1e-4).abs() < 1e-9, "{last}");
        }
        assert_eq!(plan.at(0), Some((0, 0)));
        assert_eq!(plan.at(800_000), Some((1, 0)));
        assert_eq!(plan.at(plan.steps() - 1), Some((5, 500 * tasks - 1)));
        assert_eq!(plan.at(plan.steps()), None);
        assert_eq!(plan.clone().without_pattern(5).phases.len(), 1);

        // Both stages once more: the first one on the pattern, and no guesses.
        let [.., again, pattern] = &plan.clone().twice().phases[..] else {
            panic!("{plan:?}");
        };
        assert_eq!(
            (again.start, again.inner),
            (Start::Best, InnerSamples::Pattern)
        );
        assert_eq!((again.steps, again.samples), (800_000, 5));
        assert!(again.rates.initial > 0.0 && again.rates.pattern == 0.0);
        assert_eq!(
            (pattern.start, pattern.keep),
            (Start::Best, Keep::BestEpoch)
        );
        assert!(pattern.rates.initial == 0.0 && pattern.rates.pattern > 0.0);

        let known = Known {
            initial: vec![1.0],
            step_sizes: vec![0.5],
        };
        let alone = plan.pattern_only(known);
        assert_eq!(alone.phases.len(), 5);
        assert!(alone.phases.iter().all(|phase| phase.rates.initial == 0.0));

        // Nothing of Linear is learned but the pattern; a tenth of the steps.
        let plan = Plan::new(
            Schedule::Paper,
            Effort::Standard,
            ModelKind::Linear,
            1,
            tasks,
        );
        let steps: Vec<_> = plan.phases.iter().map(|phase| phase.steps).collect();
        assert_eq!(steps, [50 * tasks, 50 * tasks]);
    }
}
