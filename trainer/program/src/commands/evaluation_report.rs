//! Reports of evaluations as text and as JSON, with standard errors and warnings about training materials.

use glimpse_evaluation::evaluation::{Estimate, EvaluationReport, TargetReport, TrainingOverlap};
use glimpse_evaluation::metrics::METRICS;
use glimpse_fitting::measurement::LossScale;
use glimpse_fitting::recipe::expected_loss::ValidatedLoss;
use serde::Serialize;
use serde_json::Value;

use super::expected_loss::{standard_error, with_scale};
use super::training_overlap::warnings;
use crate::report::{Column, Table, metric_columns, metric_row};

/// The evaluation of a recipe.
#[derive(Serialize)]
pub(super) struct RecipeReport {
    /// Path of the recipe.
    pub(super) recipe: String,
    #[serde(flatten)]
    pub(super) report: EvaluationReport,
    /// Losses to compare predicted losses with: means over the materials.
    pub(super) loss_scale: LossScale,
    /// The expected loss that the recipe states.
    pub(super) promise: Option<ValidatedLoss>,
    /// The same as text.
    #[serde(skip)]
    pub(super) stated_loss: Option<String>,
    /// Scans that end at a target loss.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) target: Option<TargetReport>,
}

impl RecipeReport {
    /// Returns remarks about training materials, predicted losses and the stated loss.
    fn remarks(&self) -> Vec<String> {
        let report = &self.report;
        let materials = report.materials.iter();
        let overlaps = materials.map(|material| Some((&material.name[..], material.overlap?)));
        let mut remarks = warnings(&overlaps.collect());
        if let Some(new) = &report.new {
            let error = standard_error(new.loss_standard_error);
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
                "mean loss predicted from the readings: {}{rank}",
                with_scale(prediction.loss as f32, None, &self.loss_scale)
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
        columns.extend(["predicted loss", "at most"].map(|title| Column::plain(title, 4)));
        columns.push(Column::text(""));
        let rows = report.materials.iter().map(|material| {
            let mark = match material.overlap {
                Some(TrainingOverlap::SameBrdf) => Some("training material"),
                Some(TrainingOverlap::SameName) => Some("same name as a training material"),
                _ if material.unlike_training == Some(true) => Some("unlike the training"),
                _ => None,
            };
            let [loss, bound] = [material.predicted_loss, material.loss_bound].map(Value::from);
            let name = [material.name[..].into()];
            metric_row(&name, &material.metrics, &[loss, bound, mark.into()])
        });
        let predicted = report.prediction.as_ref().map(|prediction| prediction.loss);
        let mean = metric_row(&["mean".into()], &report.metrics, &[predicted.into()]);
        let rows = rows.chain([mean]);
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
        let difference = |recipe: &'a RecipeReport| {
            let (base, losses) = (recipes[0].report.losses(), recipe.report.losses());
            let better = losses.iter().zip(&base).filter(|(loss, base)| loss < base);
            let estimate = Estimate::from_paired_differences(&losses, &base);
            Difference {
                recipe: &recipe.recipe,
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
            .map(|(recipe, difference)| {
                let report = &recipe.report;
                let [name, model] = [&recipe.recipe, &report.model].map(|text| text[..].into());
                let mut errors = vec![report.loss_standard_error.into()];
                if let Some(difference) = difference {
                    errors.push(difference.loss.into());
                    errors.push(difference.standard_error.into());
                    errors.push(difference.less_loss_on.into());
                }
                metric_row(
                    &[name, model, report.samples.into()],
                    &report.metrics,
                    &errors,
                )
            });
        let mut text = format!(
            "{}\nDifferences are paired by material; their standard error is over the {count} \
             differences.\n",
            Table::new("", columns, rows).to_markdown()
        );
        for recipe in self.recipes {
            for remark in recipe.remarks() {
                text += &format!("\n{}: {remark}", recipe.recipe);
            }
        }
        text + "\n"
    }
}
