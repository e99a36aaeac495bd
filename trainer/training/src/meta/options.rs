//! What a training run is asked for.

use std::f32::consts::FRAC_1_PI;
use std::fmt;

use glimpse_core::gonio::{Limits, LimitsError};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{self, Noise, Origin, TrainingSource};
use glimpse_materials::setting::{NamesSettings, Naming, Setting};
use glimpse_materials::{Identity, Portion, display_with_setting_names};
use serde::Serialize;

use super::identity::{RunIdentity, digest};
use super::outer::Checkpoints;
use super::plan::{Effort, PretrainedInit, Schedule};
use crate::linear::Prior;

/// What to train.
#[derive(Clone, Debug)]
pub struct Options {
    /// The model.
    pub model: ModelKind,
    /// n.
    pub samples: usize,
    /// How.
    pub schedule: Schedule,
    /// How long.
    pub effort: Effort,
    /// What of it.
    pub parts: Parts,
    /// The prior of Linear's coefficients; other models have none.
    pub prior: Prior,
    /// What readings and materials a completion is trained on.
    pub completion_options: CompletionOptions,
    /// The sources of the materials, and how often a completion is trained on each. Where it is empty, the
    /// sources are not known, and all materials count alike.
    pub portions: Vec<Portion>,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Where the run is saved, if it is.
    pub checkpoints: Option<Checkpoints>,
}

impl Options {
    /// Trains all parts for n = `samples`, 1 to 4,096, with a learned prior of Linear and
    /// [`CompletionOptions::of`] so many samples; nothing is saved on the way.
    #[must_use]
    pub fn new(
        model: ModelKind,
        samples: usize,
        schedule: Schedule,
        effort: Effort,
        seed: u64,
    ) -> Self {
        Self {
            model,
            samples,
            schedule,
            effort,
            parts: Parts::All,
            prior: Prior::LEARNED,
            completion_options: CompletionOptions::of(samples),
            portions: Vec::new(),
            seed,
            checkpoints: None,
        }
    }
}

/// What readings and materials a completion is trained on, besides those given.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CompletionOptions {
    /// The share of tasks with missing readings; 0 makes a recipe that needs them all.
    pub missing: f32,
    /// Standard deviation of readings' noise, relative.
    pub noise: f32,
    /// The same besides, as a share of the BRDF of a white surface, 1/pi.
    pub additive: f32,
    /// How many levels the sensor tells apart between darkness and a white surface that faces the light;
    /// 0 leaves that out of account.
    pub levels: u32,
    /// The share of tasks that are procedural materials.
    pub procedural: f32,
    /// The machine that the pattern is for.
    pub limits: Limits,
}

impl Default for CompletionOptions {
    fn default() -> Self {
        Self {
            missing: 0.0,
            noise: 0.0,
            additive: 0.0,
            levels: 0,
            procedural: 0.4,
            limits: Limits::NONE,
        }
    }
}

/// Why nothing can be trained so.
#[derive(Clone, Debug, PartialEq)]
pub enum CompletionOptionsError {
    /// A number is out of its range.
    Range {
        /// The setting.
        field: Setting,
        /// The largest that is taken.
        most: f32,
        /// What was given.
        value: f32,
    },
    /// There is no such machine.
    Limits(LimitsError),
    /// The arms cannot keep so far apart within their limits. The largest separation in degrees.
    Separation(f32),
}

impl NamesSettings for CompletionOptionsError {
    fn message(&self, name: Naming) -> String {
        let limits = [
            Setting::MaxThetaI,
            Setting::MaxThetaO,
            Setting::MinSeparation,
        ];
        let [theta_i, theta_o, separation] = limits.map(name);
        match self {
            Self::Range { field, most, value } => {
                format!("{} must be 0 to {most}, not {value}", name(*field))
            }
            Self::Limits(error) => {
                format!("{theta_i}, {theta_o} and {separation} do not go together: {error}")
            }
            Self::Separation(most) => format!(
                "{separation} must be at most twice the lesser of {theta_i} and {theta_o}, \
                 {most:.1} degrees here"
            ),
        }
    }
}

