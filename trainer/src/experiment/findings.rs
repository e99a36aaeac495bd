//! What an experiment has found, and how it is written down: each table as CSV and JSON, each
//! drawing as SVG and PNG, and all of it as a part of the page.

use std::path::Path;
use std::time::Duration;

use anyhow::Context;
use glimpse_trainer::report::{Cell, Gallery, Page, Plot, Table, svg_to_png};
use serde_json::{Map, Value, json};

use super::kept::keep;
use super::store::Settings;

/// A part of the findings, in the order of the page.
pub(crate) enum Part {
    /// A paragraph.
    Text(String),
    /// A table, and the name of its files.
    Table(String, Table),
    /// A plot, and the name of its files.
    Plot(String, Plot),
    /// A drawing as SVG with a caption, and the name of its files.
    Drawing(String, String, String),
    /// Rows of pictures.
    Gallery(Gallery),
}

/// What an experiment has found.
pub(crate) struct Findings {
    /// What was asked.
    pub(crate) title: &'static str,
    /// What came out.
    pub(crate) parts: Vec<Part>,
}

impl Findings {
    pub(crate) fn new(title: &'static str) -> Self {
        Self {
            title,
            parts: Vec::new(),
        }
    }

    pub(crate) fn text(&mut self, text: impl Into<String>) {
        self.parts.push(Part::Text(text.into()));
    }

    pub(crate) fn table(&mut self, name: impl Into<String>, table: Table) {
        self.parts.push(Part::Table(name.into(), table));
    }

    pub(crate) fn plot(&mut self, name: impl Into<String>, plot: Plot) {
        self.parts.push(Part::Plot(name.into(), plot));
    }

    pub(crate) fn drawing(
        &mut self,
        name: impl Into<String>,
        svg: String,
        caption: impl Into<String>,
    ) {
        let part = Part::Drawing(name.into(), svg, caption.into());
        self.parts.push(part);
    }

    pub(crate) fn gallery(&mut self, gallery: Gallery) {
        self.parts.push(Part::Gallery(gallery));
    }

    /// The tables and paragraphs, for the terminal.
    pub(crate) fn to_text(&self) -> String {
        let mut text = format!("{}\n", self.title);
        for part in &self.parts {
            match part {
                Part::Text(paragraph) => text += &format!("\n{paragraph}\n"),
                Part::Table(_, table) => {
                    text += &format!("\n{}\n{}", table.caption, table.to_text());
                }
                _ => {}
            }
        }
        text
    }

    /// The table whose files have this name, or the names that there are.
    pub(crate) fn named(&self, name: &str) -> Result<&Table, Vec<&str>> {
        let tables = self.parts.iter().filter_map(|part| match part {
            Part::Table(name, table) => Some((&name[..], table)),
            _ => None,
        });
        let found = tables.clone().find(|(each, _)| *each == name);
        match found {
            Some((_, table)) => Ok(table),
            None => Err(tables.map(|(name, _)| name).collect()),
        }
    }

    /// Writes everything into the experiment's folder.
    pub(crate) fn write(
        &self,
        experiment: &str,
        settings: &Settings,
        sources: &str,
        took: Duration,
    ) -> anyhow::Result<()> {
        let folder = settings.out.join(experiment);
        let circumstances = format!(
            "Seed {}, effort {}, {sources}; {:.0} s, recipes and judgements that were there \
             already left aside.",
            settings.seed,
            format!("{:?}", settings.effort).to_lowercase(),
            took.as_secs_f64()
        );
        let pictures = format!("{experiment}/pictures");
        let mut page = Page::with_pictures_in(self.title, pictures).paragraph(&circumstances);
        let mut tables = Map::new();
        for part in &self.parts {
            page = match part {
                Part::Text(text) => page.paragraph(text),
                Part::Table(name, table) => {
                    let csv = folder.join(format!("{name}.csv"));
                    keep(&csv, table.to_csv().as_bytes())?;
                    tables.insert(name.clone(), table_as_json(table));
                    page.table(table)
                }
                Part::Plot(name, plot) => {
                    let svg = plot.to_svg()?;
                    draw(&folder, name, &svg)?;
                    page.drawing(&svg, &plot.title)
                }
                Part::Drawing(name, svg, caption) => {
                    draw(&folder, name, svg)?;
                    page.drawing(svg, caption)
                }
                Part::Gallery(gallery) => page.gallery(gallery),
            };
        }
        let found = json!({
            "experiment": experiment,
            "title": self.title,
            "circumstances": circumstances,
            "tables": tables,
        });
        let path = folder.join("findings.json");
        keep(&path, serde_json::to_string_pretty(&found)?.as_bytes())?;
        page.write_part(&settings.out, experiment)
            .with_context(|| format!("cannot write down {experiment}"))?;
        Ok(())
    }
}

/// A drawing as SVG and as PNG.
fn draw(folder: &Path, name: &str, svg: &str) -> anyhow::Result<()> {
    keep(&folder.join(format!("{name}.svg")), svg.as_bytes())?;
    keep(&folder.join(format!("{name}.png")), &svg_to_png(svg)?)
}

/// A list of rows, each with its columns by their titles.
fn table_as_json(table: &Table) -> Value {
    let row = |row: &Vec<Cell>| {
        let entries = table.columns.iter().zip(row).map(|(column, cell)| {
            let value = match cell {
                Cell::Text(text) => json!(text),
                Cell::Number(number) => json!(number),
                Cell::Missing => Value::Null,
            };
            (column.title.clone(), value)
        });
        Value::Object(entries.collect())
    };
    json!({
        "caption": table.caption,
        "rows": table.rows.iter().map(row).collect::<Vec<_>>(),
    })
}
