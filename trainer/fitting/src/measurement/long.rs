//! Tables with a row for each wavelength or channel.

use std::collections::BTreeMap;

use glimpse_materials::untrusted::escaped;

use super::columns::{Column, MONOCHROME, Role, Unit, wavelength};
use super::table::{Row, Table, TableError};

/// Joins the rows of the channels of a reading to one, with a column for each channel. Repeated readings stay apart. Nothing
/// changes in other tables.
///
/// # Errors
/// If a cell is neither a wavelength nor a channel, or a channel is missing or has more readings than another.
pub(super) fn join_channels(table: &mut Table) -> Result<(), TableError> {
    let mut columns = table.layout.columns.iter();
    let Some(column) = columns.position(|column| column.role == Some(Role::Channel)) else {
        return Ok(());
    };
    let name = table.layout.columns[column].name.clone();
    let unit = table.unit(&name)?;
    // The channels in the order of their first rows, and the readings of each key with a row for each channel.
    let mut channels: Vec<String> = Vec::new();
    let mut readings: BTreeMap<Vec<&str>, Vec<BTreeMap<usize, &Row>>> = BTreeMap::new();
    for row in &table.rows {
        let cell = &row.cells[column];
        let channel = channel(cell, unit).ok_or_else(|| {
            let cell = escaped(cell);
            let message =
                format!("column {name}: `{cell}` is not a wavelength of 200 to 2600 nm or R, G, B");
            table.line_error(row.line, &message)
        })?;
        let index = channels.iter().position(|other| *other == channel);
        let index = index.unwrap_or_else(|| {
            channels.push(channel);
            channels.len() - 1
        });
        let same = readings.entry(key(table, row)).or_default();
        let first = same.partition_point(|reading| reading.contains_key(&index));
        if first == same.len() {
            same.push(BTreeMap::new());
        }
        same[first].insert(index, row);
    }
    let mut joined = Vec::new();
    for reading in readings.values().flatten() {
        let rows = || reading.values().copied();
        let Some(first) = rows().min_by_key(|row| row.line) else {
            continue;
        };
        if let Some(missing) = (0..channels.len()).find(|index| !reading.contains_key(index)) {
            let message = format!(
                "column {name}: no row for {} belongs to this one; give one for each channel of a reading, with the same \
                 directions, noise, exposure and quantity",
                channels[missing]
            );
            return Err(table.line_error(first.line, &message));
        }
        let values = rows().map(|row| table.cell(row, MONOCHROME));
        joined.push(Row {
            line: first.line,
            cells: first.cells.iter().chain(values).collect(),
            mark: rows().map(|row| row.mark).max().unwrap_or(first.mark),
        });
    }
    joined.sort_by_key(|row| row.line);
    table.rows = joined;
    for column in &mut table.layout.columns {
        if column.role == Some(Role::Channel) || column.name == MONOCHROME {
            column.name.clear();
        }
    }
    let line = table.layout.line;
    let columns = channels.iter().map(|channel| Column::new(line, channel));
    table.layout.columns.extend(columns);
    Ok(())
}

/// Returns the cells that rows of one reading have in common.
fn key<'a>(table: &Table, row: &'a Row) -> Vec<&'a str> {
    use Role::{Channel, Reading, Saturated};
    let cells = table.layout.columns.iter().zip(&row.cells);
    let common = cells.filter(|(column, _)| {
        column.is_unique() && !matches!(column.role, Some(Reading | Channel | Saturated))
    });
    common.map(|(_, cell)| cell).collect()
}

/// Returns the name of a channel as a column; None if it is invalid. `unit` is that of wavelengths.
fn channel(cell: &str, unit: Option<Unit>) -> Option<String> {
    match &cell.to_lowercase()[..] {
        "r" | "red" => Some("r".to_owned()),
        "g" | "green" => Some("g".to_owned()),
        "b" | "blue" => Some("b".to_owned()),
        number => {
            let factor = unit.map_or(1.0, Unit::factor);
            let name = format!("{}nm", factor * number.parse::<f32>().ok()?);
            wavelength(&name).map(|_| name)
        }
    }
}
