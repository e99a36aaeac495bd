//! Output of a [`Table`] as Markdown, HTML or CSV.

use csv::{Terminator, WriterBuilder};
use maud::html;
use serde_json::Value;

use super::table::{Highlight, Table, text};

impl Table {
    /// Formats the table as Markdown with aligned columns, for a terminal or a document. The best numbers are bold.
    /// Columns without entries are left out.
    pub(crate) fn to_markdown(&self) -> String {
        let escape = |text: &str| text.replace('|', "\\|");
        let has_entry = |index: &usize| self.rows.iter().any(|row| !row[*index].is_null());
        let shown: Vec<usize> = (0..self.columns.len()).filter(has_entry).collect();
        let titles = shown
            .iter()
            .map(|index| escape(&self.columns[*index].title));
        let mut lines: Vec<Vec<String>> = vec![titles.collect()];
        lines.extend(self.rows.iter().enumerate().map(|(row, cells)| {
            let cells = shown.iter().map(|&index| {
                let mark = if self.is_best(row, index) { "**" } else { "" };
                let entry = self.columns[index].format(&cells[index]);
                format!("{mark}{}{mark}", escape(&entry))
            });
            cells.collect()
        }));
        let columns = shown.iter().enumerate().map(|(position, index)| {
            let lengths = lines.iter().map(|line| line[position].chars().count());
            (self.is_numeric(*index), lengths.max().unwrap_or_default())
        });
        let columns: Vec<(bool, usize)> = columns.collect();
        let rule = columns.iter().map(|(is_numeric, width)| {
            let end = if *is_numeric { ":" } else { "-" };
            format!("-{:-<width$}{end}|", "")
        });
        let rule = format!("|{}\n", rule.collect::<String>());
        let lines = lines.iter().map(|line| {
            let cells = line.iter().zip(&columns);
            let cells = cells.map(|(cell, (is_numeric, width))| {
                if *is_numeric {
                    format!(" {cell:>width$} |")
                } else {
                    format!(" {cell:<width$} |")
                }
            });
            format!("|{}\n", cells.collect::<String>())
        });
        let mut lines: Vec<String> = lines.collect();
        lines.insert(1, rule);
        lines.concat()
    }

    /// Formats the table as HTML with its caption. On a narrow page the table scrolls within its box.
    pub(crate) fn to_html(&self) -> String {
        let table = html! {
            thead {
                tr {
                    @for (index, column) in self.columns.iter().enumerate() {
                        th.number[self.is_numeric(index)] scope="col" {
                            (column.title)
                            @match column.highlight {
                                Highlight::Lowest => { " " span title="lower is better" { "\u{2193}" } }
                                Highlight::Highest => { " " span title="higher is better" { "\u{2191}" } }
                                Highlight::None => {}
                            }
                        }
                    }
                }
            }
            "\n"
            tbody {
                @for row in 0..self.rows.len() {
                    tr {
                        @for (index, (column, cell)) in self.row(row).enumerate() {
                            @let entry = column.format(cell);
                            @match cell {
                                Value::String(_) if index == 0 => { th scope="row" { (entry) } }
                                Value::Number(_) if self.is_best(row, index) => {
                                    td.number.best { (entry) }
                                }
                                _ => { td.number[self.is_numeric(index)] { (entry) } }
                            }
                        }
                    }
                    "\n"
                }
            }
        };
        let figure = html! {
            figure.table {
                figcaption { (self.caption) }
                div tabindex="0" { table { (table) } }
            }
            "\n"
        };
        figure.into_string()
    }

    /// Formats the table as comma-separated values (RFC 4180), with all digits of every number.
    pub(crate) fn to_csv(&self) -> String {
        let mut csv = WriterBuilder::new()
            .terminator(Terminator::CRLF)
            .from_writer(Vec::new());
        let titles = self.columns.iter().map(|column| column.title.clone());
        let rows = self.rows.iter().map(|row| row.iter().map(text).collect());
        for record in [titles.collect::<Vec<_>>()].into_iter().chain(rows) {
            // Cannot fail: it writes to memory, and each row has as many cells as there are columns.
            let _ = csv.write_record(record);
        }
        let bytes = csv.into_inner().unwrap_or_default();
        String::from_utf8_lossy(&bytes).into_owned()
    }
}
