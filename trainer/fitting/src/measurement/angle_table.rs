//! Angle columns of a table, and tables of directions.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::Path;

use glimpse_core::geometry::Angles;

use super::angles::above_horizon;
use super::columns::{INDEX, Role, Unit};
use super::conventions::{AngleArgs, AngleConvention, AngleFormat, AngleSet, StatedAngles};
use super::table::{Table, TableError};

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
        let table = Table::read(path, &[])?;
        let Some(angles) = TableAngles::find(&table, args)? else {
            return Err(table.columns_error(&format!(
                "none of which is an angle; name {}, or {}",
                AngleSet::Directions.names().join(", "),
                AngleSet::HalfDifference.names().join(", ")
            )));
        };
        let mut columns = angles.format.set.names().to_vec();
        columns.extend(table.has(&[INDEX]).then_some(INDEX));
        let mut rows = Vec::new();
        for (row, angles) in table.rows.iter().zip(angles.rows) {
            let (_, angles) = angles.ok_or_else(|| {
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

/// The angles of a table.
pub(super) struct TableAngles {
    pub(super) format: AngleFormat,
    /// The angles of each row as stated, and the Rusinkiewicz angles in radians; None if all angles are empty.
    pub(super) rows: Vec<Option<(StatedAngles, Angles<f64>)>>,
}

impl TableAngles {
    /// Reads the angle columns of a table; None if it has none of them.
    ///
    /// # Errors
    /// If columns are missing, an angle is missing or out of range, or a unit is contradictory or can only be guessed.
    pub(super) fn find(table: &Table, args: &AngleArgs) -> Result<Option<Self>, TableError> {
        let Some(set) = find_set(table)? else {
            return Ok(None);
        };
        if set == AngleSet::HalfDifference && args.has(AngleConvention::FromMirror) {
            let message =
                "--convention from-mirror has no effect on theta_h, theta_d, phi_d; remove it";
            return Err(table.file_error(message.to_owned()));
        }
        let mut units = [None; 4];
        for (index, name, is_polar) in set.columns() {
            if let Some(Unit::Angle(unit)) = table.unit(name)? {
                units[index] = Some(unit);
            }
            let option = args.unit_of(is_polar);
            if units[index].is_some_and(|stated| option.is_some_and(|unit| unit != stated)) {
                return Err(table.file_error(format!(
                    "the unit of column {name} differs from that of the options; remove --unit and --azimuth-unit, or \
                     correct the table"
                )));
            }
        }
        let format = AngleFormat { set, stated: units };
        let mut rows = Vec::new();
        for row in &table.rows {
            let is_finite = |angle: &f64| angle.is_finite();
            let angles = table.numbers(row, set.names(), is_finite, "give an angle")?;
            let mut stated = [0.0; 4];
            stated[..angles.len()].copy_from_slice(&angles);
            let converted = format.convert(&stated, args);
            let converted = converted.map_err(|message| table.line_error(row.line, &message))?;
            rows.push((!angles.is_empty()).then_some((stated, converted)));
        }
        let [polar, azimuth] = [true, false].map(|is_polar| {
            let columns = format.set.columns().filter(|(index, _, other)| {
                let unit = format.stated[*index].or(args.unit_of(is_polar));
                unit.is_none() && *other == is_polar
            });
            let stated = rows.iter().flatten();
            let angles = columns.flat_map(|(index, ..)| {
                let column = stated.clone().map(move |(stated, _)| stated[index]);
                column.map(f64::abs)
            });
            angles.fold(0.0, f64::max)
        });
        let (kind, largest, option) = if polar > 0.0 && polar <= FRAC_PI_2 && azimuth <= TAU {
            ("angles", polar.max(azimuth), "--unit")
        } else if azimuth.fract() != 0.0 && azimuth <= TAU {
            ("azimuths", azimuth, "--azimuth-unit")
        } else {
            return Ok(Some(Self { format, rows }));
        };
        Err(table.file_error(format!(
            "its {kind} are at most {largest:.4}, small enough to be radians; give {option} radians or {option} degrees"
        )))
    }
}

/// Finds the set of a table's angle columns; None if it has none of them.
fn find_set(table: &Table) -> Result<Option<AngleSet>, TableError> {
    let columns = table.layout.columns.iter();
    let angles = columns.filter(|column| column.role == Some(Role::Direction));
    let count = angles.count();
    let is_complete = |set: &AngleSet| set.names().len() == count && table.has(set.names());
    let found = AngleSet::ALL.into_iter().find(is_complete);
    if found.is_some() || count == 0 {
        return Ok(found);
    }
    let sets = AngleSet::ALL.map(|set| set.names().join(", "));
    Err(table.columns_error(&format!(
        "whose angles are not those of one set; name all columns of one set, and of no other: {}",
        sets.join("; ")
    )))
}
