//! Reports of evaluations as text and as JSON, with standard errors and warnings about training materials.

use glimpse_core::recipe::Recipe;
use glimpse_evaluation::evaluation::{Estimate, Report, TargetReport, TrainingOverlap};
use glimpse_evaluation::metrics::METRICS;
use glimpse_fitting::recipe::expected_loss::ValidatedLoss;
use glimpse_fitting::recipe::{Metadata, MetadataError};
use serde::Serialize;

use super::expected_loss::expected_loss;
use super::training_overlap::warnings;
use crate::report::{Cell, Column, Table, metric_columns};

/// The evaluation of a recipe.
#[derive(Serialize)]
pub(super) struct RecipeReport {
    /// Path of the recipe.
    recipe: String,
    #[serde(flatten)]
    report: Report,
    /// The expected loss that the recipe states.
    promise: Option<ValidatedLoss>,
    /// The same as text.
    #[serde(skip)]
    stated_loss: Option<String>,
    /// Scans that end at a target loss.
    #[serde(skip_serializing_if = "Option::is_none")]
    target: Option<TargetReport>,
}

impl RecipeReport {
    /// Creates the report of a recipe.
    ///
    /// # Errors
    /// If the recipe's metadata is malformed.
    pub(super) fn new(
        path: String,
        recipe: &Recipe<'_>,
        report: Report,
        target: Option<TargetReport>,
    ) -> Result<Self, MetadataError> {
        let stated_loss = expected_loss(recipe)?;
        Ok(Self {
            recipe: path,
            report,
            promise: Metadata::of(recipe)?.expected_loss,
            stated_loss,
            target,
        })
    }

    /// Returns remarks about training materials, predicted losses and the stated loss.
    fn remarks(&self) -> Vec<String> {
        let report = &self.report;
        let materials = report.materials.iter();
        let overlaps = materials.map(|material| Some((&material.name[..], material.overlap?)));
        let mut remarks = warnings(&overlaps.collect());
        if let Some(new) = &report.new {
            let error = new.loss_standard_error;
            let error = error.map_or(String::new(), |error| {
                format!(" (standard error {error:.4})")
            });
            remarks.push(format!(
                "mean loss over the {} unseen materials: {:.4}{error}",
                new.materials, new.loss
            ));
        }
        if let Some(prediction) = &report.prediction {
            let rank = prediction.rank_correlation.map_or(String::new(), |rank| {
                format!("; rank correlation of predicted and true losses: {rank:.2}")
            });
            remarks.push(format!(
                "mean loss predicted from the readings: {:.4}{rank}",
                prediction.loss
            ));
            remarks.extend(prediction.bound_coverage.map(|coverage| {
                format!(
                    "the loss is at most its bound for {:.0} % of the materials (expected: 90 %)",
                    100.0 * coverage
                )
            }));
        }
        remarks.extend(self.target.as_ref().map(describe_target));
        let stated = self.stated_loss.iter();
        remarks.extend(stated.map(|text| format!("expected loss of the recipe: {text}")));
        remarks
    }

    /// Formats a table with a line for each material, the mean, its standard error, and remarks.
    pub(super) fn to_text(&self) -> String {
        let report = &self.report;
        let mut columns = vec![Column::text("material")];
        columns.extend(METRICS.map(|metric| Column::plain(metric.title, metric.decimals)));
        if let Some(prediction) = &report.prediction {
            columns.push(Column::plain("predicted loss", 4));
            let bound = prediction.bound_coverage;
            columns.extend(bound.map(|_| Column::plain("at most", 4)));
        }
        let predictions = columns.len() - 1 - METRICS.len();
        columns.push(Column::text(""));
        let row = |name: &str, values: [f64; METRICS.len()], predicted: [_; 2], mark: &str| {
            let mut row = vec![Cell::from(name)];
            row.extend(values.map(Cell::Number));
            row.extend(predicted.map(Cell::from).into_iter().take(predictions));
            row.push(mark.into());
            row
        };
        let mut rows = Vec::new();
        for material in &report.materials {
            let mark = match material.overlap {
                Some(TrainingOverlap::SameBrdf) => "training material",
                Some(TrainingOverlap::SameName) => "same name as a training material",
                _ if material.unlike_training == Some(true) => "unlike the training",
                _ => "",
            };
            let predicted = [material.predicted_loss, material.loss_bound];
            rows.push(row(
                &material.name,
                material.metrics.values(),
                predicted,
                mark,
            ));
        }
        let predicted = report.prediction.as_ref().map(|each| each.loss);
        rows.push(row("mean", report.metrics.values(), [predicted, None], ""));
        let mut text = format!(
            "{} {} n = {}\n{}",
            report.method,
            report.model,
            report.samples,
            Table::new("", columns, rows).to_markdown()
        );
        if let Some(error) = report.loss_standard_error {
            text += &format!(
                "standard error of the mean loss, over {} materials: {error:.4}\n",
                report.materials.len()
            );
        }
        if let Some(seconds) = report.seconds {
            text += &format!("mean time of a scan: {seconds:.1} s\n");
        }
        if report.seeds > 1 {
            text += &format!(
                "means over {} seeds; standard deviation of the loss between seeds: {:.4}\n",
                report.seeds, report.loss_spread
            );
        }
        for remark in self.remarks() {
            text += &format!("{remark}\n");
        }
        text
    }
}

