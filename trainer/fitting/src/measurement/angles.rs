//! Angle columns of a table, their unit and conventions.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::path::Path;

use clap::{Args, ValueEnum};
use glimpse_core::geometry::{Angles, Directions, HalfDifference};

use super::layout::{ANGLES, AngleUnit, INDEX};
use super::table::{Row, Table, TableError};

/// The columns of Rusinkiewicz angles.
const HALF_DIFFERENCE: [&str; 3] = ["theta_h", "theta_d", "phi_d"];
/// The columns of polar angles (from the normal) and azimuths of both directions.
const DIRECTIONS: [&str; 4] = ["theta_i", "phi_i", "theta_o", "phi_o"];
/// The smallest cosine of a direction above the horizon. Within 6e-8 degrees of the horizon, rounding decides the side.
const MIN_COSINE: f64 = 1e-9;
/// The theta_h below which the half vector is the normal, radians: the error of directions in single precision, or in degrees
/// with 5 decimals.
const POLE: f64 = 1e-6;

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
    fn polar(
        &self,
        name: &str,
        angle: f64,
        max_degrees: f64,
        may_be_negative: bool,
    ) -> Result<f64, String> {
        let radians = if self.has(AngleConvention::Elevation) {
            FRAC_PI_2 - self.azimuth(angle)
        } else {
            self.azimuth(angle)
        };
        if radians < 0.0 && !may_be_negative {
            return Err(format!(
                "column {name}: {angle} is below 0; give --convention signed if a negative polar angle is at the opposite \
                 azimuth"
            ));
        }
        if radians.abs().to_degrees() <= max_degrees {
            return Ok(radians);
        }
        let unit = match self.unit {
            Some(AngleUnit::Radians) => "radians",
            _ => "degrees",
        };
        Err(format!(
            "column {name}: {angle} {unit} is out of range; give an angle of 0 to {max_degrees} degrees"
        ))
    }

    /// Converts an azimuth to radians.
    fn azimuth(&self, angle: f64) -> f64 {
        match self.unit {
            Some(AngleUnit::Radians) => angle,
            _ => angle.to_radians(),
        }
    }
}

/// A file of pairs of directions.
pub struct AngleTable {
    /// The names of the angle columns, then `index` if the file has that column.
    pub columns: Vec<&'static str>,
    /// The rows, one pair of directions each.
    pub rows: Vec<AngleRow>,
}

/// One pair of directions.
pub struct AngleRow {
    /// The unparsed cells of [`AngleTable::columns`].
    pub cells: Vec<String>,
    /// The angles in radians; None if one of the directions is not above the horizon.
    pub angles: Option<Angles<f32>>,
}

impl AngleTable {
    /// Reads a CSV file with one pair of directions per row.
    ///
    /// One line names the columns of one set of angles, in any order. The column `index` of a measurement plan is
    /// kept; other columns are ignored.
    ///
    /// # Errors
    /// If the file cannot be read, a column is missing or duplicated, or a cell is not an angle.
    pub fn read(path: &Path, args: &AngleArgs) -> Result<Self, TableError> {
        let table = Table::read(path)?;
        let Some(angles) = AngleColumns::find(&table)? else {
            return Err(table.columns_error(&format!(
                "none of which is an angle; name {}, or {}",
                DIRECTIONS.join(", "),
                HALF_DIFFERENCE.join(", ")
            )));
        };
        let mut columns = angles.names().to_vec();
        columns.extend(table.has(&[INDEX]).then_some(INDEX));
        let mut rows = Vec::new();
        for (row, angles) in table.rows.iter().zip(angles.parse_all(&table, args)?) {
            let angles = angles.ok_or_else(|| {
                table.line_error(row.line, "the angles are empty; give all of them")
            })?;
            let cells = columns.iter().map(|column| table.cell(row, column));
            rows.push(AngleRow {
                cells: cells.map(str::to_owned).collect(),
                angles: above_horizon(angles),
            });
        }
        Ok(Self { columns, rows })
    }
}

/// A complete set of angle columns.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum AngleColumns {
    HalfDifference,
    Directions,
    /// With the sensor's azimuth from that of the light.
    Relative,
    /// In one plane. A positive polar angle of the sensor is on the side of the mirror direction.
    InPlane,
}

