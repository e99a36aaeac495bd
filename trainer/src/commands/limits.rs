//! Limits of a machine's arms: as options, and as text.

use anyhow::Context;
use clap::Args;
use glimpse_core::gonio::Limits;
use glimpse_training::route::limits_in_degrees;

use super::numbers;

/// Options for the limits of a machine's arms.
#[derive(Args, Clone, Copy)]
pub(super) struct LimitArgs {
    /// Largest angle of the light to the normal in degrees, above 0 to 90 [default: the recipe's, or else 90]
    #[arg(long, value_name = "DEGREES", value_parser = numbers::polar_angle)]
    max_theta_i: Option<f32>,
    /// Largest angle of the sensor to the normal in degrees, above 0 to 90 [default: the recipe's, or else 90]
    #[arg(long, value_name = "DEGREES", value_parser = numbers::polar_angle)]
    max_theta_o: Option<f32>,
    /// Smallest angle between light and sensor as seen from the measured spot, in degrees, above 0 to 180
    /// [default: the recipe's, or else 0]
    #[arg(long, value_name = "DEGREES", value_parser = numbers::degrees)]
    min_separation: Option<f32>,
}

impl LimitArgs {
    /// Returns the limits of these options, with `default` for options that were not given.
    ///
    /// # Errors
    /// If no pair of directions is within the limits.
    pub(super) fn or(self, default: Limits) -> anyhow::Result<Limits> {
        let limits = limits_in_degrees(
            default,
            [self.max_theta_i, self.max_theta_o, self.min_separation],
        );
        limits
            .validate()
            .context("--max-theta-i, --max-theta-o and --min-separation contradict each other")?;
        Ok(limits)
    }
}

/// Describes limits, in degrees.
pub(super) fn describe(limits: Limits) -> String {
    let plane = match limits.in_plane {
        true => ", in one plane with the normal",
        false => "",
    };
    format!(
        "theta_i up to {:.1}, theta_o up to {:.1}, separation at least {:.1} (degrees){plane}",
        limits.max_theta_i.to_degrees(),
        limits.max_theta_o.to_degrees(),
        limits.min_separation.to_degrees(),
    )
}
