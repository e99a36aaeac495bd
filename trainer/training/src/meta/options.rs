//! The options of a training run.

use std::f32::consts::FRAC_1_PI;
use std::fmt;
use std::ops::RangeInclusive;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::gonio::Limits;
use glimpse_core::model::ModelKind;
use glimpse_materials::setting::{Setting, SettingError, SettingNames};
use glimpse_materials::{Identity, Origin, SourceShare};
use serde::Serialize;

use super::identity::{RunIdentity, digest};
use super::outer::CheckpointOptions;
use super::plan::{Effort, PretrainedInit, Schedule, TrainedParts};
use super::scan_budget::{Motion, ScanBudget, ScanBudgetError};
use super::tasks::task::Noise;
use crate::linear::Prior;
use crate::route::MachineError;

/// The options of a training run.
#[derive(Clone, Debug)]
pub struct Options {
    /// The model.
    pub model: ModelKind,
    /// The number of samples, n, 1 to 4,096. With schedule prior also 0: a recipe without a pattern.
    pub samples: usize,
    /// The schedule.
    pub schedule: Schedule,
    /// The effort.
    pub effort: Effort,
    /// The trained parts.
    pub parts: TrainedParts,
    /// The initial parameters and step sizes for [`TrainedParts::PatternOnly`]; ignored by other parts.
    pub pretrained: Option<PretrainedInit>,
    /// The prior of Linear's coefficients with schedule paper; ignored by other models and schedules.
    pub prior: Prior,
    /// Options of schedule prior; ignored by other schedules.
    pub completion_options: CompletionOptions,
    /// Schedule prior: the directions of the first samples, at most n, which are not trained; angles in radians.
    pub fixed: Vec<Angles<f32>>,
    /// The sources of the materials, and the share of training tasks drawn from each. If empty, the sources are unknown
    /// and all materials have equal shares.
    pub source_shares: Vec<SourceShare>,
    /// The seed of all random numbers.
    pub seed: u64,
    /// The options of checkpoints; None disables them.
    pub checkpoints: Option<CheckpointOptions>,
}

impl Options {
    /// Creates options that train all parts for n = `samples`, 1 to 4,096. The prior of Linear is the paper's, the
    /// completion options are [`CompletionOptions::for_samples`], and checkpoints are disabled.
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
            parts: TrainedParts::All,
            pretrained: None,
            prior: Prior::PAPER,
            completion_options: CompletionOptions::for_samples(samples),
            fixed: Vec::new(),
            source_shares: Vec::new(),
            seed,
            checkpoints: None,
        }
    }
}

impl Options {
    /// Returns the options with directions that are not trained, as the first samples; angles in radians.
    ///
    /// # Errors
    /// If the schedule is not prior, there are more directions than samples, the time of a scan has a budget, or a
    /// direction is out of reach.
    pub fn with_fixed(self, fixed: Vec<Angles<f32>>) -> Result<Self, OptionsError> {
        let no_effect = |required, value| OptionsError::NoEffect {
            setting: Setting::Pattern,
            required,
            value,
        };
        if fixed.is_empty() {
            return Ok(self);
        }
        if self.schedule != Schedule::Prior {
            return Err(no_effect(Setting::Schedule, "prior"));
        }
        if self.completion_options.scan.is_some() {
            return Err(no_effect(Setting::ScanSeconds, "to be absent"));
        }
        if fixed.len() > self.samples {
            return Err(OptionsError::FixedCount {
                fixed: fixed.len(),
                samples: self.samples,
            });
        }
        for (angles, row) in fixed.iter().zip(1..) {
            let directions = HalfDifference::from_angles(*angles).directions();
            let check = self.completion_options.limits.check(&directions);
            check.map_err(|reason| OptionsError::FixedReach { row, reason })?;
        }
        Ok(Self { fixed, ..self })
    }
}

/// Simulated readings and additional materials in training with schedule prior.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CompletionOptions {
    /// The share of tasks with missing readings, 0 to 1; a recipe trained with 0 needs all readings.
    pub missing: f32,
    /// The relative standard deviation of multiplicative reading noise, 0 to 0.5.
    pub noise: f32,
    /// The standard deviation of additive reading noise, 0 to 0.5, as a share of the BRDF of a white diffuse surface,
    /// 1/π.
    pub additive: f32,
    /// The number of quantization levels of the sensor from darkness to a white surface facing the light; 0 disables
    /// quantization.
    pub levels: u32,
    /// The share of tasks that are procedural materials, 0 to 0.99.
    pub procedural: f32,
    /// The limits of the goniometer.
    pub limits: Limits,
    /// The budget for the time of a scan; None for any time.
    pub scan: Option<ScanBudget>,
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
            scan: None,
        }
    }
}

