//! Tables with a row for each wavelength or channel.

use std::collections::HashMap;

use glimpse_materials::untrusted::escaped;

use super::columns::truth;
use super::layout::{ANGLES, INDEX, MONOCHROME, wavelength};
use super::table::{Row, Table, TableError};

/// The columns of the wavelength in nm, and of the channel.
const CHANNEL_COLUMNS: [&str; 2] = ["wavelength", "channel"];

/// Joins the rows of the channels of a reading to one, with a column for each channel. Repeated readings stay apart. Nothing
/// changes in other tables.
///
/// # Errors
/// If a cell is neither a wavelength nor a channel, or a channel is missing or has more readings than another.
pub(super) fn join_channels(table: &mut Table) -> Result<(), TableError> {
    let column = CHANNEL_COLUMNS
        .into_iter()
        .find(|column| table.has(&[column, MONOCHROME]));
    let Some(column) = column else {
        return Ok(());
    };
    let unit = table.factor(
        "wavelength",
        &[("nm", 1.0), ("um", 1e3), ("µm", 1e3), ("μm", 1e3)],
    )?;
    let names = table
        .rows
        .iter()
        .map(|row| channel(table, row, column, unit));
    let names: Vec<Option<String>> = names.collect();
    let is_constant = names.windows(2).all(|pair| pair[0] == pair[1]);
    if column == "channel" && is_constant {
        return Ok(());
    }
    // The channels in the order of their first rows, and the lines of each reading's channels.
    let mut channels: Vec<String> = Vec::new();
    let mut readings: Vec<HashMap<&str, Vec<usize>>> = Vec::new();
    let mut known: HashMap<Vec<String>, usize> = HashMap::new();
    for (index, (row, name)) in table.rows.iter().zip(&names).enumerate() {
        let Some(name) = name else {
            let cell = escaped(table.cell(row, column));
            let message = format!(
                "column {column}: `{cell}` is not a wavelength of 200 to 2600 nm or R, G, B"
            );
            return Err(table.line_error(row.line, &message));
        };
        if !channels.contains(name) {
            channels.push(name.clone());
        }
        let reading = *known.entry(key(table, row)).or_insert(readings.len());
        if reading == readings.len() {
            readings.push(HashMap::new());
        }
        readings[reading].entry(name).or_default().push(index);
    }
    let mut rows = Vec::new();
    for reading in &readings {
        let lines = |channel: &String| reading.get(&channel[..]).map_or(&[][..], Vec::as_slice);
        let most = channels
            .iter()
            .map(|channel| lines(channel).len())
            .max()
            .unwrap_or(0);
        let first = reading.values().flatten().min().copied().unwrap_or(0);
        if let Some(channel) = channels.iter().find(|channel| lines(channel).len() != most) {
            let message = format!(
                "column {column}: at the directions of this row, {channel} has {} rows, but other channels have {most}; give \
                 one row for each channel of each reading",
                lines(channel).len()
            );
            return Err(table.line_error(table.rows[first].line, &message));
        }
        for repetition in 0..most {
            let of_channels = channels
                .iter()
                .map(|channel| &table.rows[lines(channel)[repetition]]);
            rows.push(join(table, &of_channels.collect::<Vec<_>>())?);
        }
    }
    table.rows = rows;
    for name in &mut table.layout.names {
        if *name == column || name == MONOCHROME {
            name.clear();
        }
    }
    table.layout.names.extend(channels);
    Ok(())
}

/// Returns the cells that rows of one reading have in common, in a canonical form.
fn key(table: &Table, row: &Row) -> Vec<String> {
    let columns = ANGLES.into_iter().chain([INDEX]);
    let cells = columns.map(|column| table.cell(row, column));
    let number = |cell: &str| {
        cell.parse::<f64>()
            .map_or(cell.to_owned(), |number| number.to_string())
    };
    cells.map(number).collect()
}

/// Returns the row of a reading, from the rows of its channels. It is left out or saturated if one of them is.
fn join(table: &Table, channels: &[&Row]) -> Result<Row, TableError> {
    let first = channels[0];
    for column in ["noise", "exposure", "quantity"] {
        let cell = table.cell(first, column);
        if let Some(other) = channels.iter().find(|row| table.cell(row, column) != cell) {
            let message = format!(
                "column {column}: it is {}, but {} in another channel of the same reading; give one for all channels",
                escaped(table.cell(other, column)),
                escaped(cell)
            );
            return Err(table.line_error(other.line, &message));
        }
    }
    let is_saturated = |row: &&&Row| truth(table.cell(row, "saturated")) == Some(true);
    let common = channels.iter().find(is_saturated).unwrap_or(&channels[0]);
    let values = channels.iter().map(|row| table.cell(row, MONOCHROME));
    Ok(Row {
        line: first.line,
        cells: common.cells.iter().chain(values).collect(),
        left_out: channels.iter().find_map(|row| row.left_out),
    })
}

/// Returns the name of a row's channel as a column; None if it is invalid. `unit` is that of wavelengths in nm.
fn channel(table: &Table, row: &Row, column: &str, unit: f32) -> Option<String> {
    let cell = table.cell(row, column);
    match &cell.to_lowercase()[..] {
        "r" | "red" if column == "channel" => return Some("r".to_owned()),
        "g" | "green" if column == "channel" => return Some("g".to_owned()),
        "b" | "blue" if column == "channel" => return Some("b".to_owned()),
        _ => {}
    }
    let name = format!("{}nm", unit * cell.parse::<f32>().ok()?);
    wavelength(&name).map(|_| name)
}
