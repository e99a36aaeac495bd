//! Findings of an experiment and their files: tables as CSV and JSON, drawings as SVG, and a page of all of
//! them.

use std::path::Path;

use crate::report::{Cell, Gallery, Page, Table};
use glimpse_training::choice::Choice;
use glimpse_training::meta::options::Schedule;
use serde_json::{Map, Value, json};

use super::case::Case;
use super::store::{Store, write_file};

impl Store<'_> {
    /// Describes the settings of cases on a test set.
    pub(super) fn describe_settings(&self, set: usize, cases: &[Case]) -> String {
        let settings = &self.settings;
        let mut text = String::new();
        for schedule in [Schedule::Paper, Schedule::Prior] {
            let mut schedules = cases.iter().map(|case| case.approach.schedule());
            if !schedules.any(|other| other == Some(schedule)) {
                continue;
            }
            let effort = settings.effort_for(schedule);
            text += &format!("Schedule {} at effort {}", schedule.name(), effort.name());
            text += &match (schedule, effort.paper_step_divisor()) {
                (Schedule::Paper, 1) => " (all of the paper's steps); ".to_owned(),
                (Schedule::Paper, divisor) => format!(" (1/{divisor} of the paper's steps); "),
                _ => "; ".to_owned(),
            };
        }
        let test = &self.sets[set];
        text + &format!(
            "seed {}, {} seeds of random directions. Training set: {} ({} materials). Test set: {} ({} materials).",
            settings.seed,
            settings.seeds,
            settings.data.label(),
            self.training_count,
            test.source,
            test.materials.len(),
        )
    }
}

/// The first paragraph of every page.
const INTRODUCTION: &str = "An experiment of Learning to Learn and Sample BRDFs (Liu, Fischer, Ritschel 2023). The best of \
    the compared numbers is marked. An arrow shows whether higher or lower values are better. Click a sphere to enlarge \
    its row. The folder of this page has the tables as CSV and JSON, and drawings as SVG.";

/// One finding of an experiment.
pub(super) enum Finding {
    /// A paragraph.
    Text(String),
    /// A table, and the name of its files.
    Table(String, Table),
    /// A drawing: the name of its file, the SVG, and its caption.
    Drawing(String, String, String),
    /// Rows of pictures.
    Gallery(Gallery),
}

/// The findings of an experiment, in the order of the page. Every caption ends with the settings of the run.
pub(crate) struct Findings {
    pub(super) title: &'static str,
    pub(super) entries: Vec<Finding>,
}

impl Findings {
    /// Formats the tables and paragraphs for the terminal.
    pub(crate) fn to_text(&self) -> String {
        let mut text = format!("{}\n", self.title);
        for entry in &self.entries {
            match entry {
                Finding::Text(paragraph) => text += &format!("\n{paragraph}\n"),
                Finding::Table(_, table) => {
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
            Finding::Table(name, table) => Some((&name[..], table)),
            _ => None,
        });
        let table = tables.clone().find(|(table_name, _)| *table_name == name);
        match table {
            Some((_, table)) => Ok(table),
            None => Err(tables.map(|(name, _)| name).collect()),
        }
    }

    /// Writes all findings into the experiment's folder below `out`.
    pub(crate) fn write(&self, experiment: &str, out: &Path) -> anyhow::Result<()> {
        let folder = out.join(experiment);
        let mut page = Page::new(self.title).paragraph(INTRODUCTION);
        let mut tables = Map::new();
        for entry in &self.entries {
            page = match entry {
                Finding::Text(text) => page.paragraph(text),
                Finding::Table(name, table) => {
                    let csv = folder.join(format!("{name}.csv"));
                    write_file(&csv, table.to_csv().as_bytes())?;
                    tables.insert(name.clone(), table_to_json(table));
                    page.table(table)
                }
                Finding::Drawing(name, svg, caption) => {
                    write_file(&folder.join(format!("{name}.svg")), svg.as_bytes())?;
                    page.drawing(svg, caption)
                }
                Finding::Gallery(gallery) => page.gallery(gallery),
            };
        }
        let findings = json!({ "experiment": experiment, "title": self.title, "tables": tables });
        let path = folder.join("findings.json");
        write_file(&path, serde_json::to_string_pretty(&findings)?.as_bytes())?;
        Ok(page.write(&folder)?)
    }
}

/// Converts a table to JSON: the caption, and rows as objects with the column titles as keys.
fn table_to_json(table: &Table) -> Value {
    let row = |row: &Vec<Cell>| {
        let entries = table.columns.iter().zip(row);
        let entries = entries.map(|(column, cell)| (column.title.clone(), json!(cell)));
        Value::Object(entries.collect())
    };
    json!({
        "caption": table.caption,
        "rows": table.rows.iter().map(row).collect::<Vec<_>>(),
    })
}