display_with_setting_names!(CompletionOptionsError);
impl std::error::Error for CompletionOptionsError {}

impl CompletionOptions {
    /// The number of procedural materials that are mixed in, and the seed of their set.
    pub const MIXED_IN: (usize, u64) = (400, 5);
    /// Their label.
    const MIXED_IN_LABEL: &str = "procedural:400:5";

    /// Up to how many samples all of them are there in training, unless it is asked otherwise.
    pub const ALL_THERE: usize = 32;

    /// The defaults, and beyond [`CompletionOptions::ALL_THERE`] samples a share of tasks with missing readings: a map that
    /// always sees so many of them learns the training's materials by heart.
    #[must_use]
    pub fn of(samples: usize) -> Self {
        Self {
            missing: if samples > Self::ALL_THERE { 0.5 } else { 0.0 },
            ..Self::default()
        }
    }

    /// Makes sure that it can be trained.
    ///
    /// # Errors
    /// What is out of its range, or does not go together.
    pub fn validate(&self) -> Result<(), CompletionOptionsError> {
        for (field, value, most) in [
            (Setting::Missing, self.missing, 1.0),
            (Setting::Noise, self.noise, 0.5),
            (Setting::Additive, self.additive, 0.5),
            (Setting::Procedural, self.procedural, 0.99),
        ] {
            if !(0.0..=most).contains(&value) {
                return Err(CompletionOptionsError::Range { field, most, value });
            }
        }
        self.limits
            .validate()
            .map_err(CompletionOptionsError::Limits)?;
        // A pattern is brought within limits by bringing both arms to equal polar angles.
        let most = 2.0 * self.limits.max_theta_i.min(self.limits.max_theta_o);
        match self.limits.min_separation > most {
            true => Err(CompletionOptionsError::Separation(most.to_degrees())),
            false => Ok(()),
        }
    }

    /// The noise as recipes state it.
    #[must_use]
    pub fn noise(&self) -> Noise {
        Noise {
            multiplicative: self.noise,
            additive: self.additive * FRAC_1_PI,
            levels: self.levels,
        }
    }
}

impl fmt::Display for CompletionOptions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            missing,
            noise,
            additive,
            levels,
            procedural,
            limits,
        } = self;
        write!(f, "missing readings {missing}, noise {noise}")?;
        if *additive > 0.0 {
            write!(f, " and {additive} of white")?;
        }
        if *levels > 0 {
            write!(f, ", {levels} levels")?;
        }
        write!(f, ", procedural {procedural}")?;
        if *limits != Limits::NONE {
            write!(
                f,
                ", theta_i to {:.1}, theta_o to {:.1}, {:.1} degrees apart",
                limits.max_theta_i.to_degrees(),
                limits.max_theta_o.to_degrees(),
                limits.min_separation.to_degrees()
            )?;
        }
        Ok(())
    }
}

/// What of a recipe is trained.
#[derive(Clone, Debug, PartialEq)]
pub enum Parts {
    /// Start, step sizes and pattern.
    All,
    /// All, and then start and step sizes once more, and the pattern once more.
    AllTwice,
    /// Start and step sizes, as the method Meta does.
    WithoutPattern,
    /// The pattern, for a start and step sizes that are known. (Linear: as [`Parts::All`].)
    PatternOnly(PretrainedInit),
}

impl Parts {
    /// The parts as recipes state them.
    #[must_use]
    pub fn stated(&self) -> recipe::Parts {
        match self {
            Self::All => recipe::Parts::All,
            Self::AllTwice => recipe::Parts::AllTwice,
            Self::WithoutPattern => recipe::Parts::WithoutPattern,
            Self::PatternOnly(_) => recipe::Parts::PatternOnly,
        }
    }
}

