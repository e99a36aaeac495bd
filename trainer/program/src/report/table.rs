//! A table of text and numbers, with the best numbers highlighted.

use glimpse_evaluation::metrics::{METRICS, MetricColumn, Metrics};
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// The number of a column to highlight as the best.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Highlight {
    /// The lowest number, for an error.
    Lowest,
    /// The highest number, for PSNR.
    Highest,
    /// No number.
    None,
}

/// A column: its title, number format and highlight.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Column {
    /// Title with the unit, if any.
    pub(crate) title: String,
    /// Digits after the decimal point.
    pub(crate) decimals: usize,
    /// The number to highlight as the best.
    pub(crate) highlight: Highlight,
}

/// The numbers that are compared to select the best one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Compare {
    /// The numbers of one column.
    WithinColumn,
    /// The numbers of one row, from the columns with the same [`Column::highlight`].
    WithinRow,
}

/// A table.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Table {
    /// Caption, a sentence.
    pub(crate) caption: String,
    /// The columns.
    pub(crate) columns: Vec<Column>,
    /// The rows, with an entry for each column: text, aligned to the left, a number, aligned to the right, or null.
    pub(crate) rows: Vec<Vec<Value>>,
    /// The numbers to compare. All numbers with the same printed digits as the best one are highlighted.
    pub(crate) compare: Compare,
}

impl Column {
    /// Creates a column of text.
    pub(crate) fn text(title: impl Into<String>) -> Self {
        Self::plain(title, 0)
    }

    /// Creates a column of numbers with a fixed number of decimals, none of them highlighted.
    pub(crate) fn plain(title: impl Into<String>, decimals: usize) -> Self {
        Self {
            title: title.into(),
            decimals,
            highlight: Highlight::None,
        }
    }

    /// Creates the column of a metric, with its best number highlighted.
    pub(crate) fn metric(metric: &MetricColumn) -> Self {
        let highlight = if metric.higher_is_better {
            Highlight::Highest
        } else {
            Highlight::Lowest
        };
        Self {
            highlight,
            ..Self::plain(metric.title, metric.decimals)
        }
    }

    /// Formats an entry of this column; an empty entry gives an empty string.
    pub(super) fn format(&self, cell: &Value) -> String {
        match cell.as_f64() {
            Some(number) => format!("{number:.*}", self.decimals),
            None => text(cell),
        }
    }
}

/// Returns an entry as text, with all digits of a number; empty for an empty entry.
pub(crate) fn text(cell: &Value) -> String {
    match cell {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

/// Returns the columns of [`Metrics::values`].
pub(crate) fn metric_columns() -> [Column; METRICS.len()] {
    METRICS.each_ref().map(Column::metric)
}

/// Returns a row of metrics, between other entries.
pub(crate) fn metric_row(before: &[Value], metrics: &Metrics, after: &[Value]) -> Vec<Value> {
    [before, &metrics.values().map(Value::from), after].concat()
}

/// The columns of tables of records: the table, the title, the JSON pointer (RFC 6901) of its entries within a record, and the
/// number of decimals.
const RECORDS: &str = include_str!("records.csv");
type RecordColumn = (String, String, String, usize);

impl Table {
    /// Creates a table that compares the numbers of each column. Short rows are filled with null, and long rows
    /// are cut.
    pub(crate) fn new(
        caption: impl Into<String>,
        columns: impl Into<Vec<Column>>,
        rows: impl IntoIterator<Item = Vec<Value>>,
    ) -> Self {
        let columns = columns.into();
        let full = |mut row: Vec<Value>| {
            row.resize(columns.len(), Value::Null);
            row
        };
        Self {
            caption: caption.into(),
            rows: rows.into_iter().map(full).collect(),
            columns,
            compare: Compare::WithinColumn,
        }
    }

    /// Creates a table of a list of records, with the columns of a name in `records.csv`.
    pub(crate) fn of_records(name: &str, records: &impl Serialize) -> anyhow::Result<Self> {
        let records = serde_json::to_value(records)?;
        let mut columns = csv::Reader::from_reader(RECORDS.as_bytes());
        let columns = columns.deserialize().collect::<Result<Vec<_>, _>>()?;
        let columns = columns
            .iter()
            .filter(|(table, ..): &&RecordColumn| table == name);
        anyhow::ensure!(
            columns.clone().count() > 0,
            "no table {name} in records.csv"
        );
        let row = |record: &Value| {
            let cells = columns.clone();
            let cells = cells.map(|(_, _, path, _)| record.pointer(path).cloned());
            cells.map(Option::unwrap_or_default).collect()
        };
        let titles = columns.clone();
        let titles = titles.map(|(_, title, _, decimals)| Column::plain(title, *decimals));
        let rows = records.as_array().into_iter().flatten().map(row);
        Ok(Self::new("", titles.collect::<Vec<_>>(), rows))
    }

    /// Iterates over the columns with the entries of a row.
    pub(super) fn row(&self, row: usize) -> impl Iterator<Item = (&Column, &Value)> {
        self.columns.iter().zip(&self.rows[row])
    }

    /// Returns true if a column holds numbers and no text; it is then aligned to the right.
    pub(super) fn is_numeric(&self, index: usize) -> bool {
        let cells = self.rows.iter().map(|row| &row[index]);
        cells.clone().any(|cell| cell.is_number()) && !cells.clone().any(|cell| cell.is_string())
    }

    /// Returns true if an entry equals the best of the compared numbers in its printed digits.
    pub(super) fn is_best(&self, row: usize, index: usize) -> bool {
        let column = &self.columns[index];
        let select_better = match column.highlight {
            Highlight::Lowest => f64::min,
            Highlight::Highest => f64::max,
            Highlight::None => return false,
        };
        let compared: Vec<&Value> = match self.compare {
            Compare::WithinColumn => self.rows.iter().map(|row| &row[index]).collect(),
            Compare::WithinRow => {
                let row = self.row(row);
                let row = row.filter(|(other, _)| other.highlight == column.highlight);
                row.map(|(_, cell)| cell).collect()
            }
        };
        let numbers = compared.into_iter().filter_map(Value::as_f64);
        let best = numbers.reduce(select_better);
        let cell = &self.rows[row][index];
        cell.is_number() && column.format(cell) == column.format(&best.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn compares_within_rows_and_fills_short_rows() {
        let rows = vec![
            vec!["a".into(), 2.0.into(), 1.0.into(), 0.0.into()],
            vec!["b".into(), 2.0.into()],
            vec![],
        ];
        let loss = |title| Column {
            highlight: Highlight::Lowest,
            ..Column::plain(title, 4)
        };
        let columns = [Column::text("Material"), loss("Meta"), loss("Glimpse")];
        let table = Table {
            compare: Compare::WithinRow,
            ..Table::new("", columns, rows)
        };
        let best = |row| [1, 2].map(|index| table.is_best(row, index));
        assert_eq!(best(0), [false, true]);
        assert_eq!(best(1), [true, false]);
        assert_eq!(best(2), [false; 2]);
        assert_eq!(table.to_markdown().lines().count(), 5);
        assert_eq!(table.to_csv().lines().last(), Some(",,"));
    }
}
