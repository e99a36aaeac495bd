//! Reports of evaluations as text and as JSON, with standard errors and warnings about training materials.

use glimpse_core::recipe::Recipe;
use glimpse_trainer::evaluation::{Estimate, Report, TargetReport, TrainingOverlap};
use glimpse_trainer::export::expectation;
use glimpse_trainer::report::{Cell, Column, Compare, Highlight, Table};
use glimpse_training::meta::completion::loss_predictor::rank_correlation;
use glimpse_training::recipe::{Metadata, MetadataError};
use serde_json::{Value, json};

use super::expected_loss::expected_loss;
use super::training_overlap::warnings;

/// The evaluation of a method, with the statements of its recipe.
pub(super) struct MethodReport {
    /// Path of the recipe, if the method has a recipe file.
    pub(super) recipe: Option<String>,
    pub(super) report: Report,
    /// Overlap of each test material with the training materials; None if those are unknown.
    pub(super) overlaps: Option<Vec<Option<TrainingOverlap>>>,
    /// The expected loss that the recipe states.
    pub(super) stated_loss: Option<StatedLoss>,
    /// Scans that end at a target loss.
    pub(super) target: Option<TargetReport>,
}

/// The expected loss that a recipe states.
pub(super) struct StatedLoss {
    text: String,
    json: Value,
}

impl StatedLoss {
    /// Returns the expected loss of a recipe; None if it states none.
    ///
    /// # Errors
    /// If the recipe's metadata is malformed.
    pub(super) fn of(recipe: &Recipe<'_>) -> Result<Option<Self>, MetadataError> {
        let json = expectation(&Metadata::of(recipe)?);
        let json = json.unwrap_or_else(|| json!({ "loss": recipe.expected_loss() }));
        Ok(expected_loss(recipe)?.map(|text| Self { text, json }))
    }
}

impl MethodReport {
    fn names(&self) -> Vec<&str> {
        let materials = self.report.materials.iter();
        materials.map(|material| &material.name[..]).collect()
    }

    /// Returns the overlap of a test material with the training materials.
    fn overlap(&self, index: usize) -> Option<TrainingOverlap> {
        *self.overlaps.as_ref()?.get(index)?
    }

    /// Returns the number of unseen materials and their loss; None if all materials, or none, are unseen.
    fn unseen_loss(&self) -> Option<(usize, Estimate)> {
        let losses = self.report.losses();
        let new: Vec<f64> = losses
            .iter()
            .enumerate()
            .filter(|(index, _)| self.overlap(*index).is_none())
            .map(|(_, loss)| *loss)
            .collect();
        let some = self.overlaps.is_some() && !new.is_empty() && new.len() < losses.len();
        some.then(|| (new.len(), Estimate::from_values(&new)))
    }

    /// Returns the mean predicted loss, and the rank correlation of predicted and true losses.
    fn prediction(&self) -> Option<(f64, Option<f64>)> {
        let predicted = self.report.predicted_losses()?;
        let mean = predicted.iter().sum::<f64>() / predicted.len() as f64;
        Some((mean, rank_correlation(&predicted, &self.report.losses())))
    }

    /// Returns remarks about training materials, predicted losses and the stated loss.
    fn remarks(&self) -> Vec<String> {
        let mut remarks = warnings(self.overlaps.as_deref(), &self.names());
        if let Some((count, estimate)) = self.unseen_loss() {
            remarks.push(format!(
                "mean loss over the {count} unseen materials: {}",
                describe_estimate(estimate)
            ));
        }
        if let Some((mean, rank)) = self.prediction() {
            let rank = rank.map_or(String::new(), |rank| {
                format!("; rank correlation of predicted and true losses: {rank:.2}")
            });
            remarks.push(format!(
                "mean loss predicted from the readings: {mean:.4}{rank}"
            ));
        }
        if let Some(coverage) = self.report.bound_coverage() {
            remarks.push(format!(
                "the loss is at most its bound for {:.0} % of the materials (expected: 90 %)",
                100.0 * coverage
            ));
        }
        remarks.extend(self.target.as_ref().map(describe_target));
        if let Some(stated) = &self.stated_loss {
            remarks.push(format!("expected loss of the recipe: {}", stated.text));
        }
        remarks
    }