/// All options that decide the outcome; those that have no effect are left out.
#[derive(Serialize)]
struct Decisive<'a> {
    model: ModelKind,
    samples: usize,
    schedule: recipe::Schedule,
    effort: recipe::Effort,
    parts: recipe::Parts,
    known: Option<&'a PretrainedInit>,
    prior: Option<Prior>,
    completion_options: Option<CompletionOptions>,
    portions: &'a [Portion],
    seed: u64,
}

impl Options {
    /// Returns the digest of all options that decide the outcome. Where they are saved does not.
    #[must_use]
    pub fn digest(&self) -> u64 {
        digest(&Decisive {
            model: self.model,
            samples: self.samples,
            schedule: self.schedule.into(),
            effort: self.effort.into(),
            parts: self.parts.stated(),
            known: match &self.parts {
                Parts::PatternOnly(known) => Some(known),
                Parts::All | Parts::AllTwice | Parts::WithoutPattern => None,
            },
            prior: Some(self.prior).filter(|_| self.model == ModelKind::Linear),
            completion_options: self.completion_options(),
            portions: &self.portions,
            seed: self.seed,
        })
    }

    /// Returns the identity of the run that trains on these materials.
    #[must_use]
    pub fn identity(&self, materials: &[Identity]) -> RunIdentity {
        let list = materials.iter().map(|each| (&each.name[..], each.digest));
        RunIdentity {
            model: self.model,
            samples: self.samples as u32,
            schedule: self.schedule.into(),
            effort: self.effort.into(),
            parts: self.parts.stated(),
            seed: self.seed,
            materials: materials.len() as u32,
            options_digest: self.digest(),
            materials_digest: digest(&list.collect::<Vec<_>>()),
        }
    }

