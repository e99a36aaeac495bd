//! A request for a training, with the options of `trainer train` that only some models or schedules have.

use clap::Args;
use clap::builder::RangedI64ValueParser;
use glimpse_core::gonio::Limits;
use glimpse_core::model::ModelKind;
use glimpse_materials::setting::Setting;

use super::options::{CompletionOptions, Options, OptionsError, check_range};
use super::plan::{Effort, Schedule};
use super::scan_budget::ScanBudget;
use crate::linear::Prior;
use crate::route::{LimitArgs, Machine, SpeedArgs};

/// Options of a training that only some models or schedules have. Options that are not given have defaults.
#[derive(Args, Clone, Debug, Default)]
pub struct TrainingArgs {
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
    /// 0.02 is 2 % [default: 0]
    #[arg(long, value_name = "S")]
    pub noise: Option<f32>,
    /// Schedule prior: standard deviation of noise that does not depend on the value, relative to the
    /// BRDF 1/pi of a white surface, 0 to 0.5: 0.01 is 1 % [default: 0]
    #[arg(long, value_name = "S")]
    pub additive: Option<f32>,
    /// Schedule prior: number of quantization levels of the sensor between darkness and a white
    /// surface that faces the light; 0 for no quantization [default: 0]
    #[arg(long, value_name = "COUNT")]
    pub levels: Option<u32>,
    /// Schedule prior: share of procedural materials in training, 0 to 0.99 [default: 0.4]
    #[arg(long, value_name = "SHARE")]
    pub procedural: Option<f32>,
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
    /// Model linear, schedule paper: number of principal components, 1 to 1024 [default: 5]
    #[arg(long, value_name = "COUNT", value_parser = RangedI64ValueParser::<usize>::new().range(1..=1024))]
    pub bases: Option<usize>,
    /// Model linear, schedule paper: precision of the prior of every coefficient, 1e-6 to 1e9 [default: 40]
    #[arg(long)]
    pub eta: Option<f32>,
}

impl TrainingArgs {
    /// Checks that each given option has an effect for one of the models (all if the list is empty) with a schedule.
    ///
    /// # Errors
    /// [`OptionsError::NoEffect`] for the first option without effect.
    pub fn check_effect(
        &self,
        models: &[ModelKind],
        schedule: Schedule,
    ) -> Result<(), OptionsError> {
        let is_prior = schedule == Schedule::Prior;
        let has_linear = models.is_empty() || models.contains(&ModelKind::Linear);
        let prior = (is_prior, Setting::Schedule, "prior");
        let paper = (!is_prior, Setting::Schedule, "paper");
        let linear = (has_linear, Setting::Model, "linear");
        let scan = (
            self.scan_seconds.is_some(),
            Setting::ScanSeconds,
            "a number",
        );
        let limits = &self.limits;
        for (setting, is_given, (has_effect, required, value)) in [
            (Setting::Share, !self.share.is_empty(), prior),
            (Setting::Missing, self.missing.is_some(), prior),
            (Setting::Noise, self.noise.is_some(), prior),
            (Setting::Additive, self.additive.is_some(), prior),
            (Setting::Levels, self.levels.is_some(), prior),
            (Setting::Procedural, self.procedural.is_some(), prior),
            (Setting::MaxThetaI, limits.max_theta_i.is_some(), prior),
            (Setting::MaxThetaO, limits.max_theta_o.is_some(), prior),
            (
                Setting::MinSeparation,
                limits.min_separation.is_some(),
                prior,
            ),
            (Setting::InPlane, limits.in_plane, prior),
            (Setting::ScanSeconds, self.scan_seconds.is_some(), prior),
            (Setting::Speed, self.speeds.speed.is_some(), scan),
            (Setting::Settle, self.speeds.settle.is_some(), scan),
            (Setting::Bases, self.bases.is_some(), linear),
            (Setting::Bases, self.bases.is_some(), paper),
            (Setting::Eta, self.eta.is_some(), linear),
            (Setting::Eta, self.eta.is_some(), paper),
        ] {
            if is_given && !has_effect {
                return Err(OptionsError::NoEffect {
                    setting,
                    required,
                    value,
                });
            }
        }
        Ok(())
    }

