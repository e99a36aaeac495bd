//! Views of a long table: tables, plots, rendered spheres and drawings of patterns.

use std::path::Path;
use std::ptr;

use glimpse_core::model::ModelKind;
use serde::Deserialize;
use serde_json::Value;

use super::case::{Approach, Case};
use super::glossiness::by_glossiness;
use super::record::{Key, LOSS, Record};
use super::store::Store;
use crate::report::{
    Column, Compare, GalleryRow, Highlight, Page, Plot, Scale, Series, Table, pattern_svg, text,
    write_file,
};

/// A view of some records.
#[derive(Deserialize)]
pub(super) struct View {
    /// Name of the files; with `by_model`, the model's name follows. The files of plots begin with the name of the metric, so it
    /// is empty for them.
    #[serde(default)]
    name: String,
    caption: String,
    #[serde(default)]
    of: Filter,
    /// True if each model has a view of its own.
    #[serde(default)]
    by_model: bool,
    #[serde(flatten)]
    form: Form,
}

/// The form of a view.
#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Form {
    /// A table: the labels of a row, the other columns, and the numbers that are compared.
    Table {
        rows: Vec<Key>,
        columns: Vec<Columns>,
        compare: Option<Compare>,
    },
    /// A plot of each of the values over x, with a line for each label.
    Plots {
        x: Key,
        values: Vec<Key>,
        by: Vec<Key>,
    },
    /// Spheres of a number of materials of the test set from diffuse to glossy, or of the glossiest one: the labels of a row,
    /// and that of a picture.
    Spheres {
        count: usize,
        rows: Vec<Key>,
        tile: Key,
    },
    /// Drawings of the pattern of each record.
    Patterns,
}

/// Columns of a table after the labels.
#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Columns {
    /// Values for each label of some keys, of this run and then of the paper.
    By(Vec<Key>, Vec<Key>),
    /// A title, the records with the value, the value, and its decimals.
    Named {
        title: String,
        of: Filter,
        value: Key,
        decimals: usize,
    },
}

/// A choice of records.
#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Filter {
    /// True without the paper's values.
    measured: bool,
    /// The methods; empty for all.
    approaches: Vec<Approach>,
    /// The model; None for all.
    model: Option<ModelKind>,
    /// The smallest and the largest n; None for all.
    samples: Option<[usize; 2]>,
}

impl Filter {
    fn contains(&self, record: &Record) -> bool {
        let Case {
            approach, model, ..
        } = record.case;
        let is_within = |[least, most]: [usize; 2]| {
            let samples = record.samples();
            samples.is_some_and(|samples| (least..=most).contains(&samples))
        };
        !(self.measured && record.published)
            && (self.approaches.is_empty() || self.approaches.contains(&approach))
            && self.model.is_none_or(|only| only == model)
            && self.samples.is_none_or(is_within)
    }
}

/// The presentation of an experiment's results: a page, and files in its folder.
pub(super) struct Output<'a> {
    pub(super) folder: &'a Path,
    pub(super) page: Page,
    /// The tables of the page, with the names of their files.
    pub(super) tables: Vec<(String, Table)>,
}

impl Output<'_> {
    /// Writes a file into the folder.
    pub(super) fn write(&self, name: &str, text: &str) -> anyhow::Result<()> {
        write_file(&self.folder.join(name), text.as_bytes())
    }

    fn drawing(&mut self, name: &str, svg: &str, caption: &str) -> anyhow::Result<()> {
        self.page.drawing(svg, caption);
        self.write(&format!("{name}.svg"), svg)
    }
}

