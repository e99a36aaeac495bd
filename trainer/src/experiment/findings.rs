//! Findings of an experiment and their files: tables as CSV and JSON, drawings as SVG, and all of them as a section of
//! the page.

use std::path::Path;
use std::time::Duration;

use anyhow::Context;
use glimpse_trainer::report::{Cell, Gallery, Page, Plot, Table};
use glimpse_training::meta::plan::Schedule;
use serde_json::{Map, Value, json};

use super::run_settings::RunSettings;
use super::store::{Store, TestSet};
use super::stored::write_file;

/// One finding of an experiment.
pub(crate) enum Finding {
    /// A paragraph.
    Text(String),
    /// A table: the name of its files, the table, and its settings.
    Table(String, Table, RunSettings),
    /// A plot: the name of its file, the plot, and its caption.
    Plot(String, Plot, String),
    /// A drawing: the name of its file, the SVG, and its caption.
    Drawing(String, String, String),
    /// Rows of pictures.
    Gallery(Gallery),
}

/// The findings of an experiment, in the order of the page. Every caption ends with the settings of the run.
pub(crate) struct Findings {
    title: &'static str,
    run_settings: RunSettings,
    entries: Vec<Finding>,
}

impl Findings {
    /// Creates an empty list. Captions state the store's test set and these training schedules.
    pub(crate) fn new(store: &Store<'_>, title: &'static str, schedules: &[Schedule]) -> Self {
        Self {
            title,
            run_settings: store.run_settings(store.test, schedules),
            entries: Vec::new(),
        }
    }

    /// Sets the test set of the entries that are added afterwards.
    pub(crate) fn set_test_set(&mut self, store: &Store<'_>, set: &TestSet<'_>) {
        self.run_settings.test_set = store.run_settings(set, &[]).test_set;
    }

    fn caption_with_settings(&self, caption: &str) -> String {
        format!("{caption}. {}", self.run_settings)
    }

    /// Adds a paragraph.
    pub(crate) fn text(&mut self, text: impl Into<String>) {
        self.entries.push(Finding::Text(text.into()));
    }

    /// Adds a table whose files have this name.
    pub(crate) fn table(&mut self, name: impl Into<String>, mut table: Table) {
        table.caption = self.caption_with_settings(&table.caption);
        let run_settings = self.run_settings.clone();
        self.entries
            .push(Finding::Table(name.into(), table, run_settings));
    }

    /// Adds a plot whose file has this name. Its title is also the caption.
    pub(crate) fn plot(&mut self, name: impl Into<String>, plot: Plot) {
        let caption = self.caption_with_settings(&plot.title);
        self.entries.push(Finding::Plot(name.into(), plot, caption));
    }

    /// Adds an SVG drawing whose file has this name.
    pub(crate) fn drawing(&mut self, name: impl Into<String>, svg: String, caption: &str) {
        let caption = self.caption_with_settings(caption);
        self.entries
            .push(Finding::Drawing(name.into(), svg, caption));
    }

    /// Adds rows of pictures.
    pub(crate) fn gallery(&mut self, mut gallery: Gallery) {
        gallery.caption = self.caption_with_settings(&gallery.caption);
        self.entries.push(Finding::Gallery(gallery));
    }

    /// Formats the tables and paragraphs for the terminal.
    pub(crate) fn to_text(&self) -> String {
        let mut text = format!("{}\n", self.title);
        for entry in &self.entries {
            match entry {
                Finding::Text(paragraph) => text += &format!("\n{paragraph}\n"),
                Finding::Table(_, table, _) => {
                    text += &format!("\n{}\n{}", table.caption, table.to_text());
                }
                _ => {}
            }
        }
        text
    }

    /// Returns the table whose files have this name. The error is the list of all table names.
    pub(crate) fn find_table(&self, name: &str) -> Result<&Table, Vec<&str>> {
        let tables = self.entries.iter().filter_map(|entry| match entry {
            Finding::Table(name, table, _) => Some((&name[..], table)),
            _ => None,
        });
        let table = tables.clone().find(|(table_name, _)| *table_name == name);
        match table {
            Some((_, table)) => Ok(table),
            None => Err(tables.map(|(name, _)| name).collect()),
        }
    }

    /// Writes all findings into the experiment's folder below `out`. `duration` is the run time.
    pub(crate) fn write(
        &self,
        experiment: &str,
        out: &Path,
        duration: Duration,
    ) -> anyhow::Result<()> {
        let folder = out.join(experiment);
        let seconds = duration.as_secs_f64();
        let time = format!(
            "Run time: {seconds:.0} s, without the time of stored recipes and evaluations."
        );
        let pictures = format!("{experiment}/pictures");
        let mut page = Page::with_pictures_in(self.title, pictures).paragraph(&time);
        let mut tables = Map::new();
        for entry in &self.entries {
            page = match entry {
                Finding::Text(text) => page.paragraph(text),
                Finding::Table(name, table, run_settings) => {
                    let csv = folder.join(format!("{name}.csv"));
                    write_file(&csv, table.to_csv().as_bytes())?;
                    tables.insert(name.clone(), table_to_json(table, run_settings));
                    page.table(table)
                }
                Finding::Plot(name, plot, caption) => {
                    let svg = plot.to_svg();
                    write_file(&folder.join(format!("{name}.svg")), svg.as_bytes())?;
                    page.drawing(&svg, caption)
                }
                Finding::Drawing(name, svg, caption) => {
                    write_file(&folder.join(format!("{name}.svg")), svg.as_bytes())?;
                    page.drawing(svg, caption)
                }
                Finding::Gallery(gallery) => page.gallery(gallery),
            };
        }
        let findings = json!({
            "experiment": experiment,
            "title": self.title,
            "seconds": seconds,
            "tables": tables,
        });
        let path = folder.join("findings.json");
        write_file(&path, serde_json::to_string_pretty(&findings)?.as_bytes())?;
        page.write_section(out, experiment)
            .with_context(|| format!("cannot write the section of {experiment}"))?;
        Ok(())
    }
}

/// Converts a table to JSON: the caption, the settings, and rows as objects with the column titles as keys.
fn table_to_json(table: &Table, run_settings: &RunSettings) -> Value {
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
        "settings": run_settings.to_json(),
        "rows": table.rows.iter().map(row).collect::<Vec<_>>(),
    })
}
