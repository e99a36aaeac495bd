//! Reading of rows from a file.

use std::path::Path;

use clap::{Args, ValueEnum};
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_materials::untrusted::escaped;
use glimpse_materials::{Observer, Viewing};

use super::angle_table::TableAngles;
use super::columns::{
    CHANNELS, CIELAB, INDEX, INSTRUMENT, MONOCHROME, Role, Unit, simplified, wavelength,
};
use super::conventions::{AngleArgs, StatedAngles};
use super::instrument::Instrument;
use super::long::join_channels;
use super::optics::Optics;
use super::quantity::Multiple;
use super::rows::{LabReading, ReadingRows};
use super::table::{LeftOutRow, Mark, Row, Table, TableError};
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

    /// Reads a file with a material for each text of a column, in alphabetical order.
    ///
    /// # Errors
    /// As [`read`](Self::read), or if the file lacks the column.
    pub fn read_by(path: &Path, args: &TableArgs, column: &str) -> Result<Vec<Self>, TableError> {
        let tables = Table::read(path, &args.ignore)?.split(column)?.into_iter();
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
        let mut summary = table.account()?;
        join_channels(&mut table)?;
        table.rows.retain(|row| {
            if let Mark::LeftOut(reason) = row.mark {
                *summary.left_out.entry(reason).or_default() += 1;
            }
            row.mark < Mark::LeftOut(LeftOutRow::Invalid)
        });
        let angles = TableAngles::find(&table, &args.angles)?;
        if angles.is_none() && !table.has(&[INDEX]) && !table.has(&[INSTRUMENT]) {
            return Err(table.columns_error(
                "which do not identify the sample of a reading; add theta_h, theta_d, phi_d, or theta_i, phi_i, \
                 theta_o, phi_o (degrees), or index (the sample's number, from 0), or instrument",
            ));
        }
        let names = table.layout.columns.iter().map(|column| &column.name[..]);
        let bands = names.filter_map(|name| Some((name, wavelength(name)?)));
        let mut bands: Vec<(&str, f32)> = bands.collect();
        bands.sort_by(|(_, one), (_, other)| one.total_cmp(other));
        let wavelengths = bands.iter().map(|band| band.1).collect();
        let mut all = Self::new(path.into(), false, wavelengths);
        let has_value = table.has(&[MONOCHROME]);
        let colors = [table.has(&CHANNELS), table.has(&CIELAB), !bands.is_empty()];
        let mut count = colors.into_iter().filter(|set| *set).count();
        // Instruments with and without colors.
        let is_mixed = has_value && count == 1 && table.has(&[INSTRUMENT]);
        count += usize::from(has_value && !is_mixed);
        all.is_monochrome = has_value && !is_mixed;
        // That of colorimeters.
        let observer = Observer::Cie1964;
        all.cielab = table.has(&CIELAB).then(|| Viewing {
            observer,
            ..Viewing::default()
        });
        let is_ascending = all.wavelengths.is_sorted_by(|one, other| one < other);
        if count != 1 || !is_ascending || bands.len() > MAX_BANDS {
            return Err(table.columns_error(&format!(
                "with {count} sets of readings and {} bands; give one set: r, g, b, or L*, a*, b*, or value for a sensor with one \
                 channel, or at most {MAX_BANDS} different wavelengths in nm such as 390nm",
                bands.len()
            )));
        }
        let columns = match &bands[..] {
            [] => all.channels().to_vec(),
            bands => bands.iter().map(|band| band.0).collect(),
        };
        all.quantities = table.stated_quantities()?;
        all.angle_args = args.angles.clone();
        let mut angles_of_rows = vec![None; table.rows.len()];
        if let Some(TableAngles { format, rows }) = angles {
            for (index, name, is_polar) in format.set.columns() {
                let column = table.layout.index(name);
                if let Some(column) = column.and_then(|column| summary.columns.get_mut(column)) {
                    column.unit = Some(format.unit(index, is_polar, &args.angles).name());
                }
            }
            all.angle_format = Some(format);
            angles_of_rows = rows;
        }
        let factor = |name| Ok(table.unit(name)?.map_or(1.0, Unit::factor));
        let factors = [factor("noise")?, factor("exposure")?];
        for (row, angles) in table.rows.iter().zip(angles_of_rows) {
            if angles.is_some_and(|(_, angles)| is_sensor_below(angles)) {
                let reason = LeftOutRow::SensorBelowHorizon;
                *summary.left_out.entry(reason).or_default() += 1;
                continue;
            }
            // Other names and capitals are those of the options.
            let cell = table.cell(row, "quantity").to_lowercase();
            let quantity = Multiple::from_str(&cell, true).map_or(cell, |multiple| multiple.name());
            let is_known = |(_, _, known): &(usize, String, String)| *known == quantity;
            if !quantity.is_empty() && !all.quantities.iter().any(is_known) {
                let column = "quantity".to_owned();
                all.quantities.push((row.line, column, quantity));
            }
            let reading = read_row(&table, row, (&columns, is_mixed), angles, factors)?;
            all.readings.push(reading);
        }
        if table.rows.is_empty() && summary.left_out.is_empty() {
            return Err(table.columns_error("but no rows are below it; add the readings"));
        }
        if let Some((reason, count)) = summary.left_out.first_key_value()
            && all.readings.is_empty()
        {
            return Err(table.file_error(format!(
                "all rows are left out ({count}: {}); give readings of reflection, or --convention exchanged,travel if light and \
                 sensor are exchanged",
                reason.name()
            )));
        }
        all.summary = summary;
        all = all.without_empty_rows();
        all.is_monochrome = all.readings.iter().all(|reading| reading.is_gray);
        Ok(all)
    }
}

