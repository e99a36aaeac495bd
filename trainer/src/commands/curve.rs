//! `trainer bench --curve`: what a loss costs in seconds of training.

use std::time::Instant;

use anyhow::Context;
use clap::ValueEnum;
use glimpse_core::model::ModelKind;
use glimpse_materials::basis::Basis;
use glimpse_materials::{Portion, Source};
use glimpse_trainer::evaluation::{Judge, Method};
use glimpse_trainer::report::{Best, Cell, Column, Compare, Table};
use glimpse_training::meta::options::Options;
use glimpse_training::meta::plan::{Effort, Schedule};
use glimpse_training::recipe::recipe_of;

use super::known::tell;
use super::progress::train_with_progress;
use super::{ModelName, load};

/// What is trained, and what it is judged on.
pub(super) struct Curve<'a> {
    pub(super) models: &'a [ModelName],
    pub(super) samples: usize,
    /// The longest effort; all that are shorter come before it.
    pub(super) effort: Effort,
    pub(super) data: &'a Source,
    pub(super) test: &'a Source,
    pub(super) seed: u64,
}

/// One training.
pub(super) struct Point {
    pub(super) model: &'static str,
    pub(super) effort: String,
    pub(super) seconds: f64,
    pub(super) loss: f64,
    pub(super) standard_error: Option<f64>,
}

impl Curve<'_> {
    /// Trains by each effort, and judges.
    pub(super) fn points(&self) -> anyhow::Result<Vec<Point>> {
        let unseen = load(self.test)?;
        let judge = Judge::new(&unseen);
        let longest = self.effort as usize;
        let mut points = Vec::new();
        for model in self.models {
            for effort in Effort::value_variants().iter().take(longest + 1) {
                let value = effort.to_possible_value();
                let name = value.map_or_else(String::new, |value| value.get_name().to_owned());
                let model = ModelKind::from(*model);
                eprintln!("{}, {name} effort", model.name());
                let materials = load(self.data)?;
                let options = Options {
                    portions: vec![Portion::whole(self.data, materials.len())],
                    ..Options::new(model, self.samples, Schedule::Prior, *effort, self.seed)
                };
                let begin = Instant::now();
                let learned = train_with_progress(&options, materials)?;
                let seconds = begin.elapsed().as_secs_f64();
                let file = recipe_of(&learned, &options, self.data.label())?;
                let basis = learned.basis().map(Basis::from_bytes).transpose();
                let basis = basis.map_err(anyhow::Error::msg).context("the basis")?;
                let recipe = file.recipe();
                tell(&recipe, &unseen)?;
                let method = Method::ours(&recipe, basis.as_ref())?;
                let verdict = judge.judge(&method, self.seed, 1)?;
                points.push(Point {
                    model: model.name(),
                    effort: name,
                    seconds,
                    loss: verdict.scores.loss,
                    standard_error: verdict.loss_standard_error,
                });
            }
        }
        Ok(points)
    }
}

/// The curve as a table.
pub(super) fn table(points: &[Point]) -> Table {
    let rows = points.iter().map(|point| {
        vec![
            Cell::Text(point.model.into()),
            Cell::Text(point.effort.clone()),
            Cell::Number(point.seconds),
            Cell::Number(point.loss),
            point.standard_error.map_or(Cell::Missing, Cell::Number),
        ]
    });
    Table {
        caption: "Loss on materials that were not trained on, against seconds of training".into(),
        columns: vec![
            Column::text("model"),
            Column::text("effort"),
            Column::number("seconds", 1, Best::None),
            Column::number("loss", 4, Best::None),
            Column::number("standard error", 4, Best::None),
        ],
        rows: rows.collect(),
        compare: Compare::Down,
    }
}
