//! Verdicts as text and as JSON: each with how far it can be relied on.

use glimpse_core::recipe::{Recipe, RecipeError};
use glimpse_trainer::evaluation::{Estimate, Known, Report};
use glimpse_trainer::report::{Best, Cell, Column, Compare, Table};
use glimpse_training::meta::completion::loss_predictor::rank_correlation;
use serde_json::{Value, json};

use super::expected_loss::expected_loss;
use super::known::lines;

/// What a method has been found to do, and what is known besides.
pub(super) struct MethodReport {
    /// The recipe's file, if it came from one.
    pub(super) recipe: Option<String>,
    pub(super) report: Report,
    /// Which of the materials were trained on; None if that cannot be told.
    pub(super) known: Option<Vec<Option<Known>>>,
    /// What the recipe promised, in words and as JSON.
    pub(super) promise: Option<(String, Value)>,
}

/// What a recipe promises, in words and as JSON.
pub(super) fn promised(recipe: &Recipe<'_>) -> Result<Option<(String, Value)>, RecipeError> {
    let Some(expectation) = recipe.metadata()?.expectation else {
        return Ok(None);
    };
    let json = json!({
        "loss": expectation.loss,
        "standard_error": expectation.standard_error,
        "materials": expectation.materials,
        "on": expectation.on,
    });
    Ok(expected_loss(recipe)?.map(|words| (words, json)))
}

impl MethodReport {
    fn names(&self) -> Vec<&str> {
        let materials = self.report.materials.iter();
        materials.map(|material| &material.name[..]).collect()
    }

    /// How a material is known.
    fn known(&self, index: usize) -> Option<Known> {
        *self.known.as_ref()?.get(index)?
    }

    /// The loss over the materials that are new, if there are some beside others that are not.
    fn loss_of_the_new(&self) -> Option<(usize, Estimate)> {
        let losses = self.report.losses();
        let new: Vec<f64> = losses
            .iter()
            .enumerate()
            .filter(|(index, _)| self.known(*index).is_none())
            .map(|(_, loss)| *loss)
            .collect();
        let some = self.known.is_some() && !new.is_empty() && new.len() < losses.len();
        some.then(|| (new.len(), Estimate::of(&new)))
    }

    /// The mean loss that is predicted, and how well it ranks the materials.
    fn prediction(&self) -> Option<(f64, Option<f64>)> {
        let predicted = self.report.predicted_losses()?;
        let mean = predicted.iter().sum::<f64>() / predicted.len() as f64;
        Some((mean, rank_correlation(&predicted, &self.report.losses())))
    }

    /// What there is to be said of the materials, and of what was promised.
    fn remarks(&self) -> Vec<String> {
        let mut remarks = lines(self.known.as_deref(), &self.names());
        if let Some((count, estimate)) = self.loss_of_the_new() {
            remarks.push(format!(
                "over the {count} that are new: a mean loss of {}",
                in_words(estimate)
            ));
        }
        if let Some((mean, rank)) = self.prediction() {
            let rank = rank.map_or(String::new(), |rank| {
                format!("; their ranks correlate with those of the true ones by {rank:.2}")
            });
            remarks.push(format!(
                "the losses predicted from the readings have a mean of {mean:.4}{rank}"
            ));
        }
        if let Some((promise, _)) = &self.promise {
            remarks.push(format!("the recipe promises {promise}"));
        }
        remarks
    }

    /// A line for each material, the mean, and how far that can be relied on.
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
            if self.prediction().is_some() {
                "  predicted loss"
            } else {
                ""
            }
        );
        let materials = report.materials.iter().enumerate();
        let rows = materials.map(|(index, material)| {
            let mark = match self.known(index) {
                Some(Known::Same) => "  trained on",
                Some(Known::Namesake) => "  namesake trained on",
                None => "",
            };
            (
                &material.name[..],
                material.scores,
                material.predicted_loss,
                mark,
            )
        });
        let predicted = self.prediction().map(|(mean, _)| mean);
        let mean = [("mean", report.scores, predicted, "")];
        for (name, scores, predicted, mark) in rows.chain(mean) {
            let predicted = predicted.map_or(String::new(), |loss| format!("  {loss:14.4}"));
            text += &format!(
                "{name:width$} {:8.4} {:8.4} {:9.6} {:7.2} {:8.4}{predicted}{mark}\n",
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
                "mean of {} seeds; the loss has a standard deviation of {:.4} from seed to seed\n",
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
        })));
        value["promise"] = json!(self.promise.as_ref().map(|(_, json)| json));
        let names = |kind: Known| {
            let all = self.known.as_ref()?.iter().zip(self.names());
            let of_kind = all.filter(|(known, _)| **known == Some(kind));
            Some(of_kind.map(|(_, name)| name).collect::<Vec<_>>())
        };
        value["trained_on"] = json!(names(Known::Same));
        value["namesakes_trained_on"] = json!(names(Known::Namesake));
        if let Some((count, estimate)) = self.loss_of_the_new() {
            value["new"] = json!({
                "materials": count,
                "loss": estimate.mean,
                "loss_standard_error": estimate.standard_error,
            });
        }
        for (index, _) in self.report.materials.iter().enumerate() {
            let same = self.known.is_some();
            value["materials"][index]["trained_on"] =
                json!(same.then(|| self.known(index) == Some(Known::Same)));
        }
        Ok(value)
    }
}

