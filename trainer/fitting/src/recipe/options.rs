//! The options of a training.

use std::f32::consts::FRAC_1_PI;
use std::ops::RangeInclusive;

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::gonio::Limits;
use glimpse_core::model::ModelKind;
use glimpse_core::section::MAX_SAMPLES;
use glimpse_materials::setting::Name;
use glimpse_materials::{Identity, MODELS, Origin, SourceShare};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::identity::{RunIdentity, digest};
use super::noise::ReadingNoise;
use crate::choice::Choice;
use crate::route::{LimitArgs, MachineError, SpeedArgs, TimedMachine};

/// The options of a training: all that determines a recipe, except for the materials.
///
/// The command line, Python's parameters, and the metadata of recipes are derived from this type.
#[derive(Args, Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrainingOptions {
    /// Model to fit
    #[arg(long, value_parser = model_parser())]
    pub model: ModelKind,
    /// Number n of samples that the scanner measures, 1 to 4096; `any` for readings at any directions
    // 0 stands for `any`: a recipe without a pattern.
    #[arg(
        long,
        short = 'n',
        value_name = "N",
        allow_negative_numbers = true,
        value_parser = sample_count
    )]
    pub samples: usize,
    /// Training schedule
    #[arg(long, value_enum, default_value_t = Schedule::Prior)]
    pub schedule: Schedule,
    /// Length of the training
    #[arg(long, value_enum, default_value_t = Effort::Standard)]
    pub effort: Effort,
    /// The seed of all random numbers.
    #[arg(skip)]
    pub seed: u64,
    /// Schedule paper: the trained parts.
    #[arg(skip)]
    pub parts: TrainedParts,
    /// Schedule prior: the directions of the first samples, at most n, which are not trained; angles in radians.
    #[arg(skip)]
    pub pattern: Vec<Angles<f32>>,
    /// The sources of the materials, and the share of training tasks drawn from each. If empty, the sources are unknown
    /// and all materials have equal shares.
    #[arg(skip)]
    pub source_shares: Vec<SourceShare>,
    /// Schedule prior: relative weight of each --data in training, above 0, for example 3,1
    /// [default: all materials have the same weight]
    #[arg(long, value_name = "SHARE", value_delimiter = ',')]
    pub share: Vec<f32>,
    /// Schedule prior: share of training tasks with missing readings, 0 to 1. If it is above 0, for
    /// example 0.5, the recipe tolerates missing readings. Without --scan-seconds, the first samples of
    /// its pattern are then the most informative, for scans that end early [default: 0; 0.5 for more than 32 samples, where
    /// it lowers the loss]
    #[arg(long, value_name = "SHARE")]
    pub missing: Option<f32>,
    /// Schedule prior: standard deviation of the readings' noise, relative to each value, 0 to 0.5:
    /// 0.02 is 2 %
    #[arg(long, value_name = "S", default_value_t = 0.0)]
    pub noise: f32,
    /// Schedule prior: standard deviation of noise that does not depend on the value, relative to the
    /// BRDF 1/pi of a white surface, 0 to 0.5: 0.01 is 1 %
    #[arg(long, value_name = "S", default_value_t = 0.0)]
    pub additive: f32,
    /// Schedule prior: number of quantization levels of the sensor between darkness and a white
    /// surface that faces the light; 0 for no quantization
    #[arg(long, value_name = "COUNT", default_value_t = 0)]
    pub levels: u32,
    /// Schedule prior: share of procedural materials in training, 0 to 0.99
    #[arg(long, value_name = "SHARE", default_value_t = Self::PROCEDURAL_SHARE)]
    pub procedural: f32,
    /// Schedule prior: limits of the machine.
    #[command(flatten)]
    pub limits: LimitArgs,
    /// Schedule prior: longest time of a scan in seconds, 0.001 to 1,000,000, by the rules of `trainer plan`: motion, and
    /// settling at each sample. The pattern and its order are trained to keep within it [default: any
    /// time]
    #[arg(long, value_name = "SECONDS")]
    pub scan_seconds: Option<f64>,
    /// With a time of a scan: the speeds of the axes.
    #[command(flatten)]
    pub speeds: SpeedArgs,
    /// Model linear, schedule paper: number of principal components, 1 to 1024; fewer if the materials are few
    #[arg(long, value_name = "COUNT", default_value_t = Self::PAPER_BASES)]
    pub bases: usize,
    /// Model linear, schedule paper: precision of the prior of every coefficient, 1e-6 to 1e9
    #[arg(long, default_value_t = Self::PAPER_ETA)]
    pub eta: f32,
}