impl AngleColumns {
    const ALL: [Self; 4] = [
        Self::HalfDifference,
        Self::Directions,
        Self::Relative,
        Self::InPlane,
    ];

    /// Finds the angle columns of a table; None if it has none of them.
    pub(super) fn find(table: &Table) -> Result<Option<Self>, TableError> {
        let present: Vec<&str> = ANGLES
            .into_iter()
            .filter(|name| table.has(&[name]))
            .collect();
        let is_complete = |columns: &Self| {
            let names = columns.names();
            names.len() == present.len() && table.has(names)
        };
        let found = Self::ALL.into_iter().find(is_complete);
        if found.is_some() || present.is_empty() {
            return Ok(found);
        }
        let sets = Self::ALL.map(|columns| columns.names().join(", "));
        Err(table.file_error(format!(
            "line {} names the angles {}; name all columns of one set, and of no other: {}",
            table.layout.line,
            present.join(", "),
            sets.join("; ")
        )))
    }

    fn names(self) -> &'static [&'static str] {
        match self {
            Self::HalfDifference => &HALF_DIFFERENCE,
            Self::Directions => &DIRECTIONS,
            Self::Relative => &["theta_i", "theta_o", "phi"],
            Self::InPlane => &["theta_i", "theta_o"],
        }
    }

    /// Parses the angles of all rows, as Rusinkiewicz angles in radians. None for a row whose angles are all empty.
    ///
    /// # Errors
    /// If an angle is missing or out of range, or if all are small enough to be radians and their unit is not stated.
    pub(super) fn parse_all(
        self,
        table: &Table,
        args: &AngleArgs,
    ) -> Result<Vec<Option<Angles<f64>>>, TableError> {
        let has_azimuths = matches!(self, Self::Directions | Self::Relative);
        if !has_azimuths && args.has(AngleConvention::FromMirror) {
            let message =
                "--convention from-mirror has no effect without the sensor's azimuth; remove it";
            return Err(table.file_error(message.to_owned()));
        }
        let stated = table.angle_unit(self.names())?;
        if stated.is_some_and(|stated| args.unit.is_some_and(|unit| unit != stated)) {
            let message = "the unit of its angles differs from that of --unit; remove the option, or correct the table";
            return Err(table.file_error(message.to_owned()));
        }
        let args = &AngleArgs {
            unit: stated.or(args.unit),
            ..args.clone()
        };
        let rows = table.rows.iter().map(|row| self.parse(table, row, args));
        let rows: Vec<Option<Angles<f64>>> = rows.collect::<Result<_, _>>()?;
        let largest = |select: fn(&str) -> bool| {
            let names = self.names().iter().filter(|name| select(name));
            let cells = names.flat_map(|name| table.rows.iter().map(|row| table.cell(row, name)));
            let angles = cells.filter_map(|cell| cell.parse::<f64>().ok());
            angles.fold(0.0, |max: f64, angle| max.max(angle.abs()))
        };
        let theta = largest(|name| name.starts_with("theta"));
        let phi = largest(|name| name.starts_with("phi"));
        let may_be_radians = theta <= FRAC_PI_2 && phi <= TAU && theta + phi > 0.0;
        if args.unit.is_none() && may_be_radians {
            return Err(table.file_error(format!(
                "all of its angles are at most {theta:.4} (polar) and {phi:.4} (azimuth), small enough to be radians; give \
                 --unit radians or --unit degrees"
            )));
        }
        Ok(rows)
    }

    fn parse(
        self,
        table: &Table,
        row: &Row,
        args: &AngleArgs,
    ) -> Result<Option<Angles<f64>>, TableError> {
        let mut cells = self.names().iter().map(|name| table.cell(row, name));
        if cells.all(str::is_empty) {
            return Ok(None);
        }
        let error = |message: String| table.line_error(row.line, &message);
        let angle = |name: &str| {
            let angle = table
                .number::<f64>(row, name, "give an angle")?
                .filter(|angle| angle.is_finite());
            angle.ok_or_else(|| {
                error(format!(
                    "column {name}: it is empty or not finite; give an angle"
                ))
            })
        };
        let may_be_negative = self == Self::InPlane || args.has(AngleConvention::Signed);
        let polar = |name, max_degrees| {
            let angle = angle(name)?;
            args.polar(name, angle, max_degrees, may_be_negative)
                .map_err(error)
        };
        let theta = |name| polar(name, 180.0);
        let azimuth = |name| Ok(args.azimuth(angle(name)?));
        let mut directions = match self {
            Self::HalfDifference => {
                return Ok(Some(Angles {
                    theta_h: polar("theta_h", 90.0)?,
                    theta_d: polar("theta_d", 90.0)?,
                    phi_d: azimuth("phi_d")?,
                }));
            }
            Self::Directions => [
                theta("theta_i")?,
                azimuth("phi_i")?,
                theta("theta_o")?,
                azimuth("phi_o")?,
            ],
            Self::Relative => [theta("theta_i")?, 0.0, theta("theta_o")?, azimuth("phi")?],
            Self::InPlane => [theta("theta_i")?.abs(), 0.0, -theta("theta_o")?, 0.0],
        };
        if args.has(AngleConvention::FromMirror) {
            directions[3] += PI;
        }
        Ok(Some(from_spherical(directions)))
    }
}

