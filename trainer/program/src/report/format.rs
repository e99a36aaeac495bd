//! Output of a [`Table`] as Markdown, HTML or CSV.

use csv::{Terminator, WriterBuilder};
use maud::html;

use super::table::{Cell, Highlight, Table};

impl Table {
    /// Formats the table as Markdown with aligned columns, for a terminal or a document. The best numbers are bold.
    pub(crate) fn to_markdown(&self) -> String {
        let escape = |text: &str| text.replace('|', "\\|");
        let titles = self.columns.iter().map(|column| escape(&column.title));
        let mut lines: Vec<Vec<String>> = vec![titles.collect()];
        lines.extend((0..self.rows.len()).map(|row| {
            let cells = self.row(row).enumerate().map(|(index, (column, cell))| {
                let mark = if self.is_best(row, index) { "**" } else { "" };
                format!("{mark}{}{mark}", escape(&column.format(cell)))
            });
            cells.collect()
        }));
        let columns = (0..self.columns.len()).map(|index| {
            let lengths = lines.iter().map(|line| line[index].chars().count());
            (self.is_numeric(index), lengths.max().unwrap_or_default())
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
    pub(crate) fn to_csv(&self) -> String {
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
            let cells = self.row(row).map(|(_, cell)| cell.to_string());
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
