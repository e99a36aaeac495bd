//! A request for a plan, with the options of `trainer plan`.

use clap::Args;
use glimpse_core::geometry::Arms;
use glimpse_core::gonio::Limits;
use glimpse_core::recipe::Recipe;
use glimpse_materials::setting::Name;
use serde::{Deserialize, Serialize};

use super::arms::axis_speeds;
use super::machine::{MachineError, Position, TimedMachine};
use super::stop::{PlanError, stops};
use super::visit::{Order, Route};

/// Options for the limits of a machine's arms.
#[derive(Args, Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LimitArgs {
    /// Largest angle of the light to the normal in degrees, above 0 to 90 [default: 90; with a recipe, its own]
    #[arg(long, value_name = "DEGREES")]
    #[serde(rename = "max_theta_i_degrees")]
    pub max_theta_i: Option<f32>,
    /// Largest angle of the sensor to the normal in degrees, above 0 to 90 [default: 90; with a recipe, its own]
    #[arg(long, value_name = "DEGREES")]
    #[serde(rename = "max_theta_o_degrees")]
    pub max_theta_o: Option<f32>,
    /// Smallest angle between light and sensor as seen from the measured spot, in degrees, above 0 to 180
    /// [default: 0; with a recipe, its own]
    #[arg(long, value_name = "DEGREES")]
    #[serde(rename = "min_separation_degrees")]
    pub min_separation: Option<f32>,
    /// Two arms in one plane with the normal, without azimuths. The sensor's arm swings through the normal;
    /// theta_o is negative on the light's side [default: any directions; with a recipe, its own]
    #[arg(long)]
    pub in_plane: bool,
}

impl LimitArgs {
    /// Returns the limits of these options, with `default` for options that were not given.
    ///
    /// # Errors
    /// If an angle is out of range, or no pair of directions is within the limits.
    pub fn or(self, default: Limits) -> Result<Limits, MachineError> {
        let radians = |limit, degrees: Option<f32>, default, right_angles| {
            let max = 90.0 * right_angles;
            match degrees {
                None => Ok(default),
                // The conversion to radians could round 90 degrees up.
                Some(degrees) if degrees > 0.0 && degrees <= max => Ok(degrees
                    .to_radians()
                    .min(right_angles * Limits::NONE.max_theta_i)),
                Some(degrees) => Err(MachineError::Angle {
                    limit,
                    degrees,
                    max,
                }),
            }
        };
        let (theta_i, theta_o) = (self.max_theta_i, self.max_theta_o);
        let separation = self.min_separation;
        let limits = Limits {
            max_theta_i: radians(Name::MAX_THETA_I, theta_i, default.max_theta_i, 1.0)?,
            max_theta_o: radians(Name::MAX_THETA_O, theta_o, default.max_theta_o, 1.0)?,
            min_separation: radians(
                Name::MIN_SEPARATION,
                separation,
                default.min_separation,
                2.0,
            )?,
            in_plane: self.in_plane || default.in_plane,
        };
        limits.validate()?;
        Ok(limits)
    }
}

/// Options for the speeds of a machine's axes.
#[derive(Args, Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SpeedArgs {
    /// Speeds of the axes theta_i, phi_i, theta_o, phi_o in degrees per second, 0.001 to 1,000,000: one
    /// number for all axes, or four, for example 20,10,20,10. Speed 0 marks an azimuth axis that the
    /// machine does not have. With --in-plane two, of theta_i and theta_o [default: 10; with a
    /// recipe, its own]
    #[arg(long, value_name = "DEGREES/S", value_parser = speeds)]
    #[serde(rename = "speed_degrees_per_second")]
    pub speed: Option<Arms<f64>>,
    /// Seconds for settling and reading at each sample, 0 to 86,400 [default: 0.5; with a recipe, its own]
    #[arg(long, value_name = "SECONDS")]
    #[serde(rename = "settle_seconds")]
    pub settle: Option<f64>,
}

impl SpeedArgs {
    /// Returns the machine with these limits. `stated` has the values of options that were not given.
    pub(crate) fn machine(self, limits: Limits, stated: &TimedMachine) -> TimedMachine {
        let mut speeds = self.speed.unwrap_or(stated.speeds);
        let is_for_all = |speeds: Arms<f64>| speeds == Arms::from_array([speeds.theta_i; 4]);
        if limits.in_plane && self.speed.is_none_or(is_for_all) {
            (speeds.phi_i, speeds.phi_o) = (0.0, 0.0);
        }
        TimedMachine {
            speeds,
            settle: self.settle.unwrap_or(stated.settle),
            limits,
            ..*stated
        }
    }
}

/// Options for a machine.
#[derive(Args, Clone, Copy, Debug, Default, PartialEq)]
pub struct MachineArgs {
    /// The limits of the arms.
    #[command(flatten)]
    pub limits: LimitArgs,
    /// The speeds of the axes.
    #[command(flatten)]
    pub speeds: SpeedArgs,
}

impl MachineArgs {
    /// Returns the machine. `stated` has the values of options that were not given.
    ///
    /// # Errors
    /// If a value is out of range.
    pub fn machine(&self, stated: &TimedMachine) -> Result<TimedMachine, MachineError> {
        let machine = self.speeds.machine(self.limits.or(stated.limits)?, stated);
        machine.validate()?;
        Ok(machine)
    }

    /// Returns the arms at the start of a scan, if a speed or a time was given.
    #[must_use]
    pub fn position(&self, machine: TimedMachine) -> Option<Position> {
        (self.speeds != SpeedArgs::default()).then(|| Position::new(machine))
    }
}

/// A request for a plan.
#[derive(Args, Clone, Copy, Debug, Default, PartialEq)]
pub struct PlanArgs {
    /// Order of the samples [default: progressive for recipes trained with --scan-seconds, whose own
    /// order is a fast path; travel for others]
    #[arg(long, value_enum)]
    pub order: Option<Order>,
    /// The machine.
    #[command(flatten)]
    pub machine: MachineArgs,
    /// Keep the difference of the azimuths within -180 to 180 degrees, so that no cable winds up
    #[arg(long)]
    pub no_full_turns: bool,
}

impl PlanArgs {
    /// Plans a scan. `stated` is the machine that the recipe was trained for.
    ///
    /// # Errors
    /// If the machine is invalid, or samples are out of its reach.
    pub fn plan(
        &self,
        recipe: &Recipe<'_>,
        stated: &TimedMachine,
        seed: u64,
    ) -> Result<(TimedMachine, Route), PlanError> {
        let machine = TimedMachine {
            full_turns: !self.no_full_turns,
            ..self.machine.machine(stated)?
        };
        if machine.limits.in_plane && self.no_full_turns {
            return Err(MachineError::Azimuth(Name("full_turns")).into());
        }
        let stops = stops(recipe, &machine.limits)?;
        let own = if recipe.is_in_path_order() {
            Order::Progressive
        } else {
            Order::Travel
        };
        let order = self.order.unwrap_or(own);
        Ok((machine, Route::new(&machine, &stops, order, seed)))
    }
}

/// Parses one speed for all axes, two speeds in one plane, or four speeds.
fn speeds(text: &str) -> Result<Arms<f64>, &'static str> {
    let numbers = text.split(',').map(|text| text.trim().parse().ok());
    let numbers = numbers.map(|number| number.filter(|number: &f64| number.is_finite()));
    let numbers: Option<Vec<f64>> = numbers.collect();
    numbers.and_then(|speeds| axis_speeds(&speeds)).ok_or(
        "give one number for all axes, four numbers such as 20,10,20,10, or two with --in-plane, in degrees per second",
    )
}