impl View {
    /// Shows records. `suffix` is appended to names of files, and `settings` to captions.
    pub(super) fn show(
        &self,
        store: &Store<'_>,
        records: &[Record],
        [suffix, settings]: [&str; 2],
        output: &mut Output<'_>,
    ) -> anyhow::Result<()> {
        let shown = records.iter().filter(|record| self.of.contains(record));
        let shown: Vec<&Record> = shown.collect();
        let keys: &[Key] = if self.by_model { &[Key::Model] } else { &[] };
        for (model, records) in groups(&shown, keys) {
            let title = joined(&model, &self.caption);
            let caption = format!("{title}. {settings}");
            let slug = model
                .iter()
                .map(|label| format!("-{}", text(label).to_lowercase()));
            let name = self.name.clone() + &slug.collect::<String>() + suffix;
            match &self.form {
                Form::Table {
                    rows,
                    columns,
                    compare,
                } => {
                    let table = Table {
                        caption,
                        ..table(&records, rows, columns, *compare)
                    };
                    output.page.table(&table);
                    output.write(&format!("{name}.csv"), &table.to_csv())?;
                    output.tables.push((name, table));
                }
                Form::Plots { x, values, by } => {
                    for y in values {
                        let plot = plot(&records, *x, *y, by, &title);
                        let metric = y.column().title.to_lowercase().replace(' ', "-");
                        output.drawing(&format!("{metric}{name}"), &plot.to_svg(), &caption)?;
                    }
                }
                Form::Spheres { count, rows, tile } => {
                    let rows = spheres(store, &records, *count, rows, *tile)?;
                    output.page.gallery(&caption, &rows);
                }
                Form::Patterns => {
                    for case in records.iter().map(|record| &record.case) {
                        let svg =
                            store.with_method(case, |method| Ok(pattern_svg(method.pattern())))?;
                        output.drawing(&case.name(), &svg, &case.name())?;
                    }
                }
            }
        }
        Ok(())
    }
}

/// Groups records by their labels, in the order of their first appearance.
fn groups<'r>(records: &[&'r Record], keys: &[Key]) -> Vec<(Vec<Value>, Vec<&'r Record>)> {
    let mut groups: Vec<(Vec<Value>, Vec<&Record>)> = Vec::new();
    for record in records {
        let labels: Vec<Value> = keys.iter().map(|key| key.cell(&[record])).collect();
        match groups.iter_mut().find(|(other, _)| *other == labels) {
            Some((_, group)) => group.push(record),
            None => groups.push((labels, vec![record])),
        }
    }
    groups
}

/// Joins labels, and a text unless it is empty.
fn joined(labels: &[Value], end: &str) -> String {
    let labels = labels.iter().map(text);
    let words = labels.chain([end.to_owned()]);
    let words: Vec<String> = words.filter(|word| !word.is_empty()).collect();
    words.join(", ")
}

/// A column of a table, the records that it shows, and their value.
type Shown<'r> = (Column, Vec<&'r Record>, Key);

fn table(
    records: &[&Record],
    rows: &[Key],
    columns: &[Columns],
    compare: Option<Compare>,
) -> Table {
    let shown = columns.iter().flat_map(|columns| columns.shown(records));
    let mut shown: Vec<Shown<'_>> = shown.collect();
    shown.sort_by_key(|(column, ..)| column.title.starts_with(PUBLISHED));
    for (column, _, value) in &mut shown {
        // In a row, only losses have a common scale.
        if compare.is_none() || compare == Some(Compare::WithinRow) && *value != LOSS {
            column.highlight = Highlight::None;
        }
    }
    let entries = groups(records, rows).into_iter().map(|(labels, records)| {
        let cells = shown.iter().map(|(_, shown, value)| {
            let mut both = shown.clone();
            both.retain(|record| records.iter().any(|other| ptr::eq(*record, *other)));
            value.cell(&both)
        });
        labels.into_iter().chain(cells).collect()
    });
    let entries: Vec<Vec<Value>> = entries.collect();
    let labels = rows.iter().map(|key| key.column());
    let columns = labels.chain(shown.into_iter().map(|(column, ..)| column));
    Table {
        compare: compare.unwrap_or(Compare::WithinColumn),
        ..Table::new("", columns.collect::<Vec<_>>(), entries)
    }
}

/// The beginning of the titles of columns with the paper's values.
const PUBLISHED: &str = "paper: ";

impl Columns {
    /// Returns the columns with the records that each shows.
    fn shown<'r>(&self, records: &[&'r Record]) -> Vec<Shown<'r>> {
        let mut records = records.to_vec();
        let (keys, values) = match self {
            Self::By(keys, values) => (keys, values),
            Self::Named {
                title,
                of,
                value,
                decimals,
            } => {
                records.retain(|record| of.contains(record));
                let column = Column {
                    title: title.clone(),
                    decimals: *decimals,
                    ..value.column()
                };
                return vec![(column, records, *value)];
            }
        };
        let groups = groups(&records, &[&[Key::Source], &keys[..]].concat());
        let all = values
            .iter()
            .flat_map(|value| groups.iter().map(move |group| (*value, group)));
        let known = all.filter(|(value, (_, records))| value.cell(records) != Value::Null);
        let shown = known.map(|(value, (_, records))| {
            let mut column = value.column();
            let words = keys.iter().map(|key| key.heading(records[0]));
            let mut words: Vec<String> = words.collect();
            if words.is_empty() || value != LOSS {
                words.push(column.title);
            }
            column.title = words.join(": ");
            if records[0].published {
                let title = PUBLISHED.to_owned() + &column.title;
                column = Column::plain(title, column.decimals.min(3));
            }
            (column, records.clone(), value)
        });
        shown.collect()
    }
}