/// The training schedule.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Schedule {
    /// The two stages of the paper: initial parameters and step sizes on random samples, then the pattern alone.
    Paper,
    /// A learned prior: a small network maps readings to coefficients, and is trained jointly with the pattern. Except
    /// for Linear, a second network maps the coefficients to initial parameters, which Gauss-Newton steps refine.
    Prior,
}

/// The training effort.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Effort {
    /// A few seconds, for a first look; 1/500 of the paper's steps with schedule paper.
    Brief,
    /// 10 to 120 seconds on two cores, for experiments; 1/100 of the paper's steps with schedule paper.
    Quick,
    /// 1 to 5 minutes on two cores, for regular use; 1/10 of the paper's steps with schedule paper.
    Standard,
    /// 15 minutes to hours, for a loss a few percent lower; all of the paper's steps with schedule paper.
    Long,
}

impl Effort {
    /// Returns the divisor of the paper's number of steps at this effort of schedule paper.
    #[must_use]
    pub fn paper_step_divisor(self) -> usize {
        match self {
            Self::Brief => 500,
            Self::Quick => 100,
            Self::Standard => 10,
            Self::Long => 1,
        }
    }
}

/// The parts of a recipe that are trained. Schedule prior trains all.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TrainedParts {
    /// Initial parameters, step sizes and pattern.
    #[default]
    All,
    /// All parts, then initial parameters and step sizes again, then the pattern again.
    AllTwice,
    /// The pattern only, for pretrained initial parameters and step sizes. Linear has neither.
    PatternOnly(Option<PretrainedInit>),
}

/// Pretrained initial parameters and step sizes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PretrainedInit {
    /// The initial parameters, theta_0.
    pub initial: Vec<f32>,
    /// The step sizes, alpha.
    pub step_sizes: Vec<f32>,
}

/// Invalid options of a training.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OptionsError {
    /// The number of samples, n, is out of range.
    #[error(
        "{name} is {0}; choose 1 to {MAX_SAMPLES}, or any with {schedule} prior",
        name = Name("samples"),
        schedule = Name("schedule")
    )]
    Samples(usize),
    /// A number is out of range.
    #[error("{} must be {} to {}, not {value}", Name(.name), .range.start(), .range.end())]
    Range {
        /// The option.
        name: &'static str,
        /// The range.
        range: RangeInclusive<f32>,
        /// The value.
        value: f32,
    },
    /// An option has no effect beside the other ones.
    #[error(
        "{} has no effect with {} {model}, {} {}, {} {} and {} {}: remove it",
        Name(.name), Name("model"), Name("schedule"), .options.schedule.name(), Name("samples"),
        if .options.samples == 0 { "any".to_owned() } else { .options.samples.to_string() },
        if .options.scan_seconds.is_some() { "a number of" } else { "no" }, Name("scan_seconds"),
        model = .options.model
    )]
    NoEffect {
        /// The option.
        name: String,
        /// All options.
        options: Box<TrainingOptions>,
    },
    /// The machine is invalid.
    #[error(transparent)]
    Machine(#[from] MachineError),
    /// The arms cannot reach the minimum separation within the limits of the polar angles. Holds the maximum possible
    /// separation in degrees.
    #[error(
        "{separation} must be at most twice the lesser of {theta_i} and {theta_o}, {0:.1} degrees here",
        separation = Name::MIN_SEPARATION,
        theta_i = Name::MAX_THETA_I,
        theta_o = Name::MAX_THETA_O
    )]
    Separation(f32),
    /// There are more fixed directions than samples.
    #[error(
        "{} has {fixed} directions, and {} is {samples}: give a larger number",
        Name("pattern"),
        Name("samples")
    )]
    FixedCount {
        /// The number of fixed directions.
        fixed: usize,
        /// The number of samples.
        samples: usize,
    },
    /// The machine does not reach a fixed direction.
    #[error("{}: row {row}: {reason}", Name("pattern"))]
    FixedReach {
        /// Its row, from 1.
        row: usize,
        /// The limit that is exceeded.
        reason: glimpse_core::error::Error,
    },
}

