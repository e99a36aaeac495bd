//! One row of readings, from a file or an array.

use glimpse_core::geometry::Angles;
use glimpse_materials::untrusted::escaped;
use glimpse_materials::{Viewing, weighted_sums};

use super::angles::AngleColumns;
use super::convention::AngleArgs;
use super::layout::{CHANNELS, INDEX, MONOCHROME};
use super::table::{Row, Table, TableError};

/// The largest number of bands.
const MAX_BANDS: usize = 128;

/// A reading in memory.
#[derive(Clone, Debug, Default)]
pub struct LabReading {
    /// The index of the sample, from 0, if it is known.
    pub sample: Option<usize>,
    /// The incoming and the outgoing direction, if they are known: vectors of length 1 with z along the normal.
    pub directions: Option<[[f64; 3]; 2]>,
    /// The reading's numbers, of red, green and blue, or of bands; None if nothing was read.
    pub values: Option<Vec<f32>>,
    /// True if the sensor was saturated.
    pub saturated: bool,
    /// The standard deviation of the noise, relative to the reading; None if it is not stated.
    pub noise: Option<f32>,
}

/// One row of readings.
#[derive(Default)]
pub(super) struct ReadingRow {
    /// The line of the file, or the index of the reading in an array, from 0.
    pub(super) line: u64,
    pub(super) index: Option<usize>,
    /// Rusinkiewicz angles in radians.
    pub(super) angles: Option<Angles<f64>>,
    /// None if the cells are empty: nothing was read.
    pub(super) values: Option<[f32; 3]>,
    /// The numbers of the bands; empty if there are none, or nothing was read.
    pub(super) bands: Vec<f32>,
    pub(super) saturated: bool,
    /// The standard deviation of the noise, relative to the reading; None if it is not stated.
    pub(super) noise: Option<f32>,
    /// The lowercase name in the column `quantity`; empty if there is none.
    pub(super) quantity: String,
    /// The name in the column `material`; empty if there is none.
    pub(super) material: String,
}

/// Rows, their columns of red, green and blue, and the wavelengths of their bands in nm.
pub(super) type ReadRows = (Vec<ReadingRow>, [&'static str; 3], Vec<f32>);

/// Reads all rows of a table.
pub(super) fn read_rows(table: &Table, args: &AngleArgs) -> Result<ReadRows, TableError> {
    let angles = AngleColumns::find(table)?;
    if angles.is_none() && !table.has(&[INDEX]) {
        return Err(table.file_error(format!(
            "line {} names the columns {}, which do not identify the sample of a reading; add theta_h, theta_d, \
             phi_d, or theta_i, phi_i, theta_o, phi_o (degrees), or index (the sample's number, from 0)",
            table.header_line,
            table.names()
        )));
    }
    let bands = table.bands();
    let kinds = [
        table.has(&CHANNELS),
        table.has(&[MONOCHROME]),
        !bands.is_empty(),
    ];
    let channels = match kinds {
        [_, false, false] | [false, false, _] if kinds != [false; 3] => CHANNELS,
        [false, true, false] => [MONOCHROME; 3],
        _ => {
            let defect = match kinds != [false; 3] {
                true => "which hold two sets of readings; keep",
                false => "none of which holds readings; add",
            };
            return Err(table.file_error(format!(
                "line {} names the columns {}, {defect} r, g, b, or value for a sensor with one channel, or wavelengths \
                 in nm such as 390nm",
                table.header_line,
                table.names()
            )));
        }
    };
    let columns: Vec<&str> = match bands.is_empty() {
        true => channels.to_vec(),
        false => bands.iter().map(|(name, _)| &name[..]).collect(),
    };
    let wavelengths: Vec<f32> = bands.iter().map(|(_, wavelength)| *wavelength).collect();
    if !wavelengths.is_sorted_by(|one, other| one < other) || bands.len() > MAX_BANDS {
        return Err(table.file_error(format!(
            "line {} names {} bands; give at most {MAX_BANDS}, each wavelength once",
            table.header_line,
            bands.len()
        )));
    }
    let weights = Viewing::default().rgb_weights(&wavelengths);
    table.check_value_units()?;
    let angles = match angles {
        Some(columns) => columns.parse_all(table, args)?,
        None => vec![None; table.rows().len()],
    };
    let rows = table.rows().iter().zip(angles);
    let rows = rows
        .map(|(row, angles)| read_row(table, row, &columns, &weights, angles))
        .collect::<Result<_, _>>()?;
    Ok((rows, channels, wavelengths))
}

fn read_row(
    table: &Table,
    row: &Row,
    columns: &[&str],
    weights: &[[f64; 3]],
    angles: Option<Angles<f64>>,
) -> Result<ReadingRow, TableError> {
    let error = |message: String| Err(table.line_error(row.line, &message));
    // Some programs write whole numbers as 3.0.
    let index = table.number::<f64>(row, INDEX)?;
    if let Some(index) = index.filter(|index| !(*index >= 0.0 && index.fract() == 0.0)) {
        return error(format!(
            "column index: {index} is not a sample's number; give 0, 1, 2, ..."
        ));
    }
    if index.is_none() && angles.is_none() {
        return error("the directions and the index are empty; give one of them".to_owned());
    }
    let mut values = vec![None; columns.len()];
    for (value, name) in values.iter_mut().zip(columns) {
        // Programs write a missing value as an empty cell or as NaN.
        *value = table
            .number::<f32>(row, name)?
            .filter(|value| !value.is_nan());
        if value.is_some_and(f32::is_infinite) {
            return error(format!(
                "column {name}: {} is not finite; leave it empty if nothing was read",
                escaped(table.cell(row, name))
            ));
        }
    }
    let empty = values.iter().position(Option::is_none);
    if let Some(channel) = empty.filter(|_| values.iter().any(Option::is_some)) {
        return error(format!(
            "column {}: it is empty but the other channels are not; give all {}, or none if nothing was read",
            columns[channel],
            columns.len()
        ));
    }
    let saturated = match &table.cell(row, "saturated").to_lowercase()[..] {
        "" | "0" | "0.0" | "false" => false,
        "1" | "1.0" | "true" => true,
        other => {
            return error(format!(
                "column saturated: `{}` is neither 0 nor 1; give 1 if the sensor was saturated",
                escaped(other)
            ));
        }
    };
    let noise = table.number::<f32>(row, "noise")?;
    if let Some(noise) = noise.filter(|noise| !(0.0..=10.0).contains(noise)) {
        return error(format!(
            "column noise: {noise} is out of range; give the standard deviation relative to the reading, 0 to 10"
        ));
    }
    let values: Vec<f32> = values.into_iter().flatten().collect();
    Ok(ReadingRow {
        line: row.line,
        index: index.map(|index| index as usize),
        angles,
        values: to_rgb(&values, weights),
        bands: match weights.is_empty() {
            true => Vec::new(),
            false => values,
        },
        saturated,
        noise,
        quantity: table.cell(row, "quantity").to_lowercase(),
        material: table.cell(row, "material").to_owned(),
    })
}

/// Returns the color of the numbers of bands, or the numbers of channels themselves. None if there are none.
pub(super) fn to_rgb(values: &[f32], weights: &[[f64; 3]]) -> Option<[f32; 3]> {
    if weights.is_empty() || values.is_empty() {
        return values.try_into().ok();
    }
    let values = values.iter().map(|value| f64::from(*value));
    Some(weighted_sums(values, weights).map(|sum| sum as f32))
}
