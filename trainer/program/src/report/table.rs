//! A table of text and numbers, with the best numbers highlighted.

use std::fmt;

use glimpse_evaluation::metrics::{METRICS, MetricColumn, Metrics};
use serde::Serialize;
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

/// An entry of a table.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Cell {
    /// Text, aligned to the left.
    Text(String),
    /// A number, aligned to the right. A number that is not finite is never highlighted.
    Number(f64),
    /// An empty entry.
    Missing,
}

impl fmt::Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Text(text) => f.write_str(text),
            Self::Number(number) => write!(f, "{number}"),
            Self::Missing => Ok(()),
        }
    }
}

/// The numbers that are compared to select the best one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Compare {
    /// The numbers of one column.
    WithinColumn,
    /// The numbers of one row, from the columns with the same [`Column::highlight`].
    WithinRow,
}

/// A table. Short rows are filled with [`Cell::Missing`], and long rows are cut.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Table {
    /// Caption, a sentence.
    pub(crate) caption: String,
    /// The columns.
    pub(crate) columns: Vec<Column>,
    /// The rows.
    pub(crate) rows: Vec<Vec<Cell>>,
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
    pub(super) fn format(&self, cell: &Cell) -> String {
        match cell {
            Cell::Text(text) => text.clone(),
            Cell::Number(number) => format!("{number:.*}", self.decimals),
            Cell::Missing => String::new(),
        }
    }
}

/// Returns the columns of [`Cell::of_metrics`].
pub(crate) fn metric_columns() -> [Column; METRICS.len()] {
    METRICS.each_ref().map(Column::metric)
}

impl From<&Value> for Cell {
    fn from(value: &Value) -> Self {
        match value {
            Value::String(text) => Self::Text(text.clone()),
            value => value.as_f64().into(),
        }
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<f64> for Cell {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl From<usize> for Cell {
    fn from(count: usize) -> Self {
        Self::Number(count as f64)
    }
}

impl<T: Into<Self>> From<Option<T>> for Cell {
    fn from(entry: Option<T>) -> Self {
        entry.map_or(Self::Missing, Into::into)
    }
}

impl Cell {
    /// Returns the entries of [`metric_columns`].
    pub(crate) fn of_metrics(metrics: &Metrics) -> [Self; METRICS.len()] {
        metrics.values().map(Self::Number)
    }
}

impl Table {
    /// Creates a table that compares the numbers of each column.
    pub(crate) fn new(
        caption: impl Into<String>,
        columns: impl Into<Vec<Column>>,
        rows: impl IntoIterator<Item = Vec<Cell>>,
    ) -> Self {
        Self {
            caption: caption.into(),
            columns: columns.into(),
            rows: rows.into_iter().collect(),
            compare: Compare::WithinColumn,
        }
    }

    /// Creates a table of a list of records. Each column has a title, the JSON pointer (RFC 6901) of its entries
    /// within a record, and a number of decimals.
    pub(crate) fn of_records(
        caption: impl Into<String>,
        columns: &[(&str, &str, usize)],
        records: &impl Serialize,
    ) -> anyhow::Result<Self> {
        let records = serde_json::to_value(records)?;
        let row = |record: &Value| {
            let cells = columns.iter();
            cells
                .map(|(_, path, _)| record.pointer(path).into())
                .collect()
        };
        let titles = columns.iter();
        let titles = titles.map(|(title, _, decimals)| Column::plain(*title, *decimals));
        let rows = records.as_array().into_iter().flatten().map(row);
        Ok(Self::new(caption, titles.collect::<Vec<_>>(), rows))
    }

    /// Iterates over the columns with the entries of a row.
    pub(super) fn row(&self, row: usize) -> impl Iterator<Item = (&Column, &Cell)> {
        let cells = self.rows.get(row).into_iter().flatten();
        self.columns
            .iter()
            .zip(cells.chain(std::iter::repeat(&Cell::Missing)))
    }

    /// Returns true if a column holds numbers and no text; it is then aligned to the right.
    pub(super) fn is_numeric(&self, index: usize) -> bool {
        let cells = self.rows.iter().filter_map(|row| row.get(index));
        cells.clone().any(|cell| matches!(cell, Cell::Number(_)))
            && !cells.clone().any(|cell| matches!(cell, Cell::Text(_)))
    }

    /// Returns true if an entry equals the best of the compared numbers in its printed digits.
    pub(super) fn is_best(&self, row: usize, index: usize) -> bool {
        let Some((column, Cell::Number(number))) = self.row(row).nth(index) else {
            return false;
        };
        let select_better = match column.highlight {
            Highlight::Lowest => f64::min,
            Highlight::Highest => f64::max,
            Highlight::None => return false,
        };
        let compared: Vec<(&Column, &Cell)> = match self.compare {
            Compare::WithinColumn => (0..self.rows.len())
                .filter_map(|row| self.row(row).nth(index))
                .collect(),
            Compare::WithinRow => self
                .row(row)
                .filter(|(other, _)| other.highlight == column.highlight)
                .collect(),
        };
        let best = compared
            .into_iter()
            .filter_map(|(_, cell)| match cell {
                Cell::Number(other) if other.is_finite() => Some(*other),
                _ => None,
            })
            .reduce(select_better);
        let printed = |number| column.format(&Cell::Number(number));
        number.is_finite() && best.is_some_and(|best| printed(best) == printed(*number))
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
        let best = |row| [1, 2, 3].map(|index| table.is_best(row, index));
        assert_eq!(best(0), [false, true, false]);
        assert_eq!(best(1), [true, false, false]);
        assert_eq!(best(2), [false; 3]);
        assert_eq!(table.to_markdown().lines().count(), 5);
        assert_eq!(table.to_csv().lines().last(), Some(",,"));
    }
}
