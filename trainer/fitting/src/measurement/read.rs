//! Reading of rows from a file.

use std::path::Path;

use clap::Args;
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_materials::untrusted::escaped;

use super::angle_table::TableAngles;
use super::columns::{TableSummary, truth};
use super::conventions::{AngleArgs, StatedAngles};
use super::layout::{CHANNELS, INDEX, MONOCHROME};
use super::long::join_channels;
use super::rows::{LabReading, ReadingRows};
use super::table::{LeftOutRow, Row, Table, TableError};
use crate::choice::Choice;

/// The largest number of bands.
const MAX_BANDS: usize = 128;

/// Options of a table of readings.
#[derive(Args, Clone, Debug, Default, PartialEq)]
pub struct TableArgs {
    /// Unit and conventions of the angles.
    #[command(flatten)]
    pub angles: AngleArgs,
    /// Columns to ignore, separated by commas, because the readings do not depend on them
    #[arg(long, value_delimiter = ',', value_name = "NAME,...")]
    pub ignore: Vec<String>,
}

impl ReadingRows {
    /// Reads a file with the readings of one material.
    ///
    /// # Errors
    /// If the file cannot be read, the meaning of a column is unknown, or a cell is not valid.
    pub fn read(path: &Path, args: &TableArgs) -> Result<Self, TableError> {
        Self::from_table(path, Table::read(path, &args.ignore)?, args)
    }

    /// Reads a file with a material for each text of a column, in the order of the file.
    ///
    /// # Errors
    /// As [`read`](Self::read), or if the file lacks the column.
    pub fn read_by(path: &Path, args: &TableArgs, column: &str) -> Result<Vec<Self>, TableError> {
        let table = Table::read(path, &args.ignore)?;
        let missing = table.columns_error(&format!(
            "not {}; correct --by, or remove it",
            escaped(column)
        ));
        let tables = table.split(column).ok_or(missing)?.into_iter();
        let rows = tables.map(|(name, table)| {
            let mut rows = Self::from_table(path, table, args)?;
            // The name of a file.
            rows.name = name.replace(|c: char| c.is_control() || "/\\:*?\"<>|".contains(c), "_");
            if rows.name.trim_matches(['.', ' ']).is_empty() {
                rows.name = "unnamed".to_owned();
            }
            Ok(rows)
        });
        rows.collect()
    }

    fn from_table(path: &Path, mut table: Table, args: &TableArgs) -> Result<Self, TableError> {
        let mut summary = TableSummary::new(&mut table)?;
        let first = table.rows.first().map_or(table.layout.line, |row| row.line);
        join_channels(&mut table)?;
        let reasons = table.rows.iter().filter_map(|row| row.left_out);
        reasons.for_each(|reason| summary.leave_out(reason));
        table.rows.retain(|row| row.left_out.is_none());
        let angles = TableAngles::find(&table, &args.angles)?;
        if angles.is_none() && !table.has(&[INDEX]) {
            return Err(table.columns_error(
                "which do not identify the sample of a reading; add theta_h, theta_d, phi_d, or theta_i, phi_i, \
                 theta_o, phi_o (degrees), or index (the sample's number, from 0)",
            ));
        }
        let bands = table.bands();
        let wavelengths: Vec<f32> = bands.iter().map(|(_, wavelength)| *wavelength).collect();
        let mut all = Self::new(path.into(), false, wavelengths);
        all.is_monochrome = table.has(&[MONOCHROME]);
        let sets = [table.has(&CHANNELS), all.is_monochrome, !bands.is_empty()];
        let count = sets.into_iter().filter(|set| *set).count();
        if count != 1 {
            let defect = if count == 0 {
                "none of which holds readings; add"
            } else {
                "which hold two sets of readings; keep"
            };
            return Err(table.columns_error(&format!(
                "{defect} r, g, b, or value for a sensor with one channel, or wavelengths in nm such as 390nm"
            )));
        }
        if !all.wavelengths.is_sorted_by(|one, other| one < other) || bands.len() > MAX_BANDS {
            return Err(table.file_error(format!(
                "line {} names {} bands; give at most {MAX_BANDS}, each wavelength once",
                table.layout.line,
                bands.len()
            )));
        }
        let columns: Vec<&str> = if bands.is_empty() {
            all.channels().to_vec()
        } else {
            bands.iter().map(|(name, _)| &name[..]).collect()
        };
        all.quantities = table.stated_quantities()?;
        all.angle_args = args.angles.clone();
        let mut angles_of_rows = vec![None; table.rows.len()];
        if let Some(TableAngles { format, rows }) = angles {
            for (index, name, is_polar) in format.set.columns() {
                let mut columns = table.layout.names.iter().zip(&mut summary.columns);
                if let Some((_, column)) = columns.find(|(other, _)| *other == name) {
                    column.unit = Some(format.unit(index, is_polar, &args.angles).name());
                }
            }
            all.angle_format = Some(format);
            angles_of_rows = rows;
        }
        if table.rows.is_empty() && summary.left_out.is_empty() {
            return Err(table.file_error(format!(
                "it has no rows below line {}; add the readings",
                table.layout.line
            )));
        }
        let units = Units::of(&table)?;
        for (row, angles) in table.rows.iter().zip(angles_of_rows) {
            if angles.is_some_and(|(_, angles)| is_sensor_below(angles)) {
                summary.leave_out(LeftOutRow::SensorBelowHorizon);
                continue;
            }
            let mut quantity = table.cell(row, "quantity").to_lowercase();
            // ASTM's name, which the options accept as well.
            if quantity == "brdf-cos" {
                quantity = "brdf-cos-o".to_owned();
            }
            let is_known = |(_, _, known): &(usize, String, String)| *known == quantity;
            if !quantity.is_empty() && !all.quantities.iter().any(is_known) {
                all.quantities
                    .push((row.line, "quantity".to_owned(), quantity));
            }
            all.readings
                .push(read_row(&table, row, &columns, angles, &units)?);
        }
        if let ([], [left_out, ..]) = (&all.readings[..], &summary.left_out[..]) {
            let message = format!(
                "as all {} rows, is left out ({}); give readings of reflection, or --convention exchanged,travel if light and \
                 sensor are exchanged",
                left_out.rows,
                left_out.reason.name()
            );
            return Err(table.line_error(first, &message));
        }
        all.summary = summary;
        Ok(all.without_empty_rows())
    }
}

