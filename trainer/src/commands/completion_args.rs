//! Options of schedule prior: readings, materials and limits that the completion is trained for.

use anyhow::{Context, bail};
use clap::Args;
use glimpse_core::gonio::Limits;
use glimpse_training::meta::options::CompletionOptions;
use glimpse_training::meta::plan::Schedule;
use glimpse_training::meta::scan_budget::ScanBudget;
use glimpse_training::route::{Axes, Machine, limits_in_degrees};

use super::numbers;

/// Options of schedule prior.
#[derive(Args, Clone, Copy)]
pub(crate) struct CompletionArgs {
    /// Schedule prior: share of training tasks with missing readings, 0 to 1. If it is above 0, for
    /// example 0.5, the recipe tolerates missing readings. Without --scan-seconds, the first samples of
    /// its pattern are then the most informative, for scans that end early [default: 0; 0.5 for more than 32 samples, where
    /// it lowers the loss]
    #[arg(long, value_name = "SHARE", value_parser = numbers::share)]
    missing: Option<f32>,
    /// Schedule prior: standard deviation of the readings' noise, relative to each value, 0 to 0.5:
    /// 0.02 is 2 % [default: 0]
    #[arg(long, value_name = "S", value_parser = numbers::number(0.0..=0.5_f32))]
    noise: Option<f32>,
    /// Schedule prior: standard deviation of noise that does not depend on the value, relative to the
    /// BRDF 1/pi of a white surface, 0 to 0.5: 0.01 is 1 % [default: 0]
    #[arg(long, value_name = "S", value_parser = numbers::number(0.0..=0.5_f32))]
    additive: Option<f32>,
    /// Schedule prior: number of quantization levels of the sensor between darkness and a white
    /// surface that faces the light; 0 for no quantization [default: 0]
    #[arg(long, value_name = "COUNT", value_parser = numbers::integer(0..=u32::MAX))]
    levels: Option<u32>,
    /// Schedule prior: share of procedural materials in training, 0 to 0.99 [default: 0.4]
    #[arg(long, value_name = "SHARE", value_parser = numbers::number(0.0..=0.99_f32))]
    procedural: Option<f32>,
    /// Schedule prior: largest angle of the light to the normal in degrees, above 0 to 90 [default: 90]
    #[arg(long, value_name = "DEGREES", value_parser = numbers::polar_angle)]
    max_theta_i: Option<f32>,
    /// Schedule prior: largest angle of the sensor to the normal in degrees, above 0 to 90 [default: 90]
    #[arg(long, value_name = "DEGREES", value_parser = numbers::polar_angle)]
    max_theta_o: Option<f32>,
    /// Schedule prior: smallest angle between light and sensor as seen from the measured spot, in
    /// degrees, above 0 to 180 [default: 0]
    #[arg(long, value_name = "DEGREES", value_parser = numbers::degrees)]
    min_separation: Option<f32>,
    /// Schedule prior: longest time of a scan in seconds, by the rules of `trainer plan`: motion, and
    /// settling at each sample. The pattern and its order are trained to keep within it [default: any
    /// time]
    #[arg(long, value_name = "SECONDS", value_parser = numbers::number(0.001..=1e6))]
    scan_seconds: Option<f64>,
    /// With --scan-seconds: speeds of the axes theta_i, phi_i, theta_o, phi_o in degrees per second, as
    /// in `trainer plan`: one number for all axes, or four [default: 10]
    #[arg(long, value_name = "DEGREES/S", value_parser = numbers::speeds, requires = "scan_seconds")]
    speed: Option<Axes>,
    /// With --scan-seconds: seconds for settling and reading at each sample, 0 to 86400 [default: 0.5]
    #[arg(
        long,
        value_name = "SECONDS",
        value_parser = numbers::number(0.0..=86_400.0),
        requires = "scan_seconds"
    )]
    settle: Option<f64>,
}

impl CompletionArgs {
    /// Returns the options of a training, with defaults for this number of samples.
    ///
    /// # Errors
    /// If an option was given for another schedule, or a value is out of range.
    pub(crate) fn options_for(
        self,
        schedule: Schedule,
        samples: usize,
    ) -> anyhow::Result<CompletionOptions> {
        let default = CompletionOptions::for_samples(samples);
        let options = [
            ("--missing", self.missing.is_some()),
            ("--noise", self.noise.is_some()),
            ("--additive", self.additive.is_some()),
            ("--levels", self.levels.is_some()),
            ("--procedural", self.procedural.is_some()),
            ("--max-theta-i", self.max_theta_i.is_some()),
            ("--max-theta-o", self.max_theta_o.is_some()),
            ("--min-separation", self.min_separation.is_some()),
            ("--scan-seconds", self.scan_seconds.is_some()),
        ];
        if schedule != Schedule::Prior
            && let Some((name, _)) = options.iter().find(|(_, is_set)| *is_set)
        {
            bail!("{name} has no effect: it applies to --schedule prior only; remove it");
        }
        let completion_options = CompletionOptions {
            missing: self.missing.unwrap_or(default.missing),
            noise: self.noise.unwrap_or(default.noise),
            additive: self.additive.unwrap_or(default.additive),
            levels: self.levels.unwrap_or(default.levels),
            procedural: self.procedural.unwrap_or(default.procedural),
            limits: limits_in_degrees(
                Limits::NONE,
                [self.max_theta_i, self.max_theta_o, self.min_separation],
            ),
            scan: self.scan_seconds.map(|seconds| self.scan_budget(seconds)),
        };
        completion_options.validate()?;
        if let Some(scan) = &completion_options.scan {
            scan.validate(completion_options.limits, samples)
                .context("--scan-seconds, --speed and --settle")?;
        }
        Ok(completion_options)
    }

    fn scan_budget(&self, seconds: f64) -> ScanBudget {
        let Machine { speeds, settle, .. } = Machine::default();
        ScanBudget {
            seconds,
            speeds: self.speed.unwrap_or(speeds),
            settle: self.settle.unwrap_or(settle),
        }
    }
}
