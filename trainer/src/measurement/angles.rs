//! Columns of angles, in degrees.

use std::path::Path;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_materials::untrusted::escaped;

use super::table::{Row, Table, TableError};

/// Rusinkiewicz angles.
const HALF_DIFFERENCE: [&str; 3] = ["theta_h", "theta_d", "phi_d"];
/// Each direction's angle to the normal, and its azimuth.
const DIRECTIONS: [&str; 4] = ["theta_i", "phi_i", "theta_o", "phi_o"];
/// Below this cosine, 6e-8 degrees from the horizon, rounding decides on which side of it a
/// direction is.
const AT_HORIZON: f64 = 1e-9;

/// The column of sample numbers, as a plan has them.
pub(super) const INDEX: &str = "index";

/// A file of angles.
pub struct AngleTable {
    /// The names of the columns that are kept: those of the angles, then `index` if the file has it.
    pub columns: Vec<&'static str>,
    /// A pair of directions a row.
    pub rows: Vec<AngleRow>,
}

/// A pair of directions.
pub struct AngleRow {
    /// The cells of [`AngleTable::columns`], as they were given.
    pub cells: Vec<String>,
    /// In radians; None where one of the directions is not above the horizon.
    pub angles: Option<Angles<f32>>,
}

impl AngleTable {
    /// Reads one pair of directions a row.
    ///
    /// The first line names the columns: theta_h, theta_d, phi_d, or theta_i, phi_i, theta_o, phi_o,
    /// in any order. Angles are in degrees. A column `index`, by which a plan names its samples, is kept;
    /// other columns are ignored.
    ///
    /// # Errors
    /// If the file cannot be read, lacks columns or has them twice, or a cell is no angle.
    pub fn read(path: &Path) -> Result<Self, TableError> {
        let table = Table::read(path)?;
        let Some(columns) = AngleColumns::of(&table)? else {
            return Err(table.damaged(format!(
                "its first line should name columns {}, or {} (angles in degrees), but names {}; \
                 correct it",
                HALF_DIFFERENCE.join(", "),
                DIRECTIONS.join(", "),
                table.names()
            )));
        };
        let index = table.column(INDEX)?;
        let places: Vec<usize> = columns.places().iter().copied().chain(index).collect();
        let row = |row: &Row| {
            let given = columns.given(row);
            let given = given.map_err(|what| table.wrong(row.line, &what))?;
            let cells = places.iter();
            Ok(AngleRow {
                cells: cells.map(|place| row.cell(*place).to_owned()).collect(),
                angles: above_horizon(given.angles()),
            })
        };
        Ok(Self {
            columns: columns
                .names()
                .iter()
                .copied()
                .chain(index.map(|_| INDEX))
                .collect(),
            rows: table.rows().iter().map(row).collect::<Result<_, _>>()?,
        })
    }
}

/// Where the angles are in a row.
pub(super) enum AngleColumns {
    HalfDifference([usize; 3]),
    Directions([usize; 4]),
}

/// The angles of a row, as they were given but in radians.
#[derive(Clone, Copy, Debug)]
pub(super) enum Given {
    /// theta_h, theta_d, phi_d.
    HalfDifference([f64; 3]),
    /// theta_i, phi_i, theta_o, phi_o.
    Directions([f64; 4]),
}

impl AngleColumns {
    /// Of a table; None if it has none.
    pub(super) fn of(table: &Table) -> Result<Option<Self>, TableError> {
        match (table.columns(HALF_DIFFERENCE)?, table.columns(DIRECTIONS)?) {
            (Some(columns), None) => Ok(Some(Self::HalfDifference(columns))),
            (None, Some(columns)) => Ok(Some(Self::Directions(columns))),
            (Some(_), Some(_)) => Err(table.damaged(format!(
                "it has columns {} as well as {}; remove or rename those that are not meant",
                HALF_DIFFERENCE.join(", "),
                DIRECTIONS.join(", ")
            ))),
            (None, None) => Ok(None),
        }
    }

    /// Their names.
    fn names(&self) -> &'static [&'static str] {
        match self {
            Self::HalfDifference(_) => &HALF_DIFFERENCE,
            Self::Directions(_) => &DIRECTIONS,
        }
    }

    /// Where they are, in the order of the names.
    fn places(&self) -> &[usize] {
        match self {
            Self::HalfDifference(places) => places,
            Self::Directions(places) => places,
        }
    }

    /// True if a row leaves all of them empty.
    pub(super) fn are_empty(&self, row: &Row) -> bool {
        self.places()
            .iter()
            .all(|place| row.cell(*place).is_empty())
    }

    /// A row's angles; or what is wrong with one of its cells.
    pub(super) fn given(&self, row: &Row) -> Result<Given, String> {
        match *self {
            Self::HalfDifference(columns) => {
                cells(row, HALF_DIFFERENCE, columns, 90.0).map(Given::HalfDifference)
            }
            Self::Directions(columns) => {
                cells(row, DIRECTIONS, columns, 180.0).map(Given::Directions)
            }
        }
    }
}

