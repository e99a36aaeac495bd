//! One table: what it holds, and which of its numbers are the best.

/// Which number of a column is the best.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Best {
    /// The least, as of an error.
    Least,
    /// The greatest, as of PSNR.
    Greatest,
    /// None: numbers are only shown.
    None,
}

/// A column: its title, and how its numbers are shown and compared.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// The title, with the unit if there is one.
    pub title: String,
    /// Digits after the decimal point.
    pub decimals: usize,
    /// Which number is the best.
    pub best: Best,
}

/// One entry.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// Words, aligned to the left.
    Text(String),
    /// A number, aligned to the right. One that is not finite is shown and never the best.
    Number(f64),
    /// Nothing.
    Missing,
}

/// Which numbers compete for being marked as the best.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compare {
    /// Those of one column: each row is a contender.
    Down,
    /// Those of one row: each column is a contender. Only columns that agree in [`Column::best`]
    /// compete.
    Across,
}

/// A table. Rows that are too short are filled up with [`Cell::Missing`], longer ones are cut.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// What it shows, in a sentence.
    pub caption: String,
    /// The columns.
    pub columns: Vec<Column>,
    /// The rows.
    pub rows: Vec<Vec<Cell>>,
    /// Who competes. Numbers that print like the best one share the mark.
    pub compare: Compare,
}

impl Column {
    /// A column of words.
    #[must_use]
    pub fn text(title: impl Into<String>) -> Self {
        Self::number(title, 0, Best::None)
    }

    /// A column of numbers.
    #[must_use]
    pub fn number(title: impl Into<String>, decimals: usize, best: Best) -> Self {
        Self {
            title: title.into(),
            decimals,
            best,
        }
    }

    /// How an entry of this column reads; empty if there is none.
    pub(super) fn show(&self, cell: &Cell) -> String {
        match cell {
            Cell::Text(text) => text.clone(),
            Cell::Number(number) => format!("{number:.*}", self.decimals),
            Cell::Missing => String::new(),
        }
    }
}

impl Table {
    /// The entries of a row with their columns, as many as there are columns.
    pub(super) fn row(&self, row: usize) -> impl Iterator<Item = (&Column, &Cell)> {
        let cells = self.rows.get(row).into_iter().flatten();
        self.columns
            .iter()
            .zip(cells.chain(std::iter::repeat(&Cell::Missing)))
    }

    /// True for columns that are aligned to the right.
    pub(super) fn is_numeric(&self, index: usize) -> bool {
        let cells = self.rows.iter().filter_map(|row| row.get(index));
        cells.clone().any(|cell| matches!(cell, Cell::Number(_)))
            && !cells.clone().any(|cell| matches!(cell, Cell::Text(_)))
    }

    /// True if an entry is the best of those it competes with, as far as the digits shown tell.
    pub(super) fn is_best(&self, row: usize, index: usize) -> bool {
        let Some((column, Cell::Number(number))) = self.row(row).nth(index) else {
            return false;
        };
        let better = match column.best {
            Best::Least => f64::min,
            Best::Greatest => f64::max,
            Best::None => return false,
        };
        let rivals: Vec<(&Column, &Cell)> = match self.compare {
            Compare::Down => (0..self.rows.len())
                .filter_map(|row| self.row(row).nth(index))
                .collect(),
            Compare::Across => self
                .row(row)
                .filter(|(rival, _)| rival.best == column.best)
                .collect(),
        };
        let best = rivals
            .into_iter()
            .filter_map(|(_, cell)| match cell {
                Cell::Number(rival) if rival.is_finite() => Some(*rival),
                _ => None,
            })
            .reduce(better);
        let shown = |number| column.show(&Cell::Number(number));
        number.is_finite() && best.is_some_and(|best| shown(best) == shown(*number))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_can_compete_across_and_be_ragged() {
        let rows = vec![
            vec![
                Cell::Text("a".into()),
                Cell::Number(2.0),
                Cell::Number(1.0),
                Cell::Number(0.0),
            ],
            vec![Cell::Text("b".into()), Cell::Number(2.0)],
            vec![],
        ];
        let loss = |title| Column::number(title, 3, Best::Least);
        let table = Table {
            caption: String::new(),
            columns: vec![Column::text("Material"), loss("Meta"), loss("Ours")],
            rows,
            compare: Compare::Across,
        };
        let best = |row| [1, 2, 3].map(|index| table.is_best(row, index));
        assert_eq!(best(0), [false, true, false]);
        assert_eq!(best(1), [true, false, false]);
        assert_eq!(best(2), [false; 3]);
        assert_eq!(table.to_text().lines().count(), 4);
        assert_eq!(table.to_csv().lines().last(), Some(",,"));
    }
}
