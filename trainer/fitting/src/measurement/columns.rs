//! The account of a table's columns: each is read, known to be irrelevant, or refused.

use glimpse_materials::untrusted::escaped;
use serde::{Deserialize, Serialize};

use super::layout::{MONOCHROME, wavelength};
use super::names::{KnownName, Role, is_same};
use super::table::{LeftOutRow, Table, TableError};
use crate::choice::Choice;

/// Starts of the names of columns that `trainer fit` writes in addition to readings.
const RESULTS: [&str; 3] = ["fitted_", "deviation_", "expected_"];
/// The other names of such columns.
const OTHER_RESULTS: [&str; 7] = ["times", "spread", "z", "status", "l*", "a*", "b*"];

/// The meaning that a table was given.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct TableSummary {
    /// The columns, in their order.
    pub columns: Vec<ColumnSummary>,
    /// The rows that were left out, by their reasons.
    pub left_out: Vec<LeftOutRows>,
}

/// Rows that were left out.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct LeftOutRows {
    /// The reason.
    pub reason: LeftOutRow,
    /// Their number.
    pub rows: usize,
}

/// The meaning of a column.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ColumnSummary {
    /// The name in lowercase.
    pub name: String,
    /// The role.
    pub role: Role,
    /// The unit, as far as the file states it.
    pub unit: Option<String>,
}

/// Returns the meaning of yes and no, in words or numbers.
pub(super) fn truth(cell: &str) -> Option<bool> {
    match &cell.to_lowercase()[..] {
        "1" | "1.0" | "true" | "yes" | "y" => Some(true),
        "0" | "0.0" | "false" | "no" | "n" => Some(false),
        _ => None,
    }
}

/// Returns true for the cell of a row to keep, false for that of a row to leave out, and None for an unknown meaning: the
/// number 1 of a flag may mean either.
fn is_kept(role: Role, label: &str, cell: &str) -> Option<bool> {
    match (role, &cell.to_lowercase()[..]) {
        (Role::Valid, "ok" | "good" | "valid" | "pass" | "passed") => Some(true),
        (Role::Valid, "bad" | "error" | "invalid" | "fail" | "failed" | "rejected") => Some(false),
        (Role::Valid, other) if label.contains("valid") => truth(other),
        (Role::Scatter, "brdf" | "reflection" | "reflectance" | "r") => Some(true),
        (Role::Scatter, "btdf" | "transmission" | "transmittance" | "t") => Some(false),
        _ => None,
    }
}

impl TableSummary {
    /// Finds the roles of all columns, and marks the rows that these leave out.
    ///
    /// # Errors
    /// If the meaning of a column or a mark is unknown, or not supported.
    pub(super) fn new(table: &mut Table) -> Result<Self, TableError> {
        let layout = &table.layout;
        let is_result = |label: &str| RESULTS.iter().any(|start| label.starts_with(start));
        let is_ours = layout.labels.iter().any(|label| is_result(label));
        let mut summary = Self::default();
        let mut unknown = Vec::new();
        for (index, (label, name)) in layout.labels.iter().zip(&layout.names).enumerate() {
            let cell = |row: usize| table.rows.get(row).map_or("", |row| &row.cells[index]);
            let other = (1..table.rows.len()).find(|row| cell(*row) != cell(0));
            let is_constant = other.is_none();
            let name_of = escaped(label);
            let role = match KnownName::find(label).map(|known| known.role) {
                _ if table.is_ignored(index) => Role::Ignored,
                _ if is_ours && (is_result(label) || OTHER_RESULTS.contains(&&label[..])) => {
                    Role::Output
                }
                _ if wavelength(name).is_some() => Role::Reading,
                Some(role @ (Role::Instrument | Role::Color)) => {
                    return Err(table.columns_error(&format!(
                        "and {name_of} ({}) is not supported yet; give linear r, g, b, value or bands (not HSV or CIELAB) of one instrument, and \
                         remove the column or give --ignore \"{name_of}\"",
                        role.name()
                    )));
                }
                Some(Role::Sample) if !is_constant => {
                    return Err(table.columns_error(&format!(
                        "and {name_of} names several samples ({}, and in line {} {}); give one file per sample, or --by \"{name_of}\" for \
                         a fit of each, or --ignore \"{name_of}\" if they are one",
                        escaped(cell(0)),
                        table.rows[other.unwrap_or(0)].line,
                        escaped(cell(other.unwrap_or(0)))
                    )));
                }
                Some(Role::Channel)
                    if table.has(&[MONOCHROME]) && !(is_constant && name == "channel") =>
                {
                    Role::Channel
                }
                Some(Role::Channel) | None if is_constant => Role::Constant,
                Some(role @ (Role::Valid | Role::Scatter))
                    if is_constant && is_kept(role, label, cell(0)).is_none() =>
                {
                    Role::Constant
                }
                None if label.is_empty() => Role::Note,
                Some(Role::Channel) | None => {
                    unknown.push(&label[..]);
                    continue;
                }
                Some(role) => role,
            };
            let mut units = layout.units.iter();
            let unit = units.find(|unit| unit.column == *name);
            summary.columns.push(ColumnSummary {
                name: name_of,
                role,
                unit: unit.map(|unit| escaped(&unit.text)),
            });
        }
        if !unknown.is_empty() {
            return Err(table.columns_error(&format!(
                "of which {} are not known, and differ between rows; name directions theta_i, phi_i, theta_o, phi_o, readings r, \
                 g, b, value or wavelengths, relative deviations noise, or give --ignore \"{}\" if the readings do not depend \
                 on them, or --by NAME for a fit for each text of one",
                escaped(&unknown.join(", ")),
                escaped(&unknown.join(","))
            )));
        }
        summary.mark_left_out(table)?;
        Ok(summary)
    }

    fn mark_left_out(&self, table: &mut Table) -> Result<(), TableError> {
        for (role, reason) in [
            (Role::Valid, LeftOutRow::Invalid),
            (Role::Scatter, LeftOutRow::Btdf),
        ] {
            for column in self.of(role) {
                for index in 0..table.rows.len() {
                    let row = &table.rows[index];
                    let cell = table.cell(row, &column.name);
                    let Some(is_kept) = is_kept(role, &column.name, cell) else {
                        let message = format!(
                            "column {}: the meaning of `{}` is unknown; write ok or bad, or 1 or 0 in a column valid or saturated, \
                             or BRDF or BTDF in a column scatter",
                            column.name,
                            escaped(cell)
                        );
                        return Err(table.line_error(row.line, &message));
                    };
                    if !is_kept {
                        table.rows[index].left_out = Some(reason);
                    }
                }
            }
        }
        Ok(())
    }

    /// Counts a row that is left out.
    pub(super) fn leave_out(&mut self, reason: LeftOutRow) {
        match self.left_out.iter_mut().find(|rows| rows.reason == reason) {
            Some(rows) => rows.rows += 1,
            None => self.left_out.push(LeftOutRows { reason, rows: 1 }),
        }
    }

    /// Returns true if a column is ignored by this name.
    #[must_use]
    pub fn ignores(&self, name: &str) -> bool {
        self.of(Role::Ignored)
            .any(|column| is_same(&column.name, name))
    }

    /// Returns the columns of a role.
    pub fn of(&self, role: Role) -> impl Iterator<Item = &ColumnSummary> {
        self.columns
            .iter()
            .filter(move |column| column.role == role)
    }
}