impl Given {
    /// Of two directions of length 1.
    pub(super) fn of_pair([incoming, outgoing]: [[f64; 3]; 2]) -> Self {
        let Angles {
            theta_h,
            theta_d,
            phi_d,
        } = between(incoming, outgoing);
        Self::HalfDifference([theta_h, theta_d, phi_d])
    }

    /// As Rusinkiewicz angles, in radians.
    pub(super) fn angles(self) -> Angles<f64> {
        match self {
            Self::HalfDifference([theta_h, theta_d, phi_d]) => Angles {
                theta_h,
                theta_d,
                phi_d,
            },
            Self::Directions(angles) => angles_between(angles),
        }
    }

    /// Each of the angles times a number.
    pub(super) fn scaled(self, scale: f64) -> Self {
        match self {
            Self::HalfDifference(angles) => Self::HalfDifference(angles.map(|a| a * scale)),
            Self::Directions(angles) => Self::Directions(angles.map(|a| a * scale)),
        }
    }
}

/// A row's angles, from degrees to radians; thetas are 0 to `largest_theta`.
fn cells<const N: usize>(
    row: &Row,
    names: [&str; N],
    columns: [usize; N],
    largest_theta: f64,
) -> Result<[f64; N], String> {
    let mut angles = [0.0; N];
    for ((angle, name), column) in angles.iter_mut().zip(names).zip(columns) {
        let cell = row.cell(column);
        let shown = escaped(cell);
        let Ok(degrees) = cell.parse::<f64>() else {
            return Err(format!(
                "column {name}: `{shown}` is no number; give an angle in degrees"
            ));
        };
        if !degrees.is_finite() {
            return Err(format!(
                "column {name}: `{shown}` is no angle; give it in degrees"
            ));
        }
        if !name.starts_with("phi") && !(0.0..=largest_theta).contains(&degrees) {
            return Err(format!(
                "column {name}: {shown} is out of range; give 0 to {largest_theta} degrees"
            ));
        }
        *angle = degrees.to_radians();
    }
    Ok(angles)
}

/// Rusinkiewicz angles of two directions by their angles.
fn angles_between([theta_i, phi_i, theta_o, phi_o]: [f64; 4]) -> Angles<f64> {
    let direction = |theta: f64, phi: f64| {
        let (sin, cos) = theta.sin_cos();
        [sin * phi.cos(), sin * phi.sin(), cos]
    };
    between(direction(theta_i, phi_i), direction(theta_o, phi_o))
}

/// Rusinkiewicz angles, radians, of two directions of length 1 from the surface, z along its normal;
/// None where one of them is not above the horizon. phi_d is in \[0, 2 pi).
#[must_use]
pub fn angles_of_pair(incoming: [f64; 3], outgoing: [f64; 3]) -> Option<Angles<f32>> {
    above_horizon(between(incoming, outgoing))
}

/// Rusinkiewicz angles of two directions.
fn between(incoming: [f64; 3], outgoing: [f64; 3]) -> Angles<f64> {
    let sum: [f64; 3] = std::array::from_fn(|i| incoming[i] + outgoing[i]);
    let difference: [f64; 3] = std::array::from_fn(|i| incoming[i] - outgoing[i]);
    let length = |[x, y, z]: [f64; 3]| x.hypot(y).hypot(z);
    let theta_h = sum[0].hypot(sum[1]).atan2(sum[2]);
    let phi_h = sum[1].atan2(sum[0]);
    // The incoming direction, turned so that the half vector is the z axis.
    let [x, y, z] = incoming;
    let (sin, cos) = phi_h.sin_cos();
    let (along, across) = (x * cos + y * sin, y * cos - x * sin);
    Angles {
        theta_h,
        theta_d: length(difference).atan2(length(sum)),
        phi_d: across.atan2(along * theta_h.cos() - z * theta_h.sin()),
    }
}

/// The angles in single precision, phi_d in \[0, 2 pi), if both directions are above the horizon.
fn above_horizon(angles: Angles<f64>) -> Option<Angles<f32>> {
    let at = HalfDifference::from_angles(angles);
    let above = at.cos_theta_i() > AT_HORIZON && at.cos_theta_o() > AT_HORIZON;
    above.then_some(Angles {
        theta_h: angles.theta_h as f32,
        theta_d: angles.theta_d as f32,
        phi_d: angles.phi_d.rem_euclid(std::f64::consts::TAU) as f32,
    })
}
