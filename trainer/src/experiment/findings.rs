//! Findings of an experiment and their files: tables as CSV and JSON, drawings as SVG, and all of them as a section of
//! the page.

use std::fmt;
use std::path::Path;

use anyhow::Context;
use glimpse_trainer::report::{Cell, Gallery, Page, Table};
use glimpse_training::meta::plan::{Effort, Schedule};
use serde::Serialize;
use serde_json::{Map, Value, json};

use super::case::Case;
use super::store::{Store, write_file};

/// A set of materials: its source and size.
#[derive(Clone, Debug, Serialize)]
struct MaterialSet {
    /// Name of the source without its directories.
    source: String,
    materials: usize,
}

/// A schedule of training, with its effort.
#[derive(Clone, Debug, Serialize)]
struct ScheduleAndEffort {
    schedule: Schedule,
    effort: Effort,
}

/// The settings of results, which end every caption.
#[derive(Clone, Debug, Serialize)]
pub(super) struct RunSettings {
    trainings: Vec<ScheduleAndEffort>,
    seed: u64,
    seeds_of_random_methods: u64,
    training_set: MaterialSet,
    test_set: MaterialSet,
}

impl Store<'_> {
    /// Returns the settings of cases on a test set.
    pub(super) fn run_settings(&self, set: usize, cases: &[Case]) -> RunSettings {
        let settings = &self.settings;
        let is_used = |schedule: &Schedule| {
            let mut schedules = cases.iter().map(|case| case.approach.schedule());
            schedules.any(|other| other == Some(*schedule))
        };
        let schedules = [Schedule::Paper, Schedule::Prior].into_iter();
        RunSettings {
            trainings: schedules
                .filter(is_used)
                .map(|schedule| ScheduleAndEffort {
                    schedule,
                    effort: settings.effort_for(schedule),
                })
                .collect(),
            seed: settings.seed,
            seeds_of_random_methods: settings.seeds,
            training_set: MaterialSet {
                source: settings.data.label().to_owned(),
                materials: self.training_count,
            },
            test_set: MaterialSet {
                source: self.sets[set].source.clone(),
                materials: self.sets[set].materials.len(),
            },
        }
    }
}

impl fmt::Display for MaterialSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({} materials)", self.source, self.materials)
    }
}

impl fmt::Display for RunSettings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for ScheduleAndEffort { schedule, effort } in &self.trainings {
            let (name, effort_name) = (schedule.name(), effort.name());
            write!(f, "Schedule {name} at effort {effort_name}")?;
            match (schedule, effort.paper_step_divisor()) {
                (Schedule::Paper, 1) => write!(f, " (all of the paper's steps)")?,
                (Schedule::Paper, divisor) => write!(f, " (1/{divisor} of the paper's steps)")?,
                _ => {}
            }
            write!(f, "; ")?;
        }
        write!(
            f,
            "seed {}, {} seeds of random directions. Training set: {}. Test set: {}.",
            self.seed, self.seeds_of_random_methods, self.training_set, self.test_set
        )
    }
}

/// One finding of an experiment.
enum Finding {
    /// A paragraph.
    Text(String),
    /// A table: the name of its files, the table, and its settings.
    Table(String, Table, RunSettings),
    /// A drawing: the name of its file, the SVG, and its caption.
    Drawing(String, String, String),
    /// Rows of pictures.
    Gallery(Gallery),
}

/// The findings of an experiment, in the order of the page. Every caption ends with the settings of the run.
pub(crate) struct Findings {
    title: &'static str,
    entries: Vec<Finding>,
}

impl Findings {
    pub(super) fn new(title: &'static str) -> Self {
        Self {
            title,
            entries: Vec::new(),
        }
    }

    pub(super) fn text(&mut self, text: &str) {
        self.entries.push(Finding::Text(text.to_owned()));
    }

    /// Adds a table whose files have this name.
    pub(super) fn table(&mut self, name: &str, mut table: Table, settings: RunSettings) {
        table.caption = format!("{}. {settings}", table.caption);
        self.entries
            .push(Finding::Table(name.to_owned(), table, settings));
    }

    /// Adds an SVG drawing whose file has this name.
    pub(super) fn drawing(
        &mut self,
        name: &str,
        svg: String,
        caption: &str,
        settings: &RunSettings,
    ) {
        let caption = format!("{caption}. {settings}");
        self.entries
            .push(Finding::Drawing(name.to_owned(), svg, caption));
    }

    /// Adds rows of pictures.
    pub(super) fn gallery(&mut self, mut gallery: Gallery, settings: &RunSettings) {
        gallery.caption = format!("{}. {settings}", gallery.caption);
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

    /// Writes all findings into the experiment's folder below `out`.
    pub(crate) fn write(&self, experiment: &str, out: &Path) -> anyhow::Result<()> {
        let folder = out.join(experiment);
        let mut page = Page::with_pictures_in(self.title, format!("{experiment}/pictures"));
        let mut tables = Map::new();
        for entry in &self.entries {
            page = match entry {
                Finding::Text(text) => page.paragraph(text),
                Finding::Table(name, table, settings) => {
                    let csv = folder.join(format!("{name}.csv"));
                    write_file(&csv, table.to_csv().as_bytes())?;
                    tables.insert(name.clone(), table_to_json(table, settings));
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
        page.write_section(out, experiment)
            .with_context(|| format!("cannot write the section of {experiment}"))?;
        Ok(())
    }
}

/// Converts a table to JSON: the caption, the settings, and rows as objects with the column titles as keys.
fn table_to_json(table: &Table, settings: &RunSettings) -> Value {
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
        "settings": settings,
        "rows": table.rows.iter().map(row).collect::<Vec<_>>(),
    })
}