    /// Returns the sources of the training tasks as recipes state them: those of the materials, and the
    /// procedural materials that are mixed in. Empty where the sources are not known.
    #[must_use]
    pub fn sources(&self) -> Vec<TrainingSource<'_>> {
        let mixed_in = self
            .completion_options()
            .map_or(0.0, |each| each.procedural);
        let own = self.portions.iter().map(|portion| TrainingSource {
            label: &portion.label,
            origin: portion.origin,
            materials: portion.materials as u32,
            share: portion.share * (1.0 - mixed_in),
        });
        let procedural = TrainingSource {
            label: CompletionOptions::MIXED_IN_LABEL,
            origin: Origin::BuiltIn,
            materials: CompletionOptions::MIXED_IN.0 as u32,
            share: mixed_in,
        };
        let is_mixed_in = mixed_in > 0.0 && !self.portions.is_empty();
        own.chain(is_mixed_in.then_some(procedural)).collect()
    }

    /// What a completion is trained on; None by schedules that train none.
    fn completion_options(&self) -> Option<CompletionOptions> {
        Some(self.completion_options).filter(|_| self.schedule == Schedule::Prior)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;
    use std::time::Duration;

    use super::*;
    use glimpse_materials::Source;

    fn known(first: f32) -> Parts {
        Parts::PatternOnly(PretrainedInit {
            initial: vec![first; 7],
            step_sizes: vec![0.5; 7],
        })
    }

    fn options(model: ModelKind, schedule: Schedule) -> Options {
        let source = |text: &str, share| Portion {
            share,
            ..Portion::whole(&Source(text.into()), 12)
        };
        Options {
            portions: vec![source("MERL", 0.25), source("procedural:12", 0.75)],
            ..Options::new(model, 8, schedule, Effort::Quick, 0)
        }
    }

    type Change = fn(&mut Options);

    #[test]
    fn each_option_that_decides_the_outcome_changes_the_digest() {
        let changes: &[Change] = &[
            |_| {},
            |o| o.model = ModelKind::Neural,
            |o| o.samples = 9,
            |o| o.schedule = Schedule::Paper,
            |o| o.schedule = Schedule::Joint,
            |o| o.effort = Effort::Long,
            |o| o.parts = Parts::AllTwice,
            |o| o.parts = Parts::WithoutPattern,
            |o| o.parts = known(0.5),
            |o| o.parts = known(0.25),
            |o| o.prior.components = 5,
            |o| o.prior.eta = Some(40.0),
            |o| o.completion_options.missing = 0.5,
            |o| o.completion_options.noise = 0.02,
            |o| o.completion_options.additive = 0.02,
            |o| o.completion_options.levels = 20,
            |o| o.completion_options.procedural = 0.5,
            |o| o.completion_options.limits.max_theta_i = 1.25,
            |o| o.completion_options.limits.max_theta_o = 1.25,
            |o| o.completion_options.limits.min_separation = 0.25,
            |o| o.completion_options.limits.in_plane = true,
            |o| o.portions.clear(),
            |o| o.portions.reverse(),
            |o| o.portions[0].label = "RGL".into(),
            |o| o.portions[0].origin = Origin::BuiltIn,
            |o| o.portions[0].materials = 13,
            |o| o.portions[0].share = 0.5,
            |o| o.seed = 1,
        ];
        let digests: HashSet<u64> = changes
            .iter()
            .map(|change| {
                let mut options = options(ModelKind::Linear, Schedule::Prior);
                change(&mut options);
                options.digest()
            })
            .collect();
        assert_eq!(digests.len(), changes.len());
    }

    #[test]
    fn an_option_without_effect_does_not_change_the_digest() {
        let changes: [(ModelKind, Schedule, Change); 4] = [
            (ModelKind::Linear, Schedule::Prior, |_| {}),
            (ModelKind::Phong, Schedule::Prior, |o| {
                o.prior = Prior::PAPER;
            }),
            (ModelKind::Linear, Schedule::Joint, |o| {
                o.completion_options.noise = 0.02;
            }),
            (ModelKind::Phong, Schedule::Prior, |o| {
                o.checkpoints = Some(Checkpoints {
                    directory: "elsewhere".into(),
                    every: Duration::ZERO,
                    resume: true,
                });
            }),
        ];
        for (model, schedule, change) in changes {
            let mut changed = options(model, schedule);
            change(&mut changed);
            assert_eq!(changed.digest(), options(model, schedule).digest());
        }
    }

    #[test]
    fn an_identity_is_of_the_options_and_of_the_materials() {
        let material = |name: &str, digest| Identity {
            name: name.into(),
            digest,
        };
        let options = options(ModelKind::Phong, Schedule::Prior);
        let identity = options.identity(&[material("brass", 1), material("felt", 2)]);
        assert_eq!(identity.options_digest, options.digest());
        assert_eq!(identity.materials, 2);
        for other in [
            [material("brass", 1), material("felt", 3)],
            [material("brass", 1), material("silk", 2)],
            [material("felt", 2), material("brass", 1)],
        ] {
            let other = options.identity(&other);
            assert_ne!(identity.materials_digest, other.materials_digest);
            assert_eq!(identity.options_digest, other.options_digest);
        }
    }

    #[test]
    fn shares_of_training_tasks_are_1_together() {
        for (schedule, shares) in [
            (Schedule::Joint, &[0.25, 0.75][..]),
            (Schedule::Prior, &[0.15, 0.45, 0.4]),
        ] {
            let options = options(ModelKind::Phong, schedule);
            let sources = options.sources();
            assert_eq!(sources.len(), shares.len());
            for (source, share) in sources.iter().zip(shares) {
                assert!((source.share - share).abs() < 1e-6, "{source:?}");
            }
            assert_eq!(sources[0].origin, Origin::Files);
            let others = &sources[1..];
            assert!(others.iter().all(|each| each.origin == Origin::BuiltIn));
        }
        let (count, seed) = CompletionOptions::MIXED_IN;
        let label = format!("procedural:{count}:{seed}");
        assert_eq!(CompletionOptions::MIXED_IN_LABEL, label);
        let unknown = Options {
            portions: Vec::new(),
            ..options(ModelKind::Phong, Schedule::Prior)
        };
        assert!(unknown.sources().is_empty());
    }
}