/// Returns true if the light is above the horizon, and the sensor below it.
fn is_sensor_below(angles: Angles<f64>) -> bool {
    let at = HalfDifference::from_angles(angles);
    at.cos_theta_i() > 1e-6 && at.cos_theta_o() < -1e-6
}

/// The factors of units.
struct Units {
    /// Of the standard deviation relative to a reading.
    noise: f32,
    /// Of s.
    exposure: f32,
}

impl Units {
    fn of(table: &Table) -> Result<Self, TableError> {
        let exposure = [
            ("s", 1.0),
            ("ms", 1e-3),
            ("us", 1e-6),
            ("µs", 1e-6),
            ("μs", 1e-6),
        ];
        Ok(Self {
            noise: table.factor("noise", &[("%", 0.01), ("1", 1.0), ("-", 1.0)])?,
            exposure: table.factor("exposure", &exposure)?,
        })
    }
}

/// Reads the cells of a row. `columns` are those of the numbers, which are empty if nothing was read.
fn read_row(
    table: &Table,
    row: &Row,
    columns: &[&str],
    angles: Option<(StatedAngles, Angles<f64>)>,
    units: &Units,
) -> Result<LabReading, TableError> {
    let error = |message: String| Err(table.line_error(row.line, &message));
    // Some programs write whole numbers as 3.0.
    let index = table.number::<f64>(row, INDEX, "give the sample's number, 0, 1, 2, ...")?;
    if let Some(index) = index.filter(|index| !(*index >= 0.0 && index.fract() == 0.0)) {
        return error(format!(
            "column index: {index} is not a sample's number; give 0, 1, 2, ..."
        ));
    }
    if index.is_none() && angles.is_none() {
        return error("the directions and the index are empty; give one of them".to_owned());
    }
    let mut numbers = Vec::with_capacity(columns.len());
    let mut empty = None;
    for name in columns {
        let remedy = "correct it";
        // Programs write a missing value as an empty cell or as NaN.
        match table.number::<f32>(row, name, remedy)? {
            Some(number) if number.is_infinite() => {
                let cell = escaped(table.cell(row, name));
                return error(format!("column {name}: {cell} is not finite; {remedy}"));
            }
            Some(number) if !number.is_nan() => numbers.push(number),
            _ => empty = empty.or(Some(name)),
        }
    }
    if let Some(name) = empty.filter(|_| !numbers.is_empty()) {
        return error(format!(
            "column {name}: it is empty but the other channels are not; give all {}, or none if nothing was read",
            columns.len()
        ));
    }
    let cell = table.cell(row, "saturated");
    let saturated = truth(cell).or(cell.is_empty().then_some(false));
    let Some(saturated) = saturated else {
        return error(format!(
            "column saturated: `{}` is neither 0 nor 1; give 1 if the sensor was saturated",
            escaped(cell)
        ));
    };
    let remedy = "give the standard deviation relative to the reading, 0 to 10";
    let noise = table.number::<f32>(row, "noise", remedy)?;
    let noise = noise.map(|noise| units.noise * noise);
    if let Some(noise) = noise.filter(|noise| !(0.0..=10.0).contains(noise)) {
        return error(format!("column noise: {noise} is out of range; {remedy}"));
    }
    let remedy = "give a time above 0";
    let exposure = table.number::<f32>(row, "exposure", remedy)?;
    let exposure = exposure.map(|exposure| units.exposure * exposure);
    if let Some(exposure) = exposure.filter(|exposure| !(*exposure > 0.0 && exposure.is_finite())) {
        return error(format!(
            "column exposure: {exposure} s is out of range; {remedy}"
        ));
    }
    Ok(LabReading {
        line: row.line,
        index: index.map(|index| index as usize),
        angles: angles.map(|(_, angles)| angles),
        stated_angles: angles.map(|(stated, _)| stated),
        numbers,
        saturated,
        noise,
        exposure,
    })
}