/// Returns a parser of the names of models.
#[must_use]
pub fn model_parser() -> impl TypedValueParser<Value = ModelKind> {
    PossibleValuesParser::new(MODELS.map(ModelKind::name))
        .try_map(|name| serde_json::from_value::<ModelKind>(name.into()))
}

/// Parses the number of samples; 0 for `any`.
fn sample_count(text: &str) -> Result<usize, String> {
    if text == "any" {
        return Ok(0);
    }
    let count = text.parse().ok();
    count
        .filter(|count| (1..=MAX_SAMPLES).contains(count))
        .ok_or_else(|| format!("give an integer from 1 to {MAX_SAMPLES}, or any"))
}

fn check_range(
    name: &'static str,
    value: f32,
    range: RangeInclusive<f32>,
) -> Result<(), OptionsError> {
    if range.contains(&value) {
        Ok(())
    } else {
        Err(OptionsError::Range { name, range, value })
    }
}

impl TrainingOptions {
    /// The fields that hold several options, each with a name of its own.
    const GROUPS: [&'static str; 2] = ["limits", "speeds"];
    /// The number of principal components in the paper, after Nielsen et al.
    pub const PAPER_BASES: usize = 5;
    /// The precision of all coefficients in the paper, after Nielsen et al.
    pub const PAPER_ETA: f32 = 40.0;
    /// The default share of procedural materials.
    const PROCEDURAL_SHARE: f32 = 0.4;
    /// The number of added procedural materials, and the seed of their set.
    pub const PROCEDURAL_SET: (usize, u64) = (400, 5);
    /// The maximum number of samples for which training uses complete readings by default.
    pub const MAX_COMPLETE_SAMPLES: usize = 32;

    /// Creates options with defaults for n = `samples`, 1 to 4,096; 0 for a recipe without a pattern.
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
            seed,
            parts: TrainedParts::All,
            pattern: Vec::new(),
            source_shares: Vec::new(),
            share: Vec::new(),
            missing: None,
            noise: 0.0,
            additive: 0.0,
            levels: 0,
            procedural: Self::PROCEDURAL_SHARE,
            limits: LimitArgs::default(),
            scan_seconds: None,
            speeds: SpeedArgs::default(),
            bases: Self::PAPER_BASES,
            eta: Self::PAPER_ETA,
        }
    }

    /// Returns default options with the same model, n, schedule, effort and seed.
    #[must_use]
    pub fn defaults(&self) -> Self {
        let (model, samples) = (self.model, self.samples);
        Self::new(model, samples, self.schedule, self.effort, self.seed)
    }

    /// Returns the options with the default of each that has no effect beside the others.
    #[must_use]
    pub fn normalized(&self) -> Self {
        let plain = self.defaults();
        let mut options = match self.schedule {
            Schedule::Prior => Self {
                parts: plain.parts.clone(),
                ..self.clone()
            },
            Schedule::Paper => Self {
                parts: self.parts.clone(),
                source_shares: self.source_shares.clone(),
                bases: self.bases,
                eta: self.eta,
                ..plain.clone()
            },
        };
        if self.schedule == Schedule::Prior || self.model != ModelKind::Linear {
            options.bases = plain.bases;
            options.eta = plain.eta;
        }
        if self.samples == 0 {
            // Without a pattern, only the materials matter.
            options = Self {
                source_shares: options.source_shares,
                share: options.share,
                procedural: options.procedural,
                ..plain
            };
        }
        match options.scan_seconds {
            None => options.speeds = SpeedArgs::default(),
            // Fixed directions have their own time.
            Some(_) => options.pattern.clear(),
        }
        options
    }

    /// Checks all ranges, and that each option has an effect.
    ///
    /// # Errors
    /// The first invalid option.
    pub fn validate(&self) -> Result<(), OptionsError> {
        let is_any = self.samples == 0 && self.schedule == Schedule::Prior;
        if !is_any && !(1..=MAX_SAMPLES).contains(&self.samples) {
            return Err(OptionsError::Samples(self.samples));
        }
        if let Some((name, _)) = self.differences(&self.normalized()).into_iter().next() {
            let options = Box::new(self.clone());
            return Err(OptionsError::NoEffect { name, options });
        }
        check_range("missing", self.missing(), 0.0..=1.0)?;
        check_range("noise", self.noise, 0.0..=0.5)?;
        check_range("additive", self.additive, 0.0..=0.5)?;
        check_range("procedural", self.procedural, 0.0..=0.99)?;
        check_range("bases", self.bases as f32, 1.0..=1024.0)?;
        check_range("eta", self.eta, 1e-6..=1e9)?;
        let limits = self.limits.or(Limits::NONE)?;
        // Training moves a sample within the limits by moving both arms to equal polar angles.
        let max = 2.0 * limits.max_theta_i.min(limits.max_theta_o);
        if limits.min_separation > max {
            return Err(OptionsError::Separation(max.to_degrees()));
        }
        if let Some(seconds) = self.scan_seconds {
            check_range("scan_seconds", seconds as f32, 1e-3..=1e6)?;
        }
        self.machine().validate()?;
        if self.pattern.len() > self.samples {
            return Err(OptionsError::FixedCount {
                fixed: self.pattern.len(),
                samples: self.samples,
            });
        }
        for (angles, row) in self.pattern.iter().zip(1..) {
            let directions = HalfDifference::from_angles(*angles).directions();
            limits
                .check(&directions)
                .map_err(|reason| OptionsError::FixedReach { row, reason })?;
        }
        Ok(())
    }

    /// Returns the names and values of the options that differ from other ones.
    #[must_use]
    pub fn differences(&self, other: &Self) -> Vec<(String, Value)> {
        let other = other.to_map();
        let differs = |(name, value): &(String, Value)| other.get(name) != Some(value);
        self.to_map().into_iter().filter(differs).collect()
    }

    /// Returns all options by their names in Python.
    fn to_map(&self) -> Map<String, Value> {
        // A number of a `Value` from an f32 would have all digits of an f64; one from text is short.
        let text = serde_json::to_string(self).expect("numbers, text and lists have a JSON form");
        let mut map: Map<String, Value> = serde_json::from_str(&text).expect("an object");
        for group in Self::GROUPS {
            if let Some(Value::Object(options)) = map.remove(group) {
                map.extend(options);
            }
        }
        map
    }

    /// Returns the share of training tasks with missing readings. Above [`Self::MAX_COMPLETE_SAMPLES`], it is half by
    /// default: a network that is always trained with more than 32 readings overfits the training materials.
    #[must_use]
    pub fn missing(&self) -> f32 {
        let default = if self.samples > Self::MAX_COMPLETE_SAMPLES {
            0.5
        } else {
            0.0
        };
        self.missing.unwrap_or(default)
    }

    /// Returns the noise in the form of recipes: additive noise in sr⁻¹.
    #[must_use]
    pub fn noise(&self) -> ReadingNoise {
        ReadingNoise {
            multiplicative: self.noise,
            additive: self.additive * FRAC_1_PI,
            levels: self.levels,
        }
    }

    /// Returns the limits of the machine, in radians. Invalid ones, which [`Self::validate`] refuses, are ignored.
    #[must_use]
    pub fn limits(&self) -> Limits {
        self.limits.or(Limits::NONE).unwrap_or(Limits::NONE)
    }

    /// Returns the machine that the pattern is trained for.
    #[must_use]
    pub fn machine(&self) -> TimedMachine {
        self.speeds.machine(self.limits(), &TimedMachine::default())
    }

    /// Returns the identity of a run with these options and materials.
    #[must_use]
    pub fn identity(&self, materials: &[Identity]) -> RunIdentity {
        let effective = Self {
            missing: Some(self.missing()),
            // The shares of sources hold them.
            share: Vec::new(),
            ..self.normalized()
        };
        RunIdentity {
            options: digest(&effective),
            materials: digest(materials),
        }
    }

    /// Returns the sources of the training tasks: those of the materials, and the added procedural materials. Empty if
    /// the sources are unknown.
    #[must_use]
    pub fn sources(&self) -> Vec<SourceShare> {
        let procedural_share = match self.schedule {
            Schedule::Prior => self.procedural,
            Schedule::Paper => 0.0,
        };
        let own = self.source_shares.iter().map(|source_share| SourceShare {
            share: source_share.share * (1.0 - procedural_share),
            ..source_share.clone()
        });
        let (materials, seed) = Self::PROCEDURAL_SET;
        let procedural = SourceShare {
            label: format!("procedural:{materials}:{seed}"),
            origin: Origin::BuiltIn,
            materials,
            share: procedural_share,
        };
        let has_procedural = procedural_share > 0.0 && !self.source_shares.is_empty();
        own.chain(has_procedural.then_some(procedural)).collect()
    }
}