    /// Formats a table with a line for each material, the mean, its standard error, and remarks.
    pub(super) fn to_text(&self) -> String {
        let report = &self.report;
        let width = self.names().iter().map(|name| name.len()).max();
        let width = width.unwrap_or(0).max(8);
        let mut text = format!(
            "{} {} n = {}\n{:width$} {:>8} {:>8} {:>9} {:>7} {:>8}{}\n",
            report.method,
            report.model,
            report.samples,
            "material",
            "loss",
            "DSSIM",
            "L2",
            "PSNR",
            "delta E",
            match (self.prediction(), report.bound_coverage()) {
                (None, _) => "",
                (Some(_), None) => "  predicted loss",
                (Some(_), Some(_)) => "  predicted loss  at most",
            }
        );
        let materials = report.materials.iter().enumerate();
        let rows = materials.map(|(index, material)| {
            let mark = match (self.overlap(index), material.unlike_training) {
                (Some(TrainingOverlap::SameBrdf), _) => "  training material",
                (Some(TrainingOverlap::SameName), _) => "  same name as a training material",
                (None, Some(true)) => "  unlike the training",
                (None, _) => "",
            };
            (
                &material.name[..],
                material.metrics,
                [material.predicted_loss, material.loss_bound],
                mark,
            )
        });
        let predicted = self.prediction().map(|(mean, _)| mean);
        let mean = [("mean", report.metrics, [predicted, None], "")];
        for (name, scores, predicted, mark) in rows.chain(mean) {
            let [predicted, bound] = predicted;
            let predicted = predicted.map_or(String::new(), |loss| format!("  {loss:14.4}"));
            let bound = bound.map_or(String::new(), |bound| format!("  {bound:7.4}"));
            text += &format!(
                "{name:width$} {:8.4} {:8.4} {:9.6} {:7.2} {:8.4}{predicted}{bound}{mark}\n",
                scores.loss, scores.dssim, scores.l2, scores.psnr, scores.delta_e
            );
        }
        if let Some(error) = report.loss_standard_error {
            text += &format!(
                "standard error of the mean loss, over {} materials: {error:.4}\n",
                report.materials.len()
            );
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

    pub(super) fn to_json(&self) -> serde_json::Result<Value> {
        let mut value = serde_json::to_value(&self.report)?;
        if let Some(recipe) = &self.recipe {
            value["recipe"] = json!(recipe);
        }
        value["prediction"] = json!(self.prediction().map(|(mean, rank)| json!({
            "loss": mean,
            "rank_correlation": rank,
            "bound_coverage": self.report.bound_coverage(),
        })));
        value["promise"] = json!(self.stated_loss.as_ref().map(|stated| &stated.json));
        let names = |kind: TrainingOverlap| {
            let all = self.overlaps.as_ref()?.iter().zip(self.names());
            let of_kind = all.filter(|(overlap, _)| **overlap == Some(kind));
            Some(of_kind.map(|(_, name)| name).collect::<Vec<_>>())
        };
        if let Some(target) = &self.target {
            value["target"] = serde_json::to_value(target)?;
        }
        value["trained_on"] = json!(names(TrainingOverlap::SameBrdf));
        value["namesakes_trained_on"] = json!(names(TrainingOverlap::SameName));
        if let Some((count, estimate)) = self.unseen_loss() {
            value["new"] = json!({
                "materials": count,
                "loss": estimate.mean,
                "loss_standard_error": estimate.standard_error,
            });
        }
        for (index, _) in self.report.materials.iter().enumerate() {
            let is_known = self.overlaps.is_some();
            value["materials"][index]["trained_on"] =
                json!(is_known.then(|| self.overlap(index) == Some(TrainingOverlap::SameBrdf)));
        }
        Ok(value)
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

fn describe_estimate(estimate: Estimate) -> String {
    match estimate.standard_error {
        Some(error) => format!("{:.4} (standard error {error:.4})", estimate.mean),
        None => format!("{:.4}", estimate.mean),
    }
}

/// Compares the losses of two reports on each material. Returns the mean difference, and the number of materials
/// on which `other` has the lower loss.
fn paired_difference(first: &MethodReport, other: &MethodReport) -> (Estimate, usize) {
    let (base, losses) = (first.report.losses(), other.report.losses());
    let better = losses.iter().zip(&base).filter(|(loss, base)| loss < base);
    (
        Estimate::from_paired_differences(&losses, &base),
        better.count(),
    )
}

/// Formats reports on the same materials: a table that compares each with the first, and a table of the losses on
/// each material.
pub(super) fn comparison(all: &[MethodReport]) -> String {
    let number = |number: Option<f64>| number.map_or(Cell::Missing, Cell::Number);
    let name = |report: &MethodReport| report.recipe.clone().unwrap_or_default();
    let materials = all.first().map_or(0, |first| first.report.materials.len());
    let rows = all.iter().enumerate().map(|(index, method_report)| {
        let report = &method_report.report;
        let mut row = vec![
            Cell::Text(name(method_report)),
            Cell::Text(report.model.into()),
            Cell::Number(report.samples as f64),
            Cell::Number(report.metrics.loss),
            number(report.loss_standard_error),
            Cell::Number(report.metrics.dssim),
            Cell::Number(report.metrics.l2),
            Cell::Number(report.metrics.psnr),
            Cell::Number(report.metrics.delta_e),
        ];
        if index > 0 {
            let (difference, better) = paired_difference(&all[0], method_report);
            row.extend([
                Cell::Number(difference.mean),
                number(difference.standard_error),
                Cell::Number(better as f64),
            ]);
        }
        row
    });
    let table = Table {
        caption: String::new(),
        columns: vec![
            Column::text("recipe"),
            Column::text("model"),
            Column::number("n", 0, Highlight::None),
            Column::number("loss", 4, Highlight::Lowest),
            Column::number("std. error", 4, Highlight::None),
            Column::number("DSSIM", 4, Highlight::Lowest),
            Column::number("L2", 6, Highlight::Lowest),
            Column::number("PSNR", 2, Highlight::Highest),
            Column::number("delta E", 4, Highlight::Lowest),
            Column::number("loss - first", 4, Highlight::None),
            Column::number("its std. error", 4, Highlight::None),
            Column::number(format!("less loss on (of {materials})"), 0, Highlight::None),
        ],
        rows: rows.collect(),
        compare: Compare::WithinColumn,
    };
    let losses = Table {
        caption: String::new(),
        columns: [Column::text("loss of")]
            .into_iter()
            .chain(
                all.iter()
                    .map(|report| Column::number(name(report), 4, Highlight::Lowest)),
            )
            .collect(),
        rows: (0..materials)
            .map(|index| {
                let of = |report: &MethodReport| number(report.report.losses().get(index).copied());
                let material = all[0].names()[index];
                [Cell::Text(material.into())]
                    .into_iter()
                    .chain(all.iter().map(of))
                    .collect()
            })
            .collect(),
        compare: Compare::WithinRow,
    };
    let mut text = format!(
        "{}\nDifferences are paired by material; their standard error is over the {materials} \
         differences.\n\n{}",
        table.to_text(),
        losses.to_text()
    );
    for report in all {
        for remark in report.remarks() {
            text += &format!("\n{}: {remark}", name(report));
        }
    }
    text + "\n"
}

/// Returns the content of [`comparison`] as JSON.
pub(super) fn comparison_as_json(all: &[MethodReport]) -> serde_json::Result<Value> {
    let recipes = all.iter().map(MethodReport::to_json);
    let differences = all.iter().skip(1).map(|report| {
        let (difference, better) = paired_difference(&all[0], report);
        json!({
            "recipe": report.recipe,
            "base": all[0].recipe,
            "loss": difference.mean,
            "standard_error": difference.standard_error,
            "less_loss_on": better,
        })
    });
    Ok(json!({
        "recipes": recipes.collect::<serde_json::Result<Vec<_>>>()?,
        "differences": differences.collect::<Vec<_>>(),
    }))
}
