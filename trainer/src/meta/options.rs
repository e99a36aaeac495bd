//! What a training run is asked for.

use std::f32::consts::FRAC_1_PI;
use std::fmt;

use glimpse_core::gonio::{Limits, LimitsError};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Noise;

use super::outer::Checkpoints;
use super::plan::{Effort, Known, Schedule};
use crate::linear::Prior;
use crate::material::{Material, Portion};
use crate::setting::{NamesSettings, Naming, Setting, display_with_setting_names};

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
    pub completing: Completing,
    /// How often a completion is trained on which materials; all alike where it is empty.
    pub portions: Vec<Portion>,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Where the run is saved, if it is.
    pub checkpoints: Option<Checkpoints>,
}

impl Options {
    /// Trains all parts for n = `samples`, 1 to 4,096, with a learned prior of Linear and
    /// [`Completing::of`] so many samples; nothing is saved on the way.
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
            completing: Completing::of(samples),
            portions: Vec::new(),
            seed,
            checkpoints: None,
        }
    }
}

/// What readings and materials a completion is trained on, besides those given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Completing {
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

impl Default for Completing {
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
pub enum CompletingError {
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

impl NamesSettings for CompletingError {
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

display_with_setting_names!(CompletingError);
impl std::error::Error for CompletingError {}

impl Completing {
    /// Up to how many samples all of them are there in training, unless it is asked otherwise.
    pub const ALL_THERE: usize = 32;

    /// The defaults, and beyond [`Completing::ALL_THERE`] samples a share of tasks with missing readings: a map that
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
    pub fn validate(&self) -> Result<(), CompletingError> {
        for (field, value, most) in [
            (Setting::Missing, self.missing, 1.0),
            (Setting::Noise, self.noise, 0.5),
            (Setting::Additive, self.additive, 0.5),
            (Setting::Procedural, self.procedural, 0.99),
        ] {
            if !(0.0..=most).contains(&value) {
                return Err(CompletingError::Range { field, most, value });
            }
        }
        self.limits.validate().map_err(CompletingError::Limits)?;
        // A pattern is brought within limits by bringing both arms to equal polar angles.
        let most = 2.0 * self.limits.max_theta_i.min(self.limits.max_theta_o);
        match self.limits.min_separation > most {
            true => Err(CompletingError::Separation(most.to_degrees())),
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

impl fmt::Display for Completing {
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
    PatternOnly(Known),
}

impl Parts {
    /// In words, as part of a run's name.
    fn name(&self) -> String {
        match self {
            Self::All => "pattern=true".into(),
            Self::AllTwice => "pattern=twice".into(),
            Self::WithoutPattern => "pattern=false".into(),
            Self::PatternOnly(known) => {
                let values = known.initial.iter().chain(&known.step_sizes);
                let bytes: Vec<u8> = values.flat_map(|value| value.to_le_bytes()).collect();
                format!("pattern=only for {:08x}", crc(&bytes))
            }
        }
    }
}

impl Options {
    /// All that decides the outcome, in words: two runs with the same words give the same bytes.
    pub(super) fn run(&self, materials: &[Box<dyn Material>]) -> String {
        let names: Vec<&str> = materials.iter().map(|material| material.name()).collect();
        let prior = match self.model {
            ModelKind::Linear => format!(" {:?}", self.prior),
            _ => String::new(),
        };
        let completing = match self.schedule {
            Schedule::Prior => {
                let portions = self.portions.iter();
                let portions = portions.map(|each| format!(" {}x{}", each.materials, each.share));
                format!(" {}{}", self.completing, portions.collect::<String>())
            }
            _ => String::new(),
        };
        format!(
            "{}{prior}{completing} n={} {:?} {:?} {} seed={} {} materials {:08x}",
            self.model,
            self.samples,
            self.schedule,
            self.effort,
            self.parts.name(),
            self.seed,
            names.len(),
            crc(names.join("\n").as_bytes()),
        )
    }
}

fn crc(bytes: &[u8]) -> u32 {
    crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(bytes)
}
