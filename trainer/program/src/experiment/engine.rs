//! The engine of all experiments: an experiment is a list of cases and of their presentation as tables, plots and
//! pictures.

use crate::report::{
    Axis, Cell, Column, Compare, Gallery, GalleryRow, Marker, Plot, Scale, Series, SeriesColor,
    Table, pattern_svg,
};
use glimpse_core::geometry::Angles;
use glimpse_evaluation::evaluation::Report;

use super::case::{Approach, Case};
use super::findings::{Finding, Findings};
use super::store::{Store, TestSet, Work};

/// An experiment as data.
pub(crate) struct Plan {
    pub(super) title: &'static str,
    pub(super) parts: Vec<Part>,
}

/// A part of an experiment.
pub(super) enum Part {
    /// A paragraph.
    Text(String),
    /// A table of evaluations, and its plots.
    Grid(Grid),
    /// Rendered spheres.
    Spheres(Spheres),
    /// A drawing of the pattern of a case.
    Pattern(Case),
}

/// A table whose rows show the evaluations of cases, and plots of its numbers.
pub(super) struct Grid {
    /// Name of the table's files.
    pub(super) name: String,
    pub(super) caption: String,
    /// Index of the test set.
    pub(super) set: usize,
    pub(super) columns: Vec<Column>,
    pub(super) compare: Compare,
    pub(super) rows: Vec<Row>,
    /// Returns the table's rows for a [`Row`].
    pub(super) values: fn(&Evaluated<'_, '_>) -> anyhow::Result<Vec<Vec<Cell>>>,
    pub(super) plots: Vec<PlotOfColumns>,
}

/// Cases that are shown together, and the cells around their values.
#[derive(Default)]
pub(super) struct Row {
    pub(super) labels: Vec<Cell>,
    pub(super) cases: Vec<Case>,
    pub(super) published: Vec<Cell>,
}

/// The evaluations of a [`Row`].
pub(super) struct Evaluated<'r, 's> {
    pub(super) store: &'r Store<'s>,
    pub(super) set: &'r TestSet<'s>,
    pub(super) row: &'r Row,
    /// In the order of the cases.
    pub(super) reports: Vec<Report>,
}

impl Evaluated<'_, '_> {
    /// Returns the mean loss of each case.
    pub(super) fn losses(&self) -> Vec<f64> {
        let reports = self.reports.iter();
        reports.map(|report| report.metrics.loss).collect()
    }

    /// Returns one row: the labels, these values and the published ones.
    pub(super) fn row_of(&self, values: impl IntoIterator<Item = f64>) -> Vec<Vec<Cell>> {
        let values = values.into_iter().map(Cell::Number);
        let labels = self.row.labels.iter().cloned();
        let published = self.row.published.iter().cloned();
        vec![labels.chain(values).chain(published).collect()]
    }
}

/// A plot of columns of a [`Grid`] over another column. Text in that column counts as the row's number from 1; an empty
/// entry is drawn at the right end.
pub(super) struct PlotOfColumns {
    /// Name of the file.
    pub(super) name: String,
    pub(super) title: String,
    pub(super) x: Axis,
    pub(super) x_column: usize,
    /// Name of the metric, whose lower values are better.
    pub(super) metric: &'static str,
    pub(super) lines: Vec<Line>,
}

/// A series of a [`PlotOfColumns`].
pub(super) struct Line {
    pub(super) name: String,
    pub(super) style: (SeriesColor, Marker),
    /// Index of the [`Row`]; None for all rows.
    pub(super) row: Option<usize>,
    pub(super) column: usize,
}

impl Line {
    /// Creates the series of a method, with the method's color and marker.
    pub(super) fn new(approach: Approach, row: Option<usize>, column: usize) -> Self {
        let style = match approach {
            Approach::Random => (SeriesColor::Vermillion, Marker::Cross),
            Approach::Meta => (SeriesColor::Orange, Marker::Triangle),
            Approach::Njr15 => (SeriesColor::Green, Marker::Ring),
            Approach::Paper => (SeriesColor::Blue, Marker::Disc),
            Approach::Glimpse | Approach::Any => (SeriesColor::Black, Marker::Disc),
            Approach::Ggx => (SeriesColor::Vermillion, Marker::Disc),
            Approach::Optimum => (SeriesColor::Purple, Marker::LargeDisc),
        };
        Self {
            name: approach.name().into(),
            style,
            row,
            column,
        }
    }
}

/// Rows of rendered spheres: a material of the test set as the reference, and its fits.
pub(super) struct Spheres {
    pub(super) caption: String,
    pub(super) rows: Vec<SphereRow>,
}

/// A row of [`Spheres`].
pub(super) struct SphereRow {
    /// Title; None for the material's name.
    pub(super) title: Option<String>,
    /// Index of the material.
    pub(super) material: usize,
    /// Cases with their labels.
    pub(super) cases: Vec<(String, Case)>,
}

impl Part {
    fn cases(&self) -> Vec<Case> {
        match self {
            Self::Text(_) => Vec::new(),
            Self::Grid(grid) => grid.rows.iter().flat_map(|row| row.cases.clone()).collect(),
            Self::Spheres(spheres) => {
                let cases = spheres.rows.iter().flat_map(|row| &row.cases);
                cases.map(|(_, case)| *case).collect()
            }
            Self::Pattern(case) => vec![*case],
        }
    }
}

