//! Options of what a completion is trained on.

use anyhow::bail;
use clap::Args;
use glimpse_trainer::meta::plan::Schedule;
use glimpse_trainer::meta::run::Completing;

/// What a completion is trained on.
#[derive(Args, Clone, Copy)]
pub(crate) struct CompletingArgs {
    /// Schedule prior: the share of training in which readings are missing, 0 to 1. Above 0, say 0.5,
    /// the recipe fits whatever was read, at some loss where all was [default: 0, all are needed]
    #[arg(long, value_name = "SHARE")]
    missing: Option<f32>,
    /// Schedule prior: the noise of readings to train for, relative: 0.02 is 2 % [default: 0]
    #[arg(long, value_name = "S")]
    noise: Option<f32>,
    /// Schedule prior: the share of procedural materials among those trained on, 0 to below 1
    /// [default: 0.15]
    #[arg(long, value_name = "SHARE")]
    procedural: Option<f32>,
}

impl CompletingArgs {
    /// What was asked for, and the defaults where nothing was; refused for other schedules, by name.
    pub(crate) fn of(self, schedule: Schedule) -> anyhow::Result<Completing> {
        let default = Completing::default();
        let given = [
            ("--missing", self.missing, 1.0),
            ("--noise", self.noise, 0.5),
            ("--procedural", self.procedural, 0.99),
        ];
        for (name, value, most) in given {
            let Some(value) = value else {
                continue;
            };
            if schedule != Schedule::Prior {
                bail!("{name} has no effect: it is for --schedule prior");
            }
            if !(0.0..=most).contains(&value) {
                bail!("{name} must be 0 to {most}, not {value}");
            }
        }
        Ok(Completing {
            missing: self.missing.unwrap_or(default.missing),
            noise: self.noise.unwrap_or(default.noise),
            procedural: self.procedural.unwrap_or(default.procedural),
        })
    }
}
