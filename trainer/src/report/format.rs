//! A [`Table`] as plain text, HTML or CSV.

use std::fmt::Write as _;

use super::html::escape;
use super::table::{Best, Cell, Table};

impl Table {
    /// For a terminal: aligned columns, the best numbers marked with `*`.
    #[must_use]
    pub fn to_text(&self) -> String {
        let heads = self
            .columns
            .iter()
            .map(|column| column.title.clone())
            .collect();
        let mut lines: Vec<Vec<String>> = vec![heads];
        lines.extend((0..self.rows.len()).map(|row| {
            let shown = self.row(row).enumerate().map(|(index, (column, cell))| {
                // Numbers keep a place for the mark, so that their points stay aligned.
                let mark = match cell {
                    Cell::Number(_) if self.is_best(row, index) => "*",
                    Cell::Number(_) => " ",
                    _ => "",
                };
                column.show(cell) + mark
            });
            shown.collect()
        }));
        let width = |index: usize| lines.iter().filter_map(move |line| line.get(index));
        let widths: Vec<usize> = (0..self.columns.len())
            .map(|index| {
                width(index)
                    .map(|entry| entry.chars().count())
                    .max()
                    .unwrap_or(0)
            })
            .collect();
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

    /// As HTML: a caption, and a table in a box that scrolls where the page is too narrow.
    #[must_use]
    pub fn to_html(&self) -> String {
        let mut html = String::from("<figure class=\"table\">\n");
        let class = |index| {
            if self.is_numeric(index) {
                " class=\"number\""
            } else {
                ""
            }
        };
        let _ = writeln!(
            html,
            "<figcaption>{}</figcaption>\n<div tabindex=\"0\"><table>\n<thead><tr>",
            escape(&self.caption)
        );
        for (index, column) in self.columns.iter().enumerate() {
            let arrow = match column.best {
                Best::Least => " <span title=\"less is better\">&darr;</span>",
                Best::Greatest => " <span title=\"more is better\">&uarr;</span>",
                Best::None => "",
            };
            let title = escape(&column.title);
            let _ = writeln!(
                html,
                "<th scope=\"col\"{}>{title}{arrow}</th>",
                class(index)
            );
        }
        html.push_str("</tr></thead>\n<tbody>\n");
        for row in 0..self.rows.len() {
            html.push_str("<tr>");
            for (index, (column, cell)) in self.row(row).enumerate() {
                let shown = escape(&column.show(cell));
                let _ = match cell {
                    Cell::Text(_) if index == 0 => write!(html, "<th scope=\"row\">{shown}</th>"),
                    Cell::Number(_) if self.is_best(row, index) => {
                        write!(html, "<td class=\"number best\">{shown}</td>")
                    }
                    _ => write!(html, "<td{}>{shown}</td>", class(index)),
                };
            }
            html.push_str("</tr>\n");
        }
        html.push_str("</tbody></table></div></figure>\n");
        html
    }

    /// As comma-separated values (RFC 4180), with all digits of every number.
    #[must_use]
    pub fn to_csv(&self) -> String {
        let line = |entries: &mut dyn Iterator<Item = String>| {
            let entries: Vec<String> = entries.collect();
            entries.join(",") + "\r\n"
        };
        let mut csv = line(&mut self.columns.iter().map(|column| quote(&column.title)));
        for row in 0..self.rows.len() {
            csv += &line(&mut self.row(row).map(|(_, cell)| match cell {
                Cell::Text(text) => quote(text),
                Cell::Number(number) => number.to_string(),
                Cell::Missing => String::new(),
            }));
        }
        csv
    }
}

/// An entry of a CSV file, in quotes if it needs them.
fn quote(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{Column, Compare};

    fn methods() -> Table {
        let row = |name: &str, loss, psnr| vec![Cell::Text(name.into()), loss, psnr];
        Table {
            caption: "Means over \"all\" <materials>".into(),
            columns: vec![
                Column::text("Method"),
                Column::number("Loss", 3, Best::Least),
                Column::number("PSNR, dB", 1, Best::Greatest),
            ],
            rows: vec![
                row("Random", Cell::Number(0.0651), Cell::Number(f64::NAN)),
                row("Meta & co", Cell::Number(0.0354), Cell::Missing),
                row("Ours", Cell::Number(0.0351), Cell::Number(24.35)),
            ],
            compare: Compare::Down,
        }
    }

    #[test]
    fn text_is_aligned_and_marks_the_best() {
        let expected = "\
Method       Loss  PSNR, dB
Random     0.065       NaN
Meta & co  0.035*
Ours       0.035*     24.4*
";
        let text = methods().to_text();
        let trimmed: Vec<&str> = text.lines().map(str::trim_end).collect();
        assert_eq!(trimmed.join("\n") + "\n", expected);
    }

    #[test]
    fn html_is_escaped_and_marks_the_best() {
        let html = methods().to_html();
        assert!(html.contains("Means over &quot;all&quot; &lt;materials&gt;"));
        assert!(html.contains("<th scope=\"row\">Meta &amp; co</th>"));
        assert!(html.contains("<td class=\"number best\">24.4</td>"));
        assert_eq!(html.matches("best\"").count(), 3);
    }

    #[test]
    fn csv_keeps_all_digits() {
        let expected = "Method,Loss,\"PSNR, dB\"\r\nRandom,0.0651,NaN\r\nMeta & co,0.0354,\r\n\
                        Ours,0.0351,24.35\r\n";
        assert_eq!(methods().to_csv(), expected);
    }
}