fn in_words(estimate: Estimate) -> String {
    match estimate.standard_error {
        Some(error) => format!("{:.4} (standard error {error:.4})", estimate.mean),
        None => format!("{:.4}", estimate.mean),
    }
}

/// Less loss than the first one, material by material; and on how many of them there is less.
fn against(first: &MethodReport, other: &MethodReport) -> (Estimate, usize) {
    let (base, losses) = (first.report.losses(), other.report.losses());
    let better = losses.iter().zip(&base).filter(|(loss, base)| loss < base);
    (Estimate::of_differences(&losses, &base), better.count())
}

/// Several recipes on the same materials: in one table, the first one being what the others are
/// compared with, and the loss of each material beneath.
pub(super) fn comparison(all: &[MethodReport]) -> String {
    let number = |number: Option<f64>| number.map_or(Cell::Missing, Cell::Number);
    let name = |judged: &MethodReport| judged.recipe.clone().unwrap_or_default();
    let materials = all.first().map_or(0, |first| first.report.materials.len());
    let rows = all.iter().enumerate().map(|(index, judged)| {
        let report = &judged.report;
        let mut row = vec![
            Cell::Text(name(judged)),
            Cell::Text(report.model.into()),
            Cell::Number(report.samples as f64),
            Cell::Number(report.scores.loss),
            number(report.loss_standard_error),
            Cell::Number(report.scores.dssim),
            Cell::Number(report.scores.l2),
            Cell::Number(report.scores.psnr),
            Cell::Number(report.scores.delta_e),
        ];
        if index > 0 {
            let (difference, better) = against(&all[0], judged);
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
            Column::number("n", 0, Best::None),
            Column::number("loss", 4, Best::Least),
            Column::number("std. error", 4, Best::None),
            Column::number("DSSIM", 4, Best::Least),
            Column::number("L2", 6, Best::Least),
            Column::number("PSNR", 2, Best::Greatest),
            Column::number("delta E", 4, Best::Least),
            Column::number("loss - first", 4, Best::None),
            Column::number("its std. error", 4, Best::None),
            Column::number(format!("less loss on (of {materials})"), 0, Best::None),
        ],
        rows: rows.collect(),
        compare: Compare::Down,
    };
    let losses = Table {
        caption: String::new(),
        columns: [Column::text("loss of")]
            .into_iter()
            .chain(
                all.iter()
                    .map(|judged| Column::number(name(judged), 4, Best::Least)),
            )
            .collect(),
        rows: (0..materials)
            .map(|index| {
                let of = |judged: &MethodReport| number(judged.report.losses().get(index).copied());
                let material = all[0].names()[index];
                [Cell::Text(material.into())]
                    .into_iter()
                    .chain(all.iter().map(of))
                    .collect()
            })
            .collect(),
        compare: Compare::Across,
    };
    let mut text = format!(
        "{}\nDifferences are paired, material by material: their standard error is over the \
         {materials} differences.\n\n{}",
        table.to_text(),
        losses.to_text()
    );
    for judged in all {
        for remark in judged.remarks() {
            text += &format!("\n{}: {remark}", name(judged));
        }
    }
    text + "\n"
}

/// The same as JSON.
pub(super) fn comparison_as_json(all: &[MethodReport]) -> serde_json::Result<Value> {
    let recipes = all.iter().map(MethodReport::to_json);
    let differences = all.iter().skip(1).map(|judged| {
        let (difference, better) = against(&all[0], judged);
        json!({
            "recipe": judged.recipe,
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
