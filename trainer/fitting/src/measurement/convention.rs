//! Units and conventions of a table's angles.

use std::f64::consts::{FRAC_PI_2, PI};

use clap::{Args, ValueEnum};

/// Unit and conventions of a table's angles.
#[derive(Args, Clone, Debug, Default, PartialEq)]
pub struct AngleArgs {
    /// Unit of the angles [default: degrees, unless all are small enough to be radians]
    #[arg(long, value_enum)]
    pub unit: Option<AngleUnit>,
    /// Conventions of the angles, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', value_name = "CONVENTION,...")]
    pub convention: Vec<AngleConvention>,
}

/// The unit of angles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum AngleUnit {
    /// Degrees.
    Degrees,
    /// Radians.
    Radians,
}

/// A convention of polar angles or azimuths. Without it, polar angles are measured from the normal, and are not negative.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum AngleConvention {
    /// Polar angles from the surface.
    Elevation,
    /// A negative polar angle is at the opposite azimuth.
    Signed,
    /// The azimuth of the sensor is 0 in the mirror direction, as ASTM and NIST count it.
    FromMirror,
}

impl AngleArgs {
    fn has(&self, convention: AngleConvention) -> bool {
        self.convention.contains(&convention)
    }

    /// Converts a polar angle to radians from the normal. The error describes the angle.
    pub(super) fn polar(&self, name: &str, angle: f64, max_degrees: f64) -> Result<f64, String> {
        let radians = self.signed_polar(name, angle)?;
        if radians < 0.0 && !self.has(AngleConvention::Signed) {
            return Err(format!(
                "column {name}: {angle} is below 0; give --convention signed if a negative polar angle is at the opposite \
                 azimuth"
            ));
        }
        match radians.to_degrees() <= max_degrees {
            true => Ok(radians),
            false => Err(self.out_of_range(name, angle, max_degrees)),
        }
    }

    /// Converts a polar angle of either sign to radians from the normal. The error describes the angle.
    pub(super) fn signed_polar(&self, name: &str, angle: f64) -> Result<f64, String> {
        let radians = match self.has(AngleConvention::Elevation) {
            true => FRAC_PI_2 - self.azimuth(angle),
            false => self.azimuth(angle),
        };
        match radians.abs() <= PI {
            true => Ok(radians),
            false => Err(self.out_of_range(name, angle, 180.0)),
        }
    }

    /// Converts an azimuth to radians.
    pub(super) fn azimuth(&self, angle: f64) -> f64 {
        match self.unit {
            Some(AngleUnit::Radians) => angle,
            _ => angle.to_radians(),
        }
    }

    /// The azimuth that is added to the sensor's.
    pub(super) fn sensor_azimuth(&self) -> f64 {
        match self.has(AngleConvention::FromMirror) {
            true => PI,
            false => 0.0,
        }
    }

    fn out_of_range(&self, name: &str, angle: f64, max_degrees: f64) -> String {
        let unit = match self.unit {
            Some(AngleUnit::Radians) => "radians",
            _ => "degrees",
        };
        format!(
            "column {name}: {angle} {unit} is out of range; give an angle of 0 to {max_degrees} degrees"
        )
    }
}
