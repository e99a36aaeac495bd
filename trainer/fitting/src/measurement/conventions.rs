//! Units and conventions of stated angles.

use std::f64::consts::FRAC_PI_2;

use clap::{Args, ValueEnum};
use glimpse_core::geometry::{Angles, HalfDifference};
use serde::{Deserialize, Serialize};

use super::angles::{rusinkiewicz, vector};
use crate::choice::Choice;

/// The unit of angles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum AngleUnit {
    /// Degrees.
    Degrees,
    /// Radians.
    Radians,
}

/// Unit and conventions of a table's angles.
#[derive(Args, Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AngleArgs {
    /// Unit of the angles [default: degrees, unless all are small enough to be radians]
    #[arg(long, value_enum)]
    pub unit: Option<AngleUnit>,
    /// Unit of azimuths, if it is another one [default: that of polar angles]
    #[arg(long, value_enum, value_name = "UNIT")]
    pub azimuth_unit: Option<AngleUnit>,
    /// Conventions of the angles, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', value_name = "CONVENTION,...")]
    pub convention: Vec<AngleConvention>,
}

/// A convention of directions. Without it, polar angles are measured from the normal, and are not negative.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum AngleConvention {
    /// Polar angles from the surface.
    Elevation,
    /// A negative polar angle is at the opposite azimuth.
    Signed,
    /// The azimuth of the sensor is 0 in the mirror direction, as ASTM and NIST count it; in one plane, a negative theta_o is
    /// on the side of the mirror direction.
    FromMirror,
    /// The columns of light and sensor are exchanged.
    Exchanged,
    /// The light's angles are those of its direction of travel, toward the surface.
    Travel,
}

impl AngleArgs {
    /// Returns true if the angles have a convention.
    #[must_use]
    pub fn has(&self, convention: AngleConvention) -> bool {
        self.convention.contains(&convention)
    }

    /// Returns these options with a convention, or without it if they have it.
    #[must_use]
    pub fn toggled(&self, convention: AngleConvention) -> Self {
        let mut toggled = self.clone();
        toggled.convention.retain(|other| *other != convention);
        if !self.has(convention) {
            toggled.convention.push(convention);
        }
        toggled
    }

    /// Returns the unit of polar angles or azimuths, if an option states it.
    pub(super) fn unit_of(&self, is_polar: bool) -> Option<AngleUnit> {
        let azimuth_unit = self.azimuth_unit.filter(|_| !is_polar);
        azimuth_unit.or(self.unit)
    }
}

/// A complete set of angle columns.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum AngleSet {
    HalfDifference,
    /// Polar angles (from the normal) and azimuths of both directions.
    Directions,
    /// With the sensor's azimuth from that of the light.
    Relative,
    /// In one plane. A positive polar angle of the sensor is on the side of the mirror direction.
    InPlane,
}

impl AngleSet {
    pub(super) const ALL: [Self; 4] = [
        Self::HalfDifference,
        Self::Directions,
        Self::Relative,
        Self::InPlane,
    ];

    /// Returns the names of the columns.
    pub(super) fn names(self) -> &'static [&'static str] {
        match self {
            Self::HalfDifference => &["theta_h", "theta_d", "phi_d"],
            Self::Directions => &["theta_i", "phi_i", "theta_o", "phi_o"],
            Self::Relative => &["theta_i", "theta_o", "phi"],
            Self::InPlane => &["theta_i", "theta_o"],
        }
    }

    /// Returns the index and the name of each column, and true for a polar angle.
    pub(super) fn columns(self) -> impl Iterator<Item = (usize, &'static str, bool)> {
        let names = self.names().iter().enumerate();
        names.map(|(index, name)| (index, *name, name.starts_with("theta")))
    }
}

/// The numbers of a row's angle columns, in the order of [`AngleSet::names`]; 0 for columns that the set lacks.
pub(super) type StatedAngles = [f64; 4];

/// The meaning of [`StatedAngles`], as far as the file states it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct AngleFormat {
    pub(super) set: AngleSet,
    /// The stated unit of each column.
    pub(super) stated: [Option<AngleUnit>; 4],
}

impl AngleFormat {
    /// Returns the unit of a column.
    pub(super) fn unit(&self, index: usize, is_polar: bool, args: &AngleArgs) -> AngleUnit {
        let stated = self.stated[index].or(args.unit_of(is_polar));
        stated.unwrap_or(AngleUnit::Degrees)
    }

    /// Converts the angles of a row to Rusinkiewicz angles in radians. The error describes an angle.
    pub(super) fn convert(
        &self,
        row: &StatedAngles,
        args: &AngleArgs,
    ) -> Result<Angles<f64>, String> {
        use AngleConvention::{Elevation, Exchanged, FromMirror, Signed, Travel};

        let mut radians = [0.0; 4];
        for (index, name, is_polar) in self.set.columns() {
            let number = row[index];
            let unit = self.unit(index, is_polar, args);
            let mut angle = match unit {
                AngleUnit::Radians => number,
                AngleUnit::Degrees => number.to_radians(),
            };
            if is_polar {
                if args.has(Elevation) {
                    angle = FRAC_PI_2 - angle;
                }
                let is_half = self.set == AngleSet::HalfDifference;
                let max_degrees = if is_half { 90.0 } else { 180.0 };
                let is_signed = self.set == AngleSet::InPlane || args.has(Signed);
                if angle < 0.0 && !is_signed || angle.abs().to_degrees() > max_degrees {
                    return Err(format!(
                        "column {name}: {number} {} is out of range; give an angle of 0 to {max_degrees} degrees, or --convention \
                         signed if a negative polar angle is at the opposite azimuth",
                        unit.name()
                    ));
                }
            }
            radians[index] = angle;
        }
        let [a, b, c, d] = radians;
        let [mut light, mut sensor] = match self.set {
            AngleSet::HalfDifference => {
                let angles = Angles {
                    theta_h: a,
                    theta_d: b,
                    phi_d: c,
                };
                if !args.has(Exchanged) && !args.has(Travel) {
                    return Ok(angles);
                }
                let pair = HalfDifference::from_angles(angles).directions();
                [pair.incoming, pair.outgoing]
            }
            AngleSet::Directions => [vector(a, b), vector(c, d)],
            AngleSet::Relative => [vector(a, 0.0), vector(b, c)],
            // The sign is that of the sensor's angle.
            AngleSet::InPlane if args.has(Exchanged) => [vector(-a, 0.0), vector(b.abs(), 0.0)],
            AngleSet::InPlane => [vector(a.abs(), 0.0), vector(-b, 0.0)],
        };
        if args.has(Exchanged) {
            [light, sensor] = [sensor, light];
        }
        if args.has(FromMirror) {
            sensor = [-sensor[0], -sensor[1], sensor[2]];
        }
        if args.has(Travel) {
            let [x, y, z] = light;
            // In one plane, the sensor's side is relative to the light.
            light = match self.set {
                AngleSet::InPlane => [x, y, -z],
                _ => [-x, -y, -z],
            };
        }
        Ok(rusinkiewicz(light, sensor))
    }
}
