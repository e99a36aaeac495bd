//! The long table of an experiment: a record for each evaluation and for each published value.

use glimpse_core::gonio::Limits;
use glimpse_core::model::ModelKind;
use glimpse_evaluation::evaluation::{EvaluationReport, names};
use glimpse_evaluation::metrics::METRICS;
use glimpse_fitting::route::{Order, Route, TimedMachine, stops};
use serde::de::{Deserialize, Deserializer, Error};
use serde_json::Value;

use super::case::{Approach, Case, Variation};
use super::store::{Store, TestSet};
use crate::report::{Column, Table, text};

/// A row of the long table: a case on a test set, and its values.
#[derive(Clone)]
pub(super) struct Record {
    pub(super) case: Case,
    /// True for the paper's values.
    pub(super) published: bool,
    /// The material with its position in an order, or a group of materials; None for the means over the test set.
    pub(super) material: Option<(usize, String)>,
    /// In the order of [`METRICS`]; NaN if unknown.
    pub(super) metrics: [f64; METRICS.len()],
    /// Increase of the loss by the variation, in percent; NaN if unknown.
    pub(super) increase: f64,
    /// Seconds of a scan with the pattern in the fastest order.
    pub(super) seconds: Option<f64>,
    /// The evaluation that the means are from.
    pub(super) report: Option<EvaluationReport>,
}

