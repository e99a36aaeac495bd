//! Angle columns of a table, in degrees.

use std::path::Path;

use glimpse_core::geometry::{Angles, HalfDifference};
use serde::Deserialize;

use super::table::{Row, Table, TableError};

/// The columns of Rusinkiewicz angles.
const HALF_DIFFERENCE: [&str; 3] = ["theta_h", "theta_d", "phi_d"];
/// The columns of polar angles (from the normal) and azimuths of both directions.
const DIRECTIONS: [&str; 4] = ["theta_i", "phi_i", "theta_o", "phi_o"];
/// The smallest cosine of a direction above the horizon. Within 6e-8 degrees of the horizon, rounding decides the side.
const MIN_COSINE: f64 = 1e-9;

/// The column of sample indices in a measurement plan of `trainer plan`.
pub(super) const INDEX: &str = "index";

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
    /// The first line names the columns theta_h, theta_d, phi_d, or theta_i, phi_i, theta_o, phi_o, in any order.
    /// Angles are in degrees. The column `index` of a measurement plan is kept; other columns are ignored.
    ///
    /// # Errors
    /// If the file cannot be read, a column is missing or duplicated, or a cell is not an angle.
    pub fn read(path: &Path) -> Result<Self, TableError> {
        let table = Table::read(path)?;
        let Some(angles) = AngleColumns::find(&table)? else {
            return Err(table.file_error(format!(
                "line 1 names the columns {2}, which are not a complete set of angles; name {0}, or {1} (angles in \
                 degrees)",
                HALF_DIFFERENCE.join(", "),
                DIRECTIONS.join(", "),
                table.names()
            )));
        };
        let mut columns = angles.names().to_vec();
        columns.extend(table.has(&[INDEX]).then_some(INDEX));
        let row = |row: &Row| {
            let Some(angles) = angles.parse(&table, row)? else {
                return Err(
                    table.line_error(row.line, "the angles are empty; give them in degrees")
                );
            };
            let cells = columns.iter().map(|column| table.cell(row, column));
            Ok(AngleRow {
                cells: cells.map(str::to_owned).collect(),
                angles: above_horizon(angles.to_rusinkiewicz()),
            })
        };
        let rows = table.rows().iter().map(row).collect::<Result<_, _>>()?;
        Ok(Self { columns, rows })
    }
}

/// A complete set of angle columns.
#[derive(Clone, Copy)]
pub(super) enum AngleColumns {
    HalfDifference,
    Directions,
}

/// The angle cells of a row, in degrees.
#[derive(Deserialize)]
struct AngleCells {
    theta_h: Option<f64>,
    theta_d: Option<f64>,
    phi_d: Option<f64>,
    theta_i: Option<f64>,
    phi_i: Option<f64>,
    theta_o: Option<f64>,
    phi_o: Option<f64>,
}

/// The angles of a row, in radians, in either parametrization.
#[derive(Clone, Copy, Debug)]
pub(super) enum RowAngles {
    /// theta_h, theta_d, phi_d.
    HalfDifference([f64; 3]),
    /// theta_i, phi_i, theta_o, phi_o.
    Directions([f64; 4]),
}

impl AngleColumns {
    /// Finds the angle columns of a table; None if it has no complete set of them.
    pub(super) fn find(table: &Table) -> Result<Option<Self>, TableError> {
        match (table.has(&HALF_DIFFERENCE), table.has(&DIRECTIONS)) {
            (true, false) => Ok(Some(Self::HalfDifference)),
            (false, true) => Ok(Some(Self::Directions)),
            (true, true) => Err(table.file_error(format!(
                "it has both the columns {} and {}; remove or rename one set",
                HALF_DIFFERENCE.join(", "),
                DIRECTIONS.join(", ")
            ))),
            (false, false) => Ok(None),
        }
    }

    fn names(self) -> &'static [&'static str] {
        match self {
            Self::HalfDifference => &HALF_DIFFERENCE,
            Self::Directions => &DIRECTIONS,
        }
    }

    /// Parses the angles of a row; None if all of them are empty.
    pub(super) fn parse(self, table: &Table, row: &Row) -> Result<Option<RowAngles>, TableError> {
        let cells: AngleCells = table.parse(row)?;
        let angles = match self {
            Self::HalfDifference => {
                let cells = [cells.theta_h, cells.theta_d, cells.phi_d];
                radians(HALF_DIFFERENCE, cells, 90.0).map(|all| all.map(RowAngles::HalfDifference))
            }
            Self::Directions => {
                let cells = [cells.theta_i, cells.phi_i, cells.theta_o, cells.phi_o];
                radians(DIRECTIONS, cells, 180.0).map(|all| all.map(RowAngles::Directions))
            }
        };
        angles.map_err(|message| table.line_error(row.line, &message))
    }
}

