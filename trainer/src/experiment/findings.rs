//! Findings of an experiment and their files: each table as CSV and JSON, each drawing as SVG, and
//! all of them as a part of the page.

use std::path::Path;
use std::time::Duration;

use anyhow::Context;
use glimpse_trainer::report::{Cell, Gallery, Page, Plot, Table};
use glimpse_training::meta::plan::Schedule;
use serde_json::{Map, Value, json};

use super::circumstances::RunSettings;
use super::kept::keep;
use super::store::{Store, TestSet};

/// A part of the findings, in the order of the page.
pub(crate) enum Part {
    /// A paragraph.
    Text(String),
    /// A table, the name of its files, and the settings that it was found under.
    Table(String, Table, RunSettings),
    /// A plot with a caption, and the name of its files.
    Plot(String, Plot, String),
    /// A drawing as SVG with a caption, and the name of its files.
    Drawing(String, String, String),
    /// Rows of pictures.
    Gallery(Gallery),
}

/// Results of an experiment. Every caption ends with the settings that it was run with.
pub(crate) struct Findings {
    title: &'static str,
    circumstances: RunSettings,
    parts: Vec<Part>,
}

impl Findings {
    /// Findings on the store's test set, of methods trained by these schedules.
    pub(crate) fn new(store: &Store<'_>, title: &'static str, schedules: &[Schedule]) -> Self {
        Self {
            title,
            circumstances: store.circumstances(store.test, schedules),
            parts: Vec::new(),
        }
    }

    /// Sets the test set of all parts that are added from here on.
    pub(crate) fn judged_on(&mut self, store: &Store<'_>, set: &TestSet<'_>) {
        self.circumstances.test_set = store.circumstances(set, &[]).test_set;
    }

    fn captioned(&self, caption: &str) -> String {
        format!("{caption}. {}", self.circumstances)
    }

    pub(crate) fn text(&mut self, text: impl Into<String>) {
        self.parts.push(Part::Text(text.into()));
    }

    pub(crate) fn table(&mut self, name: impl Into<String>, mut table: Table) {
        table.caption = self.captioned(&table.caption);
        let circumstances = self.circumstances.clone();
        self.parts
            .push(Part::Table(name.into(), table, circumstances));
    }

    pub(crate) fn plot(&mut self, name: impl Into<String>, plot: Plot) {
        let caption = self.captioned(&plot.title);
        self.parts.push(Part::Plot(name.into(), plot, caption));
    }

    pub(crate) fn drawing(&mut self, name: impl Into<String>, svg: String, caption: &str) {
        let part = Part::Drawing(name.into(), svg, self.captioned(caption));
        self.parts.push(part);
    }

    pub(crate) fn gallery(&mut self, mut gallery: Gallery) {
        gallery.caption = self.captioned(&gallery.caption);
        self.parts.push(Part::Gallery(gallery));
    }

    /// The tables and paragraphs, for the terminal.
    pub(crate) fn to_text(&self) -> String {
        let mut text = format!("{}\n", self.title);
        for part in &self.parts {
            match part {
                Part::Text(paragraph) => text += &format!("\n{paragraph}\n"),
                Part::Table(_, table, _) => {
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
            Part::Table(name, table, _) => Some((&name[..], table)),
            _ => None,
        });
        let found = tables.clone().find(|(each, _)| *each == name);
        match found {
            Some((_, table)) => Ok(table),
            None => Err(tables.map(|(name, _)| name).collect()),
        }
    }

    /// Writes everything into the experiment's folder.
    pub(crate) fn write(&self, experiment: &str, out: &Path, took: Duration) -> anyhow::Result<()> {
        let folder = out.join(experiment);
        let seconds = took.as_secs_f64();
        let time = format!("Made in {seconds:.0} s, except what had been made before.");
        let pictures = format!("{experiment}/pictures");
        let mut page = Page::with_pictures_in(self.title, pictures).paragraph(&time);
        let mut tables = Map::new();
        for part in &self.parts {
            page = match part {
                Part::Text(text) => page.paragraph(text),
                Part::Table(name, table, circumstances) => {
                    let csv = folder.join(format!("{name}.csv"));
                    keep(&csv, table.to_csv().as_bytes())?;
                    tables.insert(name.clone(), table_as_json(table, circumstances));
                    page.table(table)
                }
                Part::Plot(name, plot, caption) => {
                    let svg = plot.to_svg()?;
                    keep(&folder.join(format!("{name}.svg")), svg.as_bytes())?;
                    page.drawing(&svg, caption)
                }
                Part::Drawing(name, svg, caption) => {
                    keep(&folder.join(format!("{name}.svg")), svg.as_bytes())?;
                    page.drawing(svg, caption)
                }
                Part::Gallery(gallery) => page.gallery(gallery),
            };
        }
        let found = json!({
            "experiment": experiment,
            "title": self.title,
            "seconds": seconds,
            "tables": tables,
        });
        let path = folder.join("findings.json");
        keep(&path, serde_json::to_string_pretty(&found)?.as_bytes())?;
        page.write_part(out, experiment)
            .with_context(|| format!("cannot write down {experiment}"))?;
        Ok(())
    }
}

/// A list of rows, each with its columns by their titles, and the settings.
fn table_as_json(table: &Table, circumstances: &RunSettings) -> Value {
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
        "settings": circumstances.to_json(),
        "rows": table.rows.iter().map(row).collect::<Vec<_>>(),
    })
}