fn describe_target(report: &TargetReport) -> String {
    let held = match (report.early_held, report.early_seconds) {
        (Some(held), Some(seconds)) => format!(
            ", after {seconds:.1} seconds on average; {:.0} % of these have at most this loss",
            100.0 * held
        ),
        _ => String::new(),
    };
    format!(
        "scans that end at a bound of {}: {:.1} of {} readings and {:.1} of {:.1} seconds on average; {:.0} % end \
         early{held}",
        report.target,
        report.readings,
        report.samples,
        report.seconds,
        report.plan_seconds,
        100.0 * report.early_share,
    )
}

/// The reports of several recipes on the same materials.
#[derive(Serialize)]
pub(super) struct Comparison<'a> {
    recipes: &'a [RecipeReport],
    /// The difference of each recipe to the first one.
    differences: Vec<Difference<'a>>,
}

/// The difference of the losses of two recipes, paired by material.
#[derive(Serialize)]
struct Difference<'a> {
    recipe: &'a str,
    base: &'a str,
    /// Mean difference.
    loss: f64,
    standard_error: Option<f64>,
    /// Number of materials on which the recipe has less loss than the base.
    less_loss_on: usize,
}

impl<'a> Comparison<'a> {
    /// Compares at least one report with the first one.
    pub(super) fn new(recipes: &'a [RecipeReport]) -> Self {
        let difference = |each: &'a RecipeReport| {
            let (base, losses) = (recipes[0].report.losses(), each.report.losses());
            let better = losses.iter().zip(&base).filter(|(loss, base)| loss < base);
            let estimate = Estimate::from_paired_differences(&losses, &base);
            Difference {
                recipe: &each.recipe,
                base: &recipes[0].recipe,
                loss: estimate.mean,
                standard_error: estimate.standard_error,
                less_loss_on: better.count(),
            }
        };
        Self {
            recipes,
            differences: recipes.iter().skip(1).map(difference).collect(),
        }
    }

    /// Formats a table that compares each recipe with the first, and remarks.
    pub(super) fn to_text(&self) -> String {
        let count = self.recipes[0].report.materials.len();
        let mut columns = ["recipe", "model"].map(Column::text).to_vec();
        columns.push(Column::plain("n", 0));
        columns.extend(metric_columns());
        columns.extend([
            Column::plain("std. error", 4),
            Column::plain("loss - first", 4),
            Column::plain("its std. error", 4),
            Column::plain(format!("less loss on (of {count})"), 0),
        ]);
        let differences = [None].into_iter().chain(self.differences.iter().map(Some));
        let rows = self
            .recipes
            .iter()
            .zip(differences)
            .map(|(each, difference)| {
                let report = &each.report;
                let mut row = vec![
                    each.recipe[..].into(),
                    report.model[..].into(),
                    report.samples.into(),
                ];
                row.extend(Cell::of_metrics(&report.metrics));
                row.push(report.loss_standard_error.into());
                if let Some(difference) = difference {
                    row.push(difference.loss.into());
                    row.push(difference.standard_error.into());
                    row.push(difference.less_loss_on.into());
                }
                row
            });
        let mut text = format!(
            "{}\nDifferences are paired by material; their standard error is over the {count} \
             differences.\n",
            Table::new("", columns, rows).to_markdown()
        );
        for each in self.recipes {
            for remark in each.remarks() {
                text += &format!("\n{}: {remark}", each.recipe);
            }
        }
        text + "\n"
    }
}
