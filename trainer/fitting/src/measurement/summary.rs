//! The account of a table's columns: each is read, known to be irrelevant, or refused.

use std::collections::BTreeMap;

use glimpse_materials::untrusted::escaped;
use serde::{Deserialize, Serialize};

use super::columns::{Column, MONOCHROME, Role, is_same};
use super::table::{LeftOutRow, Mark, Table, TableError};

/// Starts of the names of columns that `trainer fit` writes in addition to readings.
const RESULTS: [&str; 3] = ["fitted_", "deviation_", "expected_"];
/// The other names of such columns.
const OTHER_RESULTS: [&str; 7] = ["times", "spread", "z", "status", "l*", "a*", "b*"];

/// The meaning that a table was given.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct TableSummary {
    /// The columns, in their order.
    pub columns: Vec<ColumnSummary>,
    /// The numbers of rows that were left out, by their reasons.
    pub left_out: BTreeMap<LeftOutRow, usize>,
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

/// Returns the mark of a row by a cell; None if its meaning is unknown: the number 1 of a flag may mean either.
fn mark(column: &Column, cell: &str) -> Option<Mark> {
    let invalid = Mark::LeftOut(LeftOutRow::Invalid);
    let is_saturated = column.role == Some(Role::Saturated);
    let (yes, no) = if is_saturated {
        (Some(Mark::Saturated), Some(Mark::Kept))
    } else {
        let is_valid = column.label.contains("valid");
        (is_valid.then_some(Mark::Kept), is_valid.then_some(invalid))
    };
    match &cell.to_lowercase()[..] {
        "1" | "1.0" | "true" | "yes" | "y" => yes,
        "0" | "0.0" | "false" | "no" | "n" => no,
        "" => no.filter(|_| is_saturated),
        "ok" | "good" | "valid" | "pass" | "passed" => Some(Mark::Kept),
        "bad" | "error" | "invalid" | "fail" | "failed" | "rejected" => Some(invalid),
        "brdf" | "reflection" | "reflectance" | "r" => Some(Mark::Kept),
        "btdf" | "transmission" | "transmittance" | "t" => Some(Mark::LeftOut(LeftOutRow::Btdf)),
        _ => None,
    }
}

impl Table {
    /// Completes the roles of all columns by their cells, and marks the rows.
    ///
    /// # Errors
    /// If the meaning of a column or a mark is unknown, or not supported.
    pub(super) fn account(&mut self) -> Result<TableSummary, TableError> {
        let is_result = |label: &str| RESULTS.iter().any(|start| label.starts_with(start));
        let columns = &self.layout.columns;
        let is_ours = columns.iter().any(|column| is_result(&column.label));
        let mut roles = Vec::new();
        let mut refused = Vec::new();
        for (index, column) in columns.iter().enumerate() {
            let label = escaped(&column.label);
            let first = self.rows.first().map_or("", |row| &row.cells[index]);
            let other = self.rows.iter().find(|row| row.cells[index] != *first);
            let is_long = column.name == "wavelength" || other.is_some();
            roles.push(match (column.role, other) {
                (Some(Role::Ignored), _) => Role::Ignored,
                _ if is_ours && (is_result(&label) || OTHER_RESULTS.contains(&&label[..])) => {
                    Role::Unused
                }
                (Some(Role::Channel), _) if is_long && self.has(&[MONOCHROME]) => Role::Channel,
                (Some(Role::Unsupported), _)
                | (Some(Role::Sample | Role::Channel) | None, Some(_))
                    if !label.is_empty() =>
                {
                    let differs = other.map_or(String::new(), |other| {
                        let (first, text) = (escaped(first), escaped(&other.cells[index]));
                        format!(" ({first}, and in line {} {text})", other.line)
                    });
                    refused.push((format!("{label}{differs}"), label));
                    Role::Unused
                }
                (Some(Role::Channel) | None, _) => Role::Unused,
                (Some(Role::Selection), None) if mark(column, first).is_none() => Role::Unused,
                (Some(role), _) => role,
            });
        }
        let (texts, labels): (Vec<String>, Vec<String>) = refused.into_iter().unzip();
        if !labels.is_empty() {
            return Err(self.columns_error(&format!(
                "and the readings may depend on {}; give one file for each text of these, or --by NAME for a fit for each text of \
                 one, or --ignore \"{}\" if the readings do not depend on them. Known names are theta_i, phi_i, theta_o, phi_o, r, \
                 g, b, L*, a*, b*, value, wavelengths, noise and instrument. Other colors, such as HSV, are not supported",
                texts.join(", "),
                labels.join(",")
            )));
        }
        let mut summary = TableSummary::default();
        for (column, role) in self.layout.columns.iter_mut().zip(roles) {
            column.role = Some(role);
            if role == Role::Unused {
                column.name.clear();
            }
            summary.columns.push(ColumnSummary {
                name: escaped(&column.label),
                role,
                unit: column.units.first().map(|(_, text)| escaped(text)),
            });
        }
        let mut defect = None;
        for (index, column) in self.layout.columns.iter().enumerate() {
            if !matches!(column.role, Some(Role::Saturated | Role::Selection)) {
                continue;
            }
            for row in &mut self.rows {
                let mark = mark(column, &row.cells[index]);
                if mark.is_none() && defect.is_none() {
                    defect = Some((row.line, index, escaped(&row.cells[index])));
                }
                row.mark = row.mark.max(mark.unwrap_or(Mark::Kept));
            }
        }
        let Some((line, index, cell)) = defect else {
            return Ok(summary);
        };
        let message = format!(
            "column {}: the meaning of `{cell}` is unknown; write ok or bad, or BRDF or BTDF, or 1 or 0 in a column valid or \
             saturated",
            summary.columns[index].name
        );
        Err(self.line_error(line, &message))
    }
}

impl TableSummary {
    /// Returns true if a column is ignored by this name.
    #[must_use]
    pub fn ignores(&self, name: &str) -> bool {
        let mut columns = self.columns.iter();
        columns.any(|column| column.role == Role::Ignored && is_same(&column.name, name))
    }
}