/// Invalid options of a training.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{}", self.message(Setting::name))]
pub enum OptionsError {
    /// A number is out of range.
    Range {
        /// The option.
        setting: Setting,
        /// The range.
        range: RangeInclusive<f32>,
        /// The value.
        value: f32,
    },
    /// An option has no effect.
    NoEffect {
        /// The option.
        setting: Setting,
        /// The option that it requires.
        required: Setting,
        /// The value that it requires.
        value: &'static str,
    },
    /// The machine is invalid.
    Machine(#[from] MachineError),
    /// The arms cannot reach the minimum separation within the limits of the polar angles. Holds the maximum possible
    /// separation in degrees.
    Separation(f32),
    /// The budget for the time of a scan is impossible.
    ScanBudget(#[from] ScanBudgetError),
    /// There are more fixed directions than samples.
    FixedCount {
        /// The number of fixed directions.
        fixed: usize,
        /// The number of samples.
        samples: usize,
    },
    /// The machine does not reach a fixed direction.
    FixedReach {
        /// Its row, from 1.
        row: usize,
        /// The limit that is exceeded.
        reason: glimpse_core::error::Error,
    },
}

impl SettingError for OptionsError {
    fn message(&self, name: SettingNames) -> String {
        match self {
            Self::Range {
                setting,
                range,
                value,
            } => format!(
                "{} must be {} to {}, not {value}",
                name(*setting),
                range.start(),
                range.end()
            ),
            Self::NoEffect {
                setting,
                required,
                value,
            } => format!(
                "{} has no effect: it requires {} {value}; remove it",
                name(*setting),
                name(*required)
            ),
            Self::Machine(error) | Self::ScanBudget(ScanBudgetError::Machine(error)) => {
                error.message(name)
            }
            Self::Separation(max) => {
                let [theta_i, theta_o, separation] = Setting::LIMITS.map(name);
                format!(
                    "{separation} must be at most twice the lesser of {theta_i} and {theta_o}, \
                     {max:.1} degrees here"
                )
            }
            Self::ScanBudget(error) => format!("{}: {error}", name(Setting::ScanSeconds)),
            Self::FixedCount { fixed, samples } => {
                let [pattern, count] = [Setting::Pattern, Setting::Samples].map(name);
                format!(
                    "{pattern} has {fixed} directions, and {count} is {samples}: give a larger number"
                )
            }
            Self::FixedReach { row, reason } => {
                format!("{}: row {row}: {reason}", name(Setting::Pattern))
            }
        }
    }
}

/// Checks the range of an option.
pub(super) fn check_range(
    setting: Setting,
    value: f32,
    range: RangeInclusive<f32>,
) -> Result<(), OptionsError> {
    match range.contains(&value) {
        true => Ok(()),
        false => Err(OptionsError::Range {
            setting,
            range,
            value,
        }),
    }
}

impl CompletionOptions {
    /// The number of added procedural materials, and the seed of their set.
    pub const PROCEDURAL_SET: (usize, u64) = (400, 5);
    /// The label of that set.
    const PROCEDURAL_LABEL: &str = "procedural:400:5";

    /// The maximum number of samples for which training uses complete readings by default.
    pub const MAX_COMPLETE_SAMPLES: usize = 32;

    /// Returns the defaults for n samples. Above [`CompletionOptions::MAX_COMPLETE_SAMPLES`], half of the tasks have
    /// missing readings: a network that is always trained with more than 32 readings overfits the training materials.
    #[must_use]
    pub fn for_samples(samples: usize) -> Self {
        Self {
            missing: if samples > Self::MAX_COMPLETE_SAMPLES {
                0.5
            } else {
                0.0
            },
            ..Self::default()
        }
    }

    /// Checks all ranges, and the consistency of the limits and of the time of a scan with n samples.
    ///
    /// # Errors
    /// Returns the first invalid option.
    pub fn validate(&self, samples: usize) -> Result<(), OptionsError> {
        check_range(Setting::Missing, self.missing, 0.0..=1.0)?;
        check_range(Setting::Noise, self.noise, 0.0..=0.5)?;
        check_range(Setting::Additive, self.additive, 0.0..=0.5)?;
        check_range(Setting::Procedural, self.procedural, 0.0..=0.99)?;
        self.limits.validate().map_err(MachineError::Limits)?;
        // Training moves a sample within the limits by moving both arms to equal polar angles.
        let max = 2.0 * self.limits.max_theta_i.min(self.limits.max_theta_o);
        if self.limits.min_separation > max {
            return Err(OptionsError::Separation(max.to_degrees()));
        }
        if let Some(scan) = &self.scan {
            check_range(Setting::ScanSeconds, scan.seconds as f32, 1e-3..=1e6)?;
            scan.validate(self.limits, samples)?;
        }
        Ok(())
    }

    /// Returns the noise in the form of recipes: additive noise in sr⁻¹.
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
            scan,
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
        if limits.in_plane {
            write!(f, ", in one plane")?;
        }
        if let Some(scan) = scan {
            write!(f, ", scans of {} s", scan.seconds)?;
        }
        Ok(())
    }
}

/// The options that affect the result. Options without effect are omitted.
#[derive(Serialize)]
struct DigestedOptions<'a> {
    model: ModelKind,
    samples: usize,
    schedule: Schedule,
    effort: Effort,
    parts: TrainedParts,
    pretrained: Option<&'a PretrainedInit>,
    prior: Option<Prior>,
    completion_options: Option<CompletionOptions>,
    source_shares: &'a [SourceShare],
    seed: u64,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    fixed: Vec<[f32; 3]>,
}