/// Converts polar angles and azimuths of two directions to Rusinkiewicz angles, in radians.
pub(super) fn from_spherical([theta_i, phi_i, theta_o, phi_o]: [f64; 4]) -> Angles<f64> {
    let direction = |theta: f64, phi: f64| {
        let (sin, cos) = theta.sin_cos();
        [sin * phi.cos(), sin * phi.sin(), cos]
    };
    rusinkiewicz(direction(theta_i, phi_i), direction(theta_o, phi_o))
}

/// Returns the Rusinkiewicz angles, in radians, of two directions of length 1 that point away from the surface.
/// The z axis is the surface normal, and phi_d is in \[0, 2 pi). None if one direction is not above the horizon.
#[must_use]
pub fn angles_from_vectors(incoming: [f64; 3], outgoing: [f64; 3]) -> Option<Angles<f32>> {
    above_horizon(rusinkiewicz(incoming, outgoing))
}

/// Returns the Rusinkiewicz angles, in radians, of two directions of length 1.
#[must_use]
pub fn rusinkiewicz(incoming: [f64; 3], outgoing: [f64; 3]) -> Angles<f64> {
    let sum: [f64; 3] = std::array::from_fn(|i| incoming[i] + outgoing[i]);
    let difference: [f64; 3] = std::array::from_fn(|i| incoming[i] - outgoing[i]);
    let length = |[x, y, z]: [f64; 3]| x.hypot(y).hypot(z);
    let theta_h = sum[0].hypot(sum[1]).atan2(sum[2]);
    let [x, y, z] = incoming;
    // At the pole, phi_d is 0, as on the device: the azimuth of the half vector is that of the light.
    let phi_h = if theta_h < POLE {
        y.atan2(x)
    } else {
        sum[1].atan2(sum[0])
    };
    // Rotate the incoming direction so that the half vector is the z axis.
    let (sin, cos) = phi_h.sin_cos();
    let (along, across) = (x * cos + y * sin, y * cos - x * sin);
    Angles {
        theta_h,
        theta_d: length(difference).atan2(length(sum)),
        phi_d: across.atan2(along * theta_h.cos() - z * theta_h.sin()),
    }
}

/// Converts to single precision with phi_d in \[0, 2 pi); None if one direction is not above the horizon.
pub(super) fn above_horizon(angles: Angles<f64>) -> Option<Angles<f32>> {
    let at = HalfDifference::from_angles(angles);
    let is_above = at.cos_theta_i() > MIN_COSINE && at.cos_theta_o() > MIN_COSINE;
    let phi_d = angles.phi_d.rem_euclid(TAU) as f32;
    // Of two equal directions, rounding may turn one angle to -0 or to the whole turn.
    let is_whole_turn = phi_d >= TAU as f32;
    is_above.then_some(Angles {
        theta_h: angles.theta_h as f32 + 0.0,
        theta_d: angles.theta_d as f32 + 0.0,
        phi_d: if is_whole_turn { 0.0 } else { phi_d + 0.0 },
    })
}

/// Converts Rusinkiewicz angles, in radians, to vectors.
pub(super) fn to_directions(angles: Angles<f64>) -> Directions<f32> {
    let pair = HalfDifference::from_angles(angles).directions();
    Directions {
        incoming: pair.incoming.map(|x| x as f32),
        outgoing: pair.outgoing.map(|x| x as f32),
    }
}
