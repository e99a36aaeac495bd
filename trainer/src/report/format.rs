//! A [`Table`] as plain text, Markdown, HTML or CSV.

use csv::{Terminator, WriterBuilder};
use maud::html;

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

    /// As Markdown, the best numbers in bold.
    #[must_use]
    pub fn to_markdown(&self) -> String {
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let plain = |text: &str| text.replace('|', "\\|");
        let heads = self.columns.iter().map(|column| plain(&column.title));
        let rule = (0..self.columns.len()).map(|index| match self.is_numeric(index) {
            true => "---:".to_owned(),
            false => "---".to_owned(),
        });
        let mut markdown = line(heads.collect()) + &line(rule.collect());
        for row in 0..self.rows.len() {
            let cells = self.row(row).enumerate().map(|(index, (column, cell))| {
                let shown = plain(&column.show(cell));
                match self.is_best(row, index) {
                    true => format!("**{shown}**"),
                    false => shown,
                }
            });
            markdown += &line(cells.collect());
        }
        markdown
    }

    /// As HTML: a caption, and a table in a box that scrolls where the page is too narrow.
    #[must_use]
    pub fn to_html(&self) -> String {
        let number = |index: usize| self.is_numeric(index);
        let table = html! {
            thead {
                tr {
                    @for (index, column) in self.columns.iter().enumerate() {
                        th.number[number(index)] scope="col" {
                            (column.title)
                            @match column.best {
                                Best::Least => { " " span title="less is better" { "\u{2193}" } }
                                Best::Greatest => { " " span title="more is better" { "\u{2191}" } }
                                Best::None => {}
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
                            @let shown = column.show(cell);
                            @match cell {
                                Cell::Text(_) if index == 0 => { th scope="row" { (shown) } }
                                Cell::Number(_) if self.is_best(row, index) => {
                                    td.number.best { (shown) }
                                }
                                _ => { td.number[number(index)] { (shown) } }
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

    /// As comma-separated values (RFC 4180), with all digits of every number.
    #[must_use]
    pub fn to_csv(&self) -> String {
        // Memory takes whatever is written, and each row has as many cells as there are columns.
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
    fn markdown_marks_the_best() {
        let expected = "\
| Method | Loss | PSNR, dB |
| --- | ---: | ---: |
| Random | 0.065 | NaN |
| Meta & co | **0.035** |  |
| Ours | **0.035** | **24.4** |
";
        assert_eq!(methods().to_markdown(), expected);
    }

    #[test]
    fn csv_keeps_all_digits() {
        let expected = "Method,Loss,\"PSNR, dB\"\r\nRandom,0.0651,NaN\r\nMeta & co,0.0354,\r\n\
                        Ours,0.0351,24.35\r\n";
        assert_eq!(methods().to_csv(), expected);
    }
}