impl Options {
    /// Returns the digest of all options that affect the result. The checkpoint options are not among them.
    #[must_use]
    pub fn digest(&self) -> u64 {
        let fixed = self.fixed.iter();
        let fixed = fixed.map(|each| [each.theta_h, each.theta_d, each.phi_d]);
        digest(&DigestedOptions {
            model: self.model,
            samples: self.samples,
            schedule: self.schedule,
            effort: self.effort,
            parts: self.parts,
            pretrained: self
                .pretrained
                .as_ref()
                .filter(|_| self.parts == TrainedParts::PatternOnly),
            prior: Some(self.prior)
                .filter(|_| self.model == ModelKind::Linear && self.schedule == Schedule::Paper),
            completion_options: self.completion_options(),
            source_shares: &self.source_shares,
            seed: self.seed,
            fixed: fixed.collect(),
        })
    }

    /// Returns the identity of a run with these options and materials.
    #[must_use]
    pub fn identity(&self, materials: &[Identity]) -> RunIdentity {
        let list = materials.iter().map(|each| (&each.name[..], each.digest));
        RunIdentity {
            options: self.digest(),
            materials: digest(&list.collect::<Vec<_>>()),
        }
    }

    /// Returns the sources of the training tasks for the recipe: those of the materials, and the added procedural
    /// materials. Empty if the sources are unknown.
    #[must_use]
    pub fn sources(&self) -> Vec<SourceShare> {
        let procedural_share = self
            .completion_options()
            .map_or(0.0, |each| each.procedural);
        let own = self.source_shares.iter().map(|source_share| SourceShare {
            share: source_share.share * (1.0 - procedural_share),
            ..source_share.clone()
        });
        let procedural = SourceShare {
            label: CompletionOptions::PROCEDURAL_LABEL.to_owned(),
            origin: Origin::BuiltIn,
            materials: CompletionOptions::PROCEDURAL_SET.0,
            share: procedural_share,
        };
        let has_procedural = procedural_share > 0.0 && !self.source_shares.is_empty();
        own.chain(has_procedural.then_some(procedural)).collect()
    }

    /// Returns the motion of a scan, if its time has a budget.
    #[must_use]
    pub fn motion(&self) -> Option<Motion> {
        let CompletionOptions { limits, scan, .. } = self.completion_options()?;
        Some(Motion::new(scan?, limits, self.samples))
    }

    /// Returns the options of schedule prior, or None for other schedules.
    fn completion_options(&self) -> Option<CompletionOptions> {
        Some(self.completion_options).filter(|_| self.schedule == Schedule::Prior)
    }
}

#[cfg(test)]
mod tests;