impl Table {
    /// Returns the line, the column and the quantity of each statement in the names and units of readings.
    ///
    /// # Errors
    /// If a unit is unknown, or differs from that of another column.
    fn stated_quantities(&self) -> Result<Vec<(usize, String, String)>, TableError> {
        let mut stated = Vec::new();
        let mut first = None;
        let columns = self.layout.columns.iter();
        for column in columns.filter(|column| column.role == Some(Role::Reading)) {
            let mut state = |line: usize, quantity: &str| {
                stated.push((line, column.label.clone(), quantity.to_owned()));
            };
            let quantity = match &simplified(&column.label)[..] {
                "counts" => Some("counts"),
                "reflectancefactor" | "radiancefactor" => Some("reflectance-factor"),
                _ if column.name == CIELAB[0] => Some("reflectance-factor"),
                label => (label.starts_with("brdf") || label == "bsdf").then_some("brdf"),
            };
            if let Some(quantity) = quantity {
                state(self.layout.line, quantity);
            }
            for (line, text) in &column.units {
                let unit = Unit::find(Role::Reading, text);
                if unit == Some(Unit::Factor(1.0)) {
                    continue;
                }
                if unit.is_none() || *first.get_or_insert(unit) != unit {
                    return Err(self.unit_error(*line, column, text));
                }
                if let Some(Unit::Quantity(quantity)) = unit {
                    state(*line, quantity);
                }
            }
        }
        Ok(stated)
    }
}

/// Returns true if the light is above the horizon, and the sensor below it.
fn is_sensor_below(angles: Angles<f64>) -> bool {
    let at = HalfDifference::from_angles(angles);
    at.cos_theta_i() > 1e-6 && at.cos_theta_o() < -1e-6
}

/// Reads the cells of a row. `columns` are those of the numbers, which are empty if nothing was read; in a mixed table,
/// `value` may have the number instead. The factors are those of the units of noise and exposure.
fn read_row(
    table: &Table,
    row: &Row,
    (columns, is_mixed): (&[&str], bool),
    angles: Option<(StatedAngles, Angles<f64>)>,
    [noise_unit, exposure_unit]: [f32; 2],
) -> Result<LabReading, TableError> {
    // Some programs write whole numbers as 3.0.
    let is_index = |index: &f64| *index >= 0.0 && index.fract() == 0.0;
    let remedy = "give the sample's number, 0, 1, 2, ...";
    let index = table.number(row, INDEX, is_index, remedy)?;
    let is_finite = |number: &f64| (*number as f32).is_finite();
    let mut numbers = table.numbers(row, columns, is_finite, "correct it")?;
    let optics = read_optics(table, row)?;
    let value = table.number(row, MONOCHROME, is_finite, "correct it")?;
    let gray = value.filter(|_| is_mixed);
    if let Some(value) = gray {
        if !numbers.is_empty() || table.has(&CIELAB) && optics.gloss_unit().is_none() {
            let message = "column value: only a row without colors has it; remove it, or the row's other numbers";
            return Err(table.line_error(row.line, message));
        }
        numbers = vec![value; columns.len()];
    }
    let is_noise = |noise: &f64| (0.0..=10.0).contains(&(noise_unit * *noise as f32));
    let remedy = "give the standard deviation relative to the reading, 0 to 10";
    let noise = table.number(row, "noise", is_noise, remedy)?;
    let times = f32::MIN_POSITIVE..=f32::MAX;
    let is_time = |time: &f64| times.contains(&(exposure_unit * *time as f32));
    let exposure = table.number(row, "exposure", is_time, "give a time above 0")?;
    Ok(LabReading {
        line: row.line,
        index: index.map(|index| index as usize),
        angles: angles.map(|(_, angles)| angles),
        stated_angles: angles.map(|(stated, _)| stated),
        numbers: numbers.into_iter().map(|number| number as f32).collect(),
        saturated: row.mark == Mark::Saturated,
        noise: noise.map(|noise| noise_unit * noise as f32),
        exposure: exposure.map(|exposure| exposure_unit * exposure as f32),
        is_gray: gray.is_some() || columns.contains(&MONOCHROME),
        optics,
        place: Some(table.cell(row, "place").to_owned()).filter(|place| !place.is_empty()),
    })
}

/// Reads the instrument of a row.
fn read_optics(table: &Table, row: &Row) -> Result<Optics, TableError> {
    let error = |message: &str| Err(table.line_error(row.line, message));
    let cell = table.cell(row, INSTRUMENT);
    let instrument = Instrument::parse(cell);
    if instrument.is_none() && !cell.is_empty() {
        let names = Instrument::value_variants().iter().map(Choice::name);
        return error(&format!(
            "column {INSTRUMENT}: `{}` is unknown; give {}, or nothing for a goniometer",
            escaped(cell),
            names.collect::<Vec<_>>().join(", ")
        ));
    }
    let angle = |name| {
        table.unit(name)?;
        let remedy = "give the full angle of a cone, 0 to 60 degrees";
        table.number(row, name, |angle| (0.0..=60.0).contains(angle), remedy)
    };
    let spread = [angle("spread_i")?, angle("spread_o")?].map(Option::unwrap_or_default);
    let optics = Optics { instrument, spread };
    if optics.fixed().is_some() && spread != [0.0; 2] {
        return error("column spread_i or spread_o: the instrument determines it; leave it empty");
    }
    Ok(optics)
}
