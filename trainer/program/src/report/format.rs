//! Output of a [`Table`] as plain text, Markdown, HTML or CSV.

use csv::{Terminator, WriterBuilder};
use maud::html;

use super::table::{Cell, Highlight, Table};

impl Table {
    /// Formats the table for a terminal: aligned columns, the best numbers marked with `*`.
    #[must_use]
    pub fn to_text(&self) -> String {
        let titles = self
            .columns
            .iter()
            .map(|column| column.title.clone())
            .collect();
        let mut lines: Vec<Vec<String>> = vec![titles];
        lines.extend((0..self.rows.len()).map(|row| {
            let entries = self.row(row).enumerate().map(|(index, (column, cell))| {
                // Every number reserves a character for the mark, so that decimal points stay aligned.
                let mark = match cell {
                    Cell::Number(_) if self.is_best(row, index) => "*",
                    Cell::Number(_) => " ",
                    _ => "",
                };
                column.format(cell) + mark
            });
            entries.collect()
        }));
        let width = |index: usize| {
            let entries = lines.iter().filter_map(|line| line.get(index));
            let lengths = entries.map(|entry| entry.chars().count());
            lengths.max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.columns.len()).map(width).collect();
        let mut text = String::new();
        for line in &lines {
            let entries = line
                .iter()
                .zip(&widths)
                .enumerate()
                .map(|(index, (entry, &width))| {
                    if self.is_numeric(index) {
                        format!("{entry:>width$}")
                    } else {
                        format!("{entry:<width$}")
                    }
                });
            let entries: Vec<String> = entries.collect();
            text.push_str(entries.join("  ").trim_end());
            text.push('\n');
        }
        text
    }

    /// Formats the table as Markdown, the best numbers in bold.
    #[must_use]
    pub fn to_markdown(&self) -> String {
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let escape = |text: &str| text.replace('|', "\\|");
        let titles = self.columns.iter().map(|column| escape(&column.title));
        let alignment = (0..self.columns.len()).map(|index| match self.is_numeric(index) {
            true => "---:|",
            false => "---|",
        });
        let alignment = alignment.collect::<String>();
        let mut markdown = line(titles.collect()) + &format!("|{alignment}\n");
        for row in 0..self.rows.len() {
            let cells = self.row(row).enumerate().map(|(index, (column, cell))| {
                let entry = escape(&column.format(cell));
                match self.is_best(row, index) {
                    true => format!("**{entry}**"),
                    false => entry,
                }
            });
            markdown += &line(cells.collect());
        }
        markdown
    }

    /// Formats the table as HTML with its caption. On a narrow page the table scrolls within its box.
    #[must_use]
    pub fn to_html(&self) -> String {
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
                                Cell::Text(_) if index == 0 => { th scope="row" { (entry) } }
                                Cell::Number(_) if self.is_best(row, index) => {
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
    #[must_use]
    pub fn to_csv(&self) -> String {
        // Cannot fail: it writes to memory, and each row has as many cells as there are columns.
        self.write_csv().unwrap_or_default()
    }

    fn write_csv(&self) -> Option<String> {
        let mut csv = WriterBuilder::new()
            .terminator(Terminator::CRLF)
            .from_writer(Vec::new());
        csv.write_record(self.columns.iter().map(|column| &column.title))
            .ok()?;
        for row in 0..self.rows.len() {
            let cells = self.row(row).map(|(_, cell)| match cell {
                Cell::Text(text) => text.clone(),
                Cell::Number(number) => number.to_string(),
                Cell::Missing => String::new(),
            });
            csv.write_record(cells).ok()?;
        }
        String::from_utf8(csv.into_inner().ok()?).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Column;

    fn method_table() -> Table {
        let number = |title, decimals, highlight| Column {
            highlight,
            ..Column::plain(title, decimals)
        };
        let columns = [
            Column::text("Method"),
            number("Loss", 3, Highlight::Lowest),
            number("PSNR, dB", 1, Highlight::Highest),
        ];
        let row =
            |name: &str, loss: f64, psnr: Option<f64>| vec![name.into(), loss.into(), psnr.into()];
        let rows = [
            row("Random", 0.0651, Some(f64::NAN)),
            row("Meta & co", 0.0354, None),
            row("Glimpse", 0.0351, Some(24.35)),
        ];
        Table::new("Means over \"all\" <materials>", columns, rows)
    }

    #[test]
    fn html_is_escaped_and_marks_best_numbers() {
        let html = method_table().to_html();
        assert!(html.contains("Means over &quot;all&quot; &lt;materials&gt;"));
        assert!(html.contains("<th scope=\"row\">Meta &amp; co</th>"));
        assert!(html.contains("<td class=\"number best\">24.4</td>"));
        assert_eq!(html.matches("best\"").count(), 3);
    }

    #[test]
    fn csv_keeps_all_digits() {
        let expected = "Method,Loss,\"PSNR, dB\"\r\nRandom,0.0651,NaN\r\nMeta & co,0.0354,\r\n\
                        Glimpse,0.0351,24.35\r\n";
        assert_eq!(method_table().to_csv(), expected);
    }
}