fn plot(records: &[&Record], x: Key, y: Key, by: &[Key], title: &str) -> Plot {
    let number = |key: Key, record: &Record| key.cell(&[record]).as_f64();
    // An unlimited n is drawn at the right end.
    let known = records.iter().filter_map(|record| number(x, record));
    let end = known.fold(f64::NAN, f64::max);
    let series = groups(records, by).into_iter().enumerate();
    let series = series.map(|(color, (labels, records))| Series {
        name: joined(&labels, ""),
        color,
        is_dashed: false,
        points: records
            .iter()
            .map(|record| {
                let y = number(y, record).unwrap_or(f64::NAN);
                [number(x, record).unwrap_or(end), y]
            })
            .collect(),
    });
    let scale = match x {
        Key::Samples => Scale::Log2,
        Key::Position => Scale::Linear,
        _ => Scale::Log10,
    };
    Plot {
        title: title.to_owned(),
        x: (x.column().title, scale),
        y: format!("{} (lower is better)", y.column().title),
        series: series.collect(),
    }
}

/// Fits and renders materials. Marks the fit with the lowest loss of a row.
fn spheres(
    store: &Store<'_>,
    records: &[&Record],
    count: usize,
    rows: &[Key],
    tile: Key,
) -> anyhow::Result<Vec<GalleryRow>> {
    let set = &store.sets[0];
    let evaluator = set.evaluator();
    let order = by_glossiness(set.materials, store.settings.seed);
    let mut gallery = Vec::new();
    let count = count.min(order.len());
    let position = |index: usize| match count - 1 {
        0 => order.len() - 1,
        last => index * (order.len() - 1) / last,
    };
    for material in (0..count).map(|index| order[position(index)]) {
        let reference = &*set.materials[material];
        for (labels, records) in groups(records, rows) {
            let fits = records.iter().map(|record| {
                let seed = store.settings.seed.wrapping_add(material as u64);
                let (metrics, picture) = store.with_method(&record.case, |method| {
                    Ok(evaluator.compare(material, &*method.fit(reference, seed)?.fitted))
                })?;
                Ok((tile.heading(record), metrics, picture))
            });
            let fits = fits.collect::<anyhow::Result<_>>()?;
            let title = [&[reference.name().into()], &labels[..]].concat();
            let picture = evaluator.reference(material).clone();
            gallery.push(GalleryRow::of_fits(&joined(&title, ""), picture, fits));
        }
    }
    Ok(gallery)
}

#[cfg(test)]
mod tests {
    use glimpse_materials::MODELS;

    use super::super::case::Variation;
    use super::*;

    #[test]
    fn table_has_columns_by_label_and_then_published_ones() {
        let record = |seed, loss| {
            let case = Case::new(Approach::Paper, MODELS[0], 8);
            Record::new(case.with(Variation::Seed(seed)), &[loss])
        };
        let published = Record {
            published: true,
            ..record(1, 0.5)
        };
        let records = [published, record(1, 0.25), record(2, 0.75)];
        let columns = [
            Columns::By(vec![Key::Variation], vec![LOSS]),
            Columns::By(vec![], vec![Key::Spread]),
            Columns::Named {
                title: "none".to_owned(),
                of: Filter {
                    approaches: vec![Approach::Black],
                    ..Filter::default()
                },
                value: LOSS,
                decimals: 4,
            },
        ];
        let records: Vec<&Record> = records.iter().collect();
        let table = table(&records, &[Key::Model], &columns, None);
        let expected = "Model,seed + 1,seed + 2,standard deviation (%),none,paper: seed + 1\r\n\
                        Phong,0.25,0.75,70.71067811865476,,0.5\r\n";
        assert_eq!(table.to_csv(), expected);
    }
}