/// A column of the long table, or a number that is computed from its rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Key {
    /// The origin of the values: the paper, or this run.
    Source,
    Model,
    Method,
    /// The column of the method in tables with a row for each model.
    Approach,
    Samples,
    Components,
    Variation,
    Material,
    Position,
    /// An index in [`METRICS`], for which the views state the title.
    Metric(#[serde(deserialize_with = "metric_index")] usize),
    /// A number of samples, as a multiple of another, at which a metric is equal.
    Times(#[serde(deserialize_with = "metric_index")] usize),
    /// Standard error of the mean loss over the materials.
    StandardError,
    /// Mean of the loss over the records of a row.
    Mean,
    /// Standard deviation of the loss over the records of a row, in percent of their mean.
    Spread,
    Increase,
    Seconds,
    /// Mean loss divided by the mean of the predicted losses.
    TruthOverPredicted,
    /// Share of materials whose loss is at most its bound.
    BoundHolds,
    /// Share of directions within one predicted standard deviation.
    Coverage,
}

pub(super) const LOSS: Key = Key::Metric(0);

/// Reads the title of a metric.
fn metric_index<'de, D: Deserializer<'de>>(deserializer: D) -> Result<usize, D::Error> {
    let title = String::deserialize(deserializer)?;
    let index = METRICS.iter().position(|metric| metric.title == title);
    index.ok_or_else(|| D::Error::custom(format!("no metric has the title {title}")))
}

impl Key {
    /// Returns the column with the number format of a table.
    pub(super) fn column(self) -> Column {
        match self {
            Self::Source => Column::text("Source"),
            Self::Model => Column::text("Model"),
            Self::Method | Self::Approach => Column::text("Method"),
            Self::Samples => Column::plain("n", 0),
            Self::Components => Column::plain("components", 0),
            Self::Variation => Column::text("Variation"),
            Self::Material => Column::text("Material"),
            Self::Position => {
                Column::plain("material, sorted by the loss of the paper's method", 0)
            }
            Self::Metric(index) => Column::metric(&METRICS[index]),
            Self::Times(index) => Column::plain(format!("{}, x", METRICS[index].title), 1),
            Self::StandardError => Column::plain("Loss: std. error", 4),
            Self::Mean => Column::plain("mean", 4),
            Self::Spread => Column::plain("standard deviation (%)", 1),
            Self::Increase => Column::plain("increase (%)", 1),
            Self::Seconds => Column::plain("seconds", 1),
            Self::TruthOverPredicted => Column::plain("truth / predicted", 2),
            Self::BoundHolds => Column::plain("bound holds", 2),
            Self::Coverage => Column::plain("within one deviation", 2),
        }
    }

    /// Returns the entry of a row: the label that its records share, or the mean of their values.
    pub(super) fn cell(self, records: &[&Record]) -> Value {
        let label = records.first().map(|record| self.label(record));
        if let Some(label @ (Value::String(_) | Value::Number(_))) = label {
            return label;
        }
        let values = records.iter().map(|record| self.value(record));
        let values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        match self {
            _ if values.is_empty() => Value::Null,
            Self::Spread if values.len() < 2 => Value::Null,
            Self::Spread => {
                let squares = values.iter().map(|value| (value - mean).powi(2));
                let deviation = (squares.sum::<f64>() / (count - 1.0)).sqrt();
                (100.0 * deviation / mean).into()
            }
            _ => mean.into(),
        }
    }

    /// Returns the heading of a column or picture for a record.
    pub(super) fn heading(self, record: &Record) -> String {
        let label = self.label(record);
        match self {
            Self::Samples => format!("n = {}", text(&label)),
            _ => text(&label),
        }
    }

    /// Returns the label of a record; null if it has none, or for a value.
    fn label(self, record: &Record) -> Value {
        let case = &record.case;
        let material = record.material.as_ref();
        match self {
            Self::Source if record.published => "published".into(),
            Self::Source => "measured".into(),
            Self::Model => match case.approach {
                Approach::Black | Approach::Ggx => case.method().into(),
                _ => title(case.model).into(),
            },
            Self::Approach => match case.approach {
                Approach::Black => names::RANDOM.into(),
                Approach::Baseline => "Meta, NJR15".into(),
                _ => case.method().into(),
            },
            Self::Method => case.method().into(),
            Self::Samples => record.samples().into(),
            Self::Components => Some(case.components)
                .filter(|_| case.model == ModelKind::Linear)
                .into(),
            Self::Variation => case.variation.to_string().as_str().into(),
            Self::Material => material.map(|(_, name)| name.as_str()).into(),
            Self::Position => material.map(|(position, _)| position + 1).into(),
            _ => Value::Null,
        }
    }

    /// Returns the value of a record; NaN if it has none.
    fn value(self, record: &Record) -> f64 {
        let report = record.report.as_ref();
        let prediction = report.and_then(|report| report.prediction.as_ref());
        let value = match self {
            Self::Metric(index) | Self::Times(index) => Some(record.metrics[index]),
            Self::Mean | Self::Spread => Some(record.metrics[0]),
            Self::Increase => Some(record.increase),
            Self::Seconds => record.seconds,
            Self::StandardError => report.and_then(|report| report.loss_standard_error),
            Self::TruthOverPredicted => {
                prediction.map(|predicted| record.metrics[0] / predicted.loss)
            }
            Self::BoundHolds => prediction.and_then(|prediction| prediction.bound_coverage),
            Self::Coverage => prediction.and_then(|prediction| prediction.coverage),
            _ => None,
        };
        value.unwrap_or(f64::NAN)
    }
}

impl Record {
    /// Creates a record of metrics, of which the last ones may be unknown.
    pub(super) fn new(case: Case, known: &[f64]) -> Self {
        let mut metrics = [f64::NAN; METRICS.len()];
        metrics[..known.len()].copy_from_slice(known);
        Self {
            case,
            published: false,
            material: None,
            metrics,
            increase: f64::NAN,
            seconds: None,
            report: None,
        }
    }

    /// Returns n; None if it is unlimited, or not stated.
    pub(super) fn samples(&self) -> Option<usize> {
        let evaluated = self.report.as_ref().map(|report| report.samples);
        Some(evaluated.unwrap_or(self.case.samples)).filter(|samples| *samples > 0)
    }
}

/// Returns the long table of cases on a test set. `timed` adds the seconds of
/// scans with patterns.
pub(super) fn evaluate(
    store: &Store<'_>,
    set: &TestSet<'_>,
    cases: &[Case],
    timed: bool,
) -> anyhow::Result<Vec<Record>> {
    let mut records: Vec<Record> = Vec::new();
    for &case in cases {
        let components = case.components.min(store.max_components());
        let case = Case { components, ..case };
        let report = store.evaluation(set, &case)?;
        let mut record = Record::new(case, &report.metrics.values());
        let base = case.with(Variation::None);
        if let Some(base) = records.iter().find(|record| record.case == base) {
            record.increase = 100.0 * (record.metrics[0] / base.metrics[0] - 1.0);
        }
        record.seconds = report.seconds;
        if let (true, None, Some(trained)) = (timed, report.seconds, case.trained()) {
            let named = store.recipe(&trained)?;
            let stops = stops(&named.file.recipe(), &Limits::NONE)
                .map_err(|_| anyhow::anyhow!("a sample is below the horizon"))?;
            let (machine, seed) = (TimedMachine::default(), store.settings.seed);
            record.seconds = Some(Route::new(&machine, &stops, Order::Travel, seed).total());
        }
        record.report = Some(report);
        records.push(record);
    }
    Ok(records)
}

/// Returns the long table for a file.
pub(super) fn long_table(records: &[Record]) -> Table {
    let columns = serde_json::from_str(include_str!("columns.json"));
    let columns: Vec<Key> = columns.expect("a test reads the columns");
    let row = |record: &Record| columns.iter().map(|key| key.cell(&[record])).collect();
    let titles: Vec<Column> = columns.iter().map(|key| key.column()).collect();
    Table::new("", titles, records.iter().map(row))
}

/// Returns a model's name as written in the paper.
fn title(model: ModelKind) -> &'static str {
    match model {
        ModelKind::Phong => "Phong",
        ModelKind::CookTorrance => "Cook-Torrance",
        ModelKind::Linear => "Linear",
        ModelKind::Neural => "Neural",
        _ => model.name(),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn unknown_values_are_missing() {
        let case = Case::new(Approach::Glimpse, ModelKind::Linear, 0);
        let record = |loss| Record::new(case, &[loss]);
        let [known, unknown] = [record(0.25), record(f64::NAN)];
        assert_eq!(LOSS.cell(&[&known, &unknown]), json!(0.25));
        for records in [&[][..], &[&unknown], &[&known]] {
            for key in [Key::TruthOverPredicted, Key::BoundHolds, Key::Spread] {
                assert_eq!(key.cell(records), Value::Null, "{key:?}");
            }
        }
    }
}
