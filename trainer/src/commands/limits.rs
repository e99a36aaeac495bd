//! Limits of a machine: as options, and in words.

use anyhow::Context;
use clap::Args;
use glimpse_core::gonio::Limits;

use super::numbers;

/// Where a machine's arms get to.
#[derive(Args, Clone, Copy)]
pub(super) struct LimitArgs {
    /// The light's largest angle to the normal, degrees above 0 to 90 [default: the recipe's, or else 90]
    #[arg(long, value_name = "DEGREES", value_parser = numbers::polar)]
    max_theta_i: Option<f32>,
    /// The sensor's largest angle to the normal, degrees above 0 to 90 [default: the recipe's, or else 90]
    #[arg(long, value_name = "DEGREES", value_parser = numbers::polar)]
    max_theta_o: Option<f32>,
    /// The least angle between light and sensor, seen from the sample, degrees above 0 to 180 [default: the
    /// recipe's, or else 0]
    #[arg(long, value_name = "DEGREES", value_parser = numbers::degrees)]
    min_separation: Option<f32>,
}

impl LimitArgs {
    /// What was given, and `stated` where nothing was.
    pub(super) fn or(self, stated: Limits) -> anyhow::Result<Limits> {
        let polar = |given: Option<f32>, stated: f32| {
            let given = given.map(f32::to_radians);
            given.map_or(stated, |given| given.min(Limits::NONE.max_theta_i))
        };
        let limits = Limits {
            max_theta_i: polar(self.max_theta_i, stated.max_theta_i),
            max_theta_o: polar(self.max_theta_o, stated.max_theta_o),
            min_separation: self
                .min_separation
                .map_or(stated.min_separation, f32::to_radians),
            ..stated
        };
        limits
            .validate()
            .context("--max-theta-i, --max-theta-o and --min-separation do not go together")?;
        Ok(limits)
    }
}

/// Limits in words, degrees.
pub(super) fn describe(limits: Limits) -> String {
    let plane = match limits.in_plane {
        true => ", in one plane with the normal",
        false => "",
    };
    format!(
        "theta_i to {:.1}, theta_o to {:.1}, {:.1} apart (degrees){plane}",
        limits.max_theta_i.to_degrees(),
        limits.max_theta_o.to_degrees(),
        limits.min_separation.to_degrees(),
    )
}