impl Plan {
    /// Returns all trainings and evaluations, each after its prerequisites.
    pub(crate) fn work(&self) -> Vec<Work> {
        let mut all: Vec<Work> = Vec::new();
        for part in &self.parts {
            for case in part.cases() {
                let training = case.training();
                let prerequisite = training.and_then(|training| training.prerequisite());
                let trainings = [prerequisite, training].into_iter().flatten();
                let evaluation = match part {
                    Part::Grid(grid) => Some(Work::Evaluate(grid.set, case)),
                    _ => None,
                };
                for work in trainings.map(Work::Train).chain(evaluation) {
                    if !all.contains(&work) {
                        all.push(work);
                    }
                }
            }
        }
        all
    }

    /// Presents the results. Trains and evaluates what is not stored.
    pub(crate) fn findings(&self, store: &Store<'_>) -> anyhow::Result<Findings> {
        let mut entries = Vec::new();
        for part in &self.parts {
            let set = match part {
                Part::Grid(grid) => grid.set,
                _ => 0,
            };
            let settings = store.describe_settings(set, &part.cases());
            let caption = |text: &str| format!("{text}. {settings}");
            let finding = match part {
                Part::Text(text) => Finding::Text(text.clone()),
                Part::Grid(grid) => {
                    let (mut table, plots) = grid.evaluate(store)?;
                    entries.extend(plots.into_iter().map(|(name, plot)| {
                        Finding::Drawing(name.to_owned(), plot.to_svg(), caption(&plot.title))
                    }));
                    table.caption = caption(&table.caption);
                    Finding::Table(grid.name.clone(), table)
                }
                Part::Spheres(spheres) => {
                    let mut gallery = spheres.render(store)?;
                    gallery.caption = caption(&gallery.caption);
                    Finding::Gallery(gallery)
                }
                Part::Pattern(case) => {
                    let pattern: Vec<Angles<f32>> =
                        store.with_method(case, |method| Ok(method.pattern().to_vec()))?;
                    let (model, approach) = (case.model, case.approach.name());
                    let title = format!("{model}, {approach}, n = {}", case.samples);
                    Finding::Drawing(case.name(), pattern_svg(&pattern), caption(&title))
                }
            };
            entries.push(finding);
        }
        let title = self.title;
        Ok(Findings { title, entries })
    }
}

impl Grid {
    /// Returns the table, and the plots with their names.
    fn evaluate(&self, store: &Store<'_>) -> anyhow::Result<(Table, Vec<(&str, Plot)>)> {
        let mut rows = Vec::new();
        // The index of the `Row` of each row.
        let mut origins = Vec::new();
        for (index, row) in self.rows.iter().enumerate() {
            let cases = row.cases.iter();
            let evaluated = Evaluated {
                store,
                set: &store.sets[self.set],
                row,
                reports: cases
                    .map(|case| store.evaluation(self.set, case))
                    .collect::<anyhow::Result<_>>()?,
            };
            rows.extend((self.values)(&evaluated)?);
            origins.resize(rows.len(), index);
        }
        let plots = self.plots.iter();
        let plots = plots.map(|plot| (&plot.name[..], plot.draw(&rows, &origins)));
        let plots = plots.collect();
        let table = Table {
            caption: self.caption.clone(),
            columns: self.columns.clone(),
            rows,
            compare: self.compare,
        };
        Ok((table, plots))
    }
}

impl PlotOfColumns {
    fn draw(&self, rows: &[Vec<Cell>], origins: &[usize]) -> Plot {
        let number = |row: &[Cell], column: usize| match row.get(column) {
            Some(Cell::Number(number)) => *number,
            _ => f64::NAN,
        };
        let end = rows.iter().map(|row| number(row, self.x_column));
        let end = end.fold(f64::NAN, f64::max);
        let x = |index: usize| match rows[index].get(self.x_column) {
            Some(Cell::Number(number)) => *number,
            Some(Cell::Text(_)) => (index + 1) as f64,
            _ => end,
        };
        let series = |line: &Line| Series {
            name: line.name.clone(),
            color: line.style.0,
            marker: line.style.1,
            points: (0..rows.len())
                .filter(|index| line.row.is_none_or(|row| row == origins[*index]))
                .map(|index| [x(index), number(&rows[index], line.column)])
                .collect(),
        };
        Plot {
            title: self.title.clone(),
            x: self.x.clone(),
            y: Axis {
                title: format!("{} (lower is better)", self.metric),
                scale: Scale::Log10,
            },
            series: self.lines.iter().map(series).collect(),
        }
    }
}

impl Spheres {
    fn render(&self, store: &Store<'_>) -> anyhow::Result<Gallery> {
        let rows = self.rows.iter().map(|row| row.render(store));
        Ok(Gallery {
            caption: self.caption.clone(),
            rows: rows.collect::<anyhow::Result<_>>()?,
        })
    }
}

impl SphereRow {
    /// Fits and renders the material. Marks the fit with the lowest loss.
    fn render(&self, store: &Store<'_>) -> anyhow::Result<GalleryRow> {
        let set = &store.sets[0];
        let material = &*set.materials[self.material];
        let evaluator = set.evaluator();
        let fits = self.cases.iter().map(|(label, case)| {
            let seed = store.settings.seed.wrapping_add(self.material as u64);
            let (metrics, picture) = store.with_method(case, |method| {
                Ok(evaluator.compare(self.material, &method.fit(material, seed)?)?)
            })?;
            Ok((label.clone(), metrics, picture))
        });
        let title = self.title.as_deref().unwrap_or_else(|| material.name());
        let reference = evaluator.reference(self.material).clone();
        let fits = fits.collect::<anyhow::Result<_>>()?;
        Ok(GalleryRow::of_fits(title, reference, fits))
    }
}