impl RowAngles {
    /// Converts two directions of length 1.
    pub(super) fn from_vectors([incoming, outgoing]: [[f64; 3]; 2]) -> Self {
        let Angles {
            theta_h,
            theta_d,
            phi_d,
        } = rusinkiewicz(incoming, outgoing);
        Self::HalfDifference([theta_h, theta_d, phi_d])
    }

    /// Converts to Rusinkiewicz angles, in radians.
    pub(super) fn to_rusinkiewicz(self) -> Angles<f64> {
        match self {
            Self::HalfDifference([theta_h, theta_d, phi_d]) => Angles {
                theta_h,
                theta_d,
                phi_d,
            },
            Self::Directions(angles) => rusinkiewicz_from_spherical(angles),
        }
    }

    /// Multiplies each angle by `scale`.
    pub(super) fn scaled(self, scale: f64) -> Self {
        match self {
            Self::HalfDifference(angles) => Self::HalfDifference(angles.map(|a| a * scale)),
            Self::Directions(angles) => Self::Directions(angles.map(|a| a * scale)),
        }
    }
}

/// Converts degrees to radians; None if all of them are None. Polar angles must be 0 to `max_theta` degrees. The error
/// describes the invalid angle.
fn radians<const N: usize>(
    names: [&str; N],
    degrees: [Option<f64>; N],
    max_theta: f64,
) -> Result<Option<[f64; N]>, String> {
    if degrees.iter().all(Option::is_none) {
        return Ok(None);
    }
    let mut radians = [0.0; N];
    for ((radians, name), degrees) in radians.iter_mut().zip(names).zip(degrees) {
        let range = match name.starts_with("phi") {
            true => f64::MIN..=f64::MAX,
            false => 0.0..=max_theta,
        };
        *radians = match degrees {
            Some(degrees) if range.contains(&degrees) => degrees.to_radians(),
            Some(degrees) => {
                return Err(format!(
                    "column {name}: {degrees} is out of range; give degrees, 0 to {max_theta} for theta"
                ));
            }
            None => {
                return Err(format!(
                    "column {name}: it is empty; give an angle in degrees"
                ));
            }
        };
    }
    Ok(Some(radians))
}

/// Converts polar angles and azimuths of two directions to Rusinkiewicz angles.
fn rusinkiewicz_from_spherical([theta_i, phi_i, theta_o, phi_o]: [f64; 4]) -> Angles<f64> {
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
fn rusinkiewicz(incoming: [f64; 3], outgoing: [f64; 3]) -> Angles<f64> {
    let sum: [f64; 3] = std::array::from_fn(|i| incoming[i] + outgoing[i]);
    let difference: [f64; 3] = std::array::from_fn(|i| incoming[i] - outgoing[i]);
    let length = |[x, y, z]: [f64; 3]| x.hypot(y).hypot(z);
    let theta_h = sum[0].hypot(sum[1]).atan2(sum[2]);
    let phi_h = sum[1].atan2(sum[0]);
    // Rotate the incoming direction so that the half vector is the z axis.
    let [x, y, z] = incoming;
    let (sin, cos) = phi_h.sin_cos();
    let (along, across) = (x * cos + y * sin, y * cos - x * sin);
    Angles {
        theta_h,
        theta_d: length(difference).atan2(length(sum)),
        phi_d: across.atan2(along * theta_h.cos() - z * theta_h.sin()),
    }
}

/// Converts to single precision with phi_d in \[0, 2 pi); None if one direction is not above the horizon.
fn above_horizon(angles: Angles<f64>) -> Option<Angles<f32>> {
    let at = HalfDifference::from_angles(angles);
    let is_above = at.cos_theta_i() > MIN_COSINE && at.cos_theta_o() > MIN_COSINE;
    is_above.then_some(Angles {
        theta_h: angles.theta_h as f32,
        theta_d: angles.theta_d as f32,
        phi_d: angles.phi_d.rem_euclid(std::f64::consts::TAU) as f32,
    })
}