    /// Returns the options of a training, with defaults for this number of samples.
    ///
    /// # Errors
    /// If a value is out of range, or options are inconsistent.
    pub fn options(
        &self,
        model: ModelKind,
        samples: usize,
        schedule: Schedule,
        effort: Effort,
        seed: u64,
    ) -> Result<Options, OptionsError> {
        let default = CompletionOptions::for_samples(samples);
        let machine = Machine::default();
        let prior = Prior {
            components: self.bases.unwrap_or(Prior::PAPER.components),
            eta: self.eta.unwrap_or(Prior::PAPER.eta),
        };
        check_range(Setting::Bases, prior.components as f32, 1.0..=1024.0)?;
        check_range(Setting::Eta, prior.eta, 1e-6..=1e9)?;
        let completion_options = CompletionOptions {
            missing: self.missing.unwrap_or(default.missing),
            noise: self.noise.unwrap_or(default.noise),
            additive: self.additive.unwrap_or(default.additive),
            levels: self.levels.unwrap_or(default.levels),
            procedural: self.procedural.unwrap_or(default.procedural),
            limits: self.limits.or(Limits::NONE)?,
            scan: self.scan_seconds.map(|seconds| ScanBudget {
                seconds,
                speeds: self.speeds.speed.unwrap_or(machine.speeds),
                settle: self.speeds.settle.unwrap_or(machine.settle),
            }),
        };
        completion_options.validate(samples)?;
        // Without a pattern, only the materials matter.
        let (has_limits, plain) = (
            completion_options.limits != Limits::NONE,
            CompletionOptions::default(),
        );
        for (setting, is_given) in [
            (Setting::MaxThetaI, has_limits),
            (
                Setting::Missing,
                completion_options.missing != plain.missing,
            ),
            (Setting::Noise, completion_options.noise() != plain.noise()),
            (Setting::ScanSeconds, completion_options.scan.is_some()),
        ] {
            if samples == 0 && is_given {
                return Err(OptionsError::NoEffect {
                    setting,
                    required: Setting::Samples,
                    value: "N",
                });
            }
        }
        Ok(Options {
            prior,
            completion_options,
            ..Options::new(model, samples, schedule, effort, seed)
        })
    }
}

#[cfg(test)]
mod tests {
    use clap::{Command, FromArgMatches};

    use super::*;

    /// A value for each option that differs from its default.
    const VALUES: [(&str, &str); 15] = [
        ("share", "3,1"),
        ("missing", "0.3"),
        ("noise", "0.02"),
        ("additive", "0.01"),
        ("levels", "64"),
        ("procedural", "0.1"),
        ("max-theta-i", "60"),
        ("max-theta-o", "70"),
        ("min-separation", "20"),
        ("in-plane", ""),
        ("scan-seconds", "40"),
        ("speed", "5"),
        ("settle", "2"),
        ("bases", "3"),
        ("eta", "10"),
    ];

    /// Returns all that the options determine; None if they are refused.
    fn effect(
        options: &[(&str, &str)],
        model: ModelKind,
        samples: usize,
        schedule: Schedule,
    ) -> Option<(u64, Vec<f32>)> {
        let words = options.iter().map(|(name, value)| match *value {
            "" => format!("--{name}"),
            value => format!("--{name}={value}"),
        });
        let words = ["train".to_owned()].into_iter().chain(words);
        let command = TrainingArgs::augment_args(Command::new("train"));
        let matches = command.try_get_matches_from(words).ok()?;
        let args = TrainingArgs::from_arg_matches(&matches).ok()?;
        args.check_effect(&[model], schedule).ok()?;
        let options = args.options(model, samples, schedule, Effort::Quick, 0);
        Some((options.ok()?.digest(), args.share))
    }

    #[test]
    fn each_option_changes_the_training_or_is_refused_beside_each_other() {
        let command = TrainingArgs::augment_args(Command::new("train"));
        let names: Vec<&str> = command
            .get_arguments()
            .filter_map(clap::Arg::get_long)
            .collect();
        assert_eq!(names.len(), VALUES.len(), "{names:?}");
        let mut accepted = vec![false; VALUES.len()];
        let cases = [
            (ModelKind::Linear, 4, Schedule::Prior),
            (ModelKind::Linear, 4, Schedule::Paper),
            (ModelKind::Linear, 0, Schedule::Prior),
            (ModelKind::Phong, 4, Schedule::Prior),
            (ModelKind::Phong, 4, Schedule::Paper),
        ];
        for (model, samples, schedule) in cases {
            let effect = |options: &[_]| effect(options, model, samples, schedule);
            let none = effect(&[]);
            for (first, one) in VALUES.into_iter().enumerate() {
                let alone = effect(&[one]);
                assert!(alone.is_none() || alone != none, "{one:?}");
                for (second, other) in VALUES
                    .into_iter()
                    .enumerate()
                    .filter(|(_, each)| *each != one)
                {
                    let Some(both) = effect(&[one, other]) else {
                        continue;
                    };
                    assert_ne!(
                        Some(both),
                        effect(&[other]),
                        "{one:?} beside {other:?}, {model:?}"
                    );
                    accepted[first] = true;
                    accepted[second] = true;
                }
            }
        }
        assert!(!accepted.contains(&false), "{accepted:?}");
    }
}
