//! Angle columns of a table, and tables of directions.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::Path;

use glimpse_core::geometry::Angles;

use super::angles::above_horizon;
use super::conventions::{AngleArgs, AngleConvention, AngleFormat, AngleSet, StatedAngles};
use super::layout::{ANGLES, INDEX};
use super::table::{Row, Table, TableError};

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
            units[index] = table.angle_unit(name)?;
            let option = args.unit_of(is_polar);
            if units[index].is_some_and(|stated| option.is_some_and(|unit| unit != stated)) {
                return Err(table.file_error(format!(
                    "the unit of column {name} differs from that of the options; remove --unit and --azimuth-unit, or \
                     correct the table"
                )));
            }
        }
        let stated = table.rows.iter().map(|row| read_stated(table, row, set));
        let stated: Vec<Option<StatedAngles>> = stated.collect::<Result<_, _>>()?;
        let format = AngleFormat::new(set, units, stated.iter().flatten());
        let convert = |(row, stated): (&Row, &Option<StatedAngles>)| {
            let Some(stated) = stated else {
                return Ok(None);
            };
            let angles = format.convert(stated, args);
            let angles = angles.map_err(|message| table.line_error(row.line, &message))?;
            Ok(Some((*stated, angles)))
        };
        let rows = table.rows.iter().zip(&stated).map(convert);
        let rows: Vec<_> = rows.collect::<Result<_, TableError>>()?;
        check_unit(&format, args, stated.iter().flatten())
            .map_err(|message| table.file_error(message))?;
        Ok(Some(Self { format, rows }))
    }
}

/// Refuses angles whose unit can only be guessed.
fn check_unit<'a>(
    format: &AngleFormat,
    args: &AngleArgs,
    rows: impl Iterator<Item = &'a StatedAngles> + Clone,
) -> Result<(), String> {
    let [polar, azimuth] = [true, false].map(|is_polar| {
        let largest = format.largest(is_polar, rows.clone());
        (format.assumes_degrees(is_polar, args), largest)
    });
    let is_small = polar.1 <= FRAC_PI_2 && (azimuth.1 <= TAU || !azimuth.0);
    if polar.0 && is_small && polar.1 + azimuth.1 > 0.0 {
        return Err(format!(
            "its angles are at most {:.4} (polar) and {:.4} (azimuth), small enough to be radians; give --unit radians or \
             --unit degrees",
            polar.1, azimuth.1
        ));
    }
    if azimuth.0 && azimuth.1 > 0.0 && azimuth.1 <= TAU {
        return Err(format!(
            "its azimuths are at most {:.4}, small enough to be radians, unlike its polar angles; give --azimuth-unit radians \
             or --azimuth-unit degrees",
            azimuth.1
        ));
    }
    Ok(())
}

/// Finds the set of a table's angle columns; None if it has none of them.
fn find_set(table: &Table) -> Result<Option<AngleSet>, TableError> {
    let present: Vec<&str> = ANGLES
        .into_iter()
        .filter(|name| table.has(&[name]))
        .collect();
    let is_complete = |set: &AngleSet| {
        let names = set.names();
        names.len() == present.len() && table.has(names)
    };
    let found = AngleSet::ALL.into_iter().find(is_complete);
    if found.is_some() || present.is_empty() {
        return Ok(found);
    }
    let sets = AngleSet::ALL.map(|set| set.names().join(", "));
    Err(table.file_error(format!(
        "line {} names the angles {}; name all columns of one set, and of no other: {}",
        table.layout.line,
        present.join(", "),
        sets.join("; ")
    )))
}

/// Reads the angles of a row; None if all of them are empty.
fn read_stated(
    table: &Table,
    row: &Row,
    set: AngleSet,
) -> Result<Option<StatedAngles>, TableError> {
    if set
        .names()
        .iter()
        .all(|name| table.cell(row, name).is_empty())
    {
        return Ok(None);
    }
    let mut stated = [0.0; 4];
    for (angle, name) in stated.iter_mut().zip(set.names()) {
        let number = table.number::<f64>(row, name, "give an angle")?;
        *angle = number.filter(|angle| angle.is_finite()).ok_or_else(|| {
            let message = format!("column {name}: it is empty or not finite; give an angle");
            table.line_error(row.line, &message)
        })?;
    }
    Ok(Some(stated))
}
