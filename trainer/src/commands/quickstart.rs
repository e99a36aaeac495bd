//! `trainer quickstart`

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, anyhow, bail};
use clap::Args;
use glimpse_core::gonio::Limits;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;
use glimpse_materials::files::try_write;
use glimpse_materials::{Material, Source};
use glimpse_trainer::bundled::{self, BundledRecipe};
use glimpse_trainer::evaluation::{Evaluator, Method, SPHERE};
use glimpse_trainer::metrics::Metrics;
use glimpse_trainer::render::Picture;
use glimpse_trainer::report::{
    Best, Cell, Column, Compare, Gallery, GalleryRow, Page, Table, Tile, pattern_svg,
};
use glimpse_trainer::route::{Machine, Order, Route, stops};
use glimpse_training::meta::plan::Effort;
use glimpse_training::meta::run::INNER_STEPS;
use rayon::prelude::*;

use super::lock::Lock;
use super::output::{make_out, write_file};
use super::{load, print};

/// Number of unseen materials.
const UNSEEN: usize = 8;
/// Bundled recipes of growing n.
const BY_SAMPLES: [&str; 5] = [
    "neural-n1",
    "neural-n2",
    "neural-n4",
    "neural-n8",
    "neural-n16",
];
/// The bundled recipe that is compared with the paper's methods, and left for the next step.
const COMPARED: &str = "neural-n8";

/// Scan unseen materials with bundled recipes and write a page of results: start here.
///
/// Eight procedural materials that no bundled recipe was trained on are measured and fitted as a
/// scanner's microcontroller would do it. The page DIR/index.html shows
///
/// - recipes of the model neural for n = 1, 2, 4, 8 and 16 measurements: errors, seconds of scan
///   (by the rules of `trainer plan`) and cycles of the fit on a Cortex-M4F;
/// - the paper's methods at n = 8, trained by the paper's schedule, beside the recipe of n = 8.
///
/// Nothing is trained: it takes some seconds. DIR/neural-n8.recipe is the bundled recipe of n = 8, to try
/// other commands on, such as `trainer plan` and `trainer inspect`.
///
/// Example: trainer quickstart
///          trainer quickstart --seed 7 --out other/
///          trainer plan quickstart/neural-n8.recipe
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Quickstart {
    /// The folder for index.html, its pictures and the recipe
    #[arg(long, short, value_name = "DIR", default_value = "quickstart")]
    out: PathBuf,
}

impl Quickstart {
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        let begin = Instant::now();
        make_out(&self.out)?;
        let index = self.out.join("index.html");
        try_write(&index, 1 << 16)
            .map_err(|error| anyhow!("cannot write {}: {error}", index.display()))?;
        let _lock = Lock::within(&self.out)?;
        let left = bundled(COMPARED)?;
        let path = self.out.join(format!("{COMPARED}.recipe"));
        write_file(&path, left.bytes)?;

        // Seed 0 is that of the materials that bundled recipes were trained on.
        let source = Source(format!(
            "procedural:{UNSEEN}:{}",
            seed.wrapping_add(1).max(1)
        ));
        let unseen = load(&source)?;
        let judge = Evaluator::new(&unseen);

        eprintln!(
            "scanning {UNSEEN} unseen materials with {}",
            BY_SAMPLES.join(", ")
        );
        let mut by_samples = Vec::new();
        for name in BY_SAMPLES {
            by_samples.push(Contender::bundled(bundled(name)?, seed)?);
        }
        let scans_by_samples = scan_all(&judge, &by_samples, seed)?;

        eprintln!("scanning them with the paper's methods");
        let paper = &bundled::PAPER;
        let recipe = paper.recipe()?;
        let methods = [
            Contender {
                label: "Random".into(),
                method: Method::random(ModelKind::Neural, recipe.samples(), INNER_STEPS),
                training: None,
                bundled: None,
                seconds: None,
            },
            Contender {
                label: "Meta (paper)".into(),
                method: Method::meta(&recipe, None)?,
                training: Some(training_of(&recipe)?),
                bundled: None,
                seconds: None,
            },
            Contender {
                label: "Ours (paper)".into(),
                ..Contender::bundled(paper, seed)?
            },
            Contender {
                label: "Completed (prior)".into(),
                ..Contender::bundled(left, seed)?
            },
        ];
        let scans_of_methods = scan_all(&judge, &methods, seed)?;

        let caption = |contenders: &[Contender<'_>]| {
            format!(
                "Training: {}. Test set: {source} ({UNSEEN} materials)",
                trainings(contenders)
            )
        };
        let first = table(
            format!(
                "Bundled recipes of the model neural. {}",
                caption(&by_samples)
            ),
            &by_samples,
            &scans_by_samples,
        );
        let second = table(
            format!(
                "Neural, n = {}, with the schedule in parentheses. {}",
                recipe.samples(),
                caption(&methods)
            ),
            &methods,
            &scans_of_methods,
        );
        let pattern: Vec<_> = left.recipe()?.pattern().collect();
        Page::new("Glimpse: materials from few measurements")
            .paragraph(INTRODUCTION)
            .table(&first)
            .paragraph(&about_costs())
            .heading("Spheres by number of measurements")
            .gallery(&gallery(
                caption(&by_samples),
                &judge,
                &by_samples,
                &scans_by_samples,
            ))
            .heading("The paper's methods")
            .gallery(&gallery(
                caption(&methods),
                &judge,
                &methods,
                &scans_of_methods,
            ))
            .table(&second)
            .paragraph(&about_methods())
            .heading("Directions of a recipe")
            .drawing(
                &pattern_svg(&pattern),
                &format!(
                    "The directions of {COMPARED}, {}",
                    training_of(&left.recipe()?)?
                ),
            )
            .heading("Next: your own materials")
            .paragraph(NEXT)
            .code(COMMAND)
            .write(&self.out)?;
        print(&format!(
            "{}\n{}\n{}\n{}\n{NEXT}\n  {COMMAND}\n",
            first.caption,
            first.to_text(),
            second.caption,
            second.to_text()
        ))?;
        eprintln!(
            "wrote {} in {:.0} s",
            index.display(),
            begin.elapsed().as_secs_f64()
        );
        Ok(())
    }
}

const INTRODUCTION: &str = "A recipe has learned where to measure a material and how to fit a small \
    network to the readings. Here bundled recipes for 1, 2, 4, 8 and 16 pairs of directions meet eight \
    materials that they were not trained on. Each material is measured without noise and fitted as a \
    scanner's microcontroller would do it.";
const NEXT: &str =
    "Train a recipe for your own materials at standard effort, in about two minutes on two cores:";
const COMMAND: &str = "trainer train --model neural --samples 8 --data YOUR/ --out mine.recipe";

fn about_costs() -> String {
    let machine = Machine::default();
    format!(
        "Loss is the paper's: the mean cosine-weighted logarithmic error over directions that are uniform in \
         (theta_h, theta_d, phi_d). DSSIM and PSNR compare the pictures below, of {SPHERE} x {SPHERE} pixels. \
         The time of a scan is that of motion and settling in the fastest order, at {} degrees per second and \
         {} s at each sample, from all axes at 0. Cycles are those of one fit on a Cortex-M4F, for recipes that \
         the firmware's tests measure.",
        machine.speeds.theta_i, machine.settle
    )
}

fn about_methods() -> String {
    format!(
        "Random is classic learning: a random start, and one draw of random directions for each material. Meta \
         has a learned start and learned step sizes, and random directions. Ours has learned directions too. \
         These three take {INNER_STEPS} steps. Schedule paper takes 1/{} of the paper's steps at effort \
         standard. Completed has a learned map that completes the readings, and takes one step; its recipe is for noisy readings and for arms with limits, \
         those of the paper's methods are not.",
        Effort::Standard.divisor_of_the_paper_s_steps()
    )
}

fn bundled(name: &str) -> anyhow::Result<&'static BundledRecipe> {
    bundled::find(name).with_context(|| format!("no recipe {name} is bundled"))
}

/// A method that scans the materials.
struct Contender<'a> {
    label: String,
    method: Method<'a>,
    /// Schedule, effort and training set, if it was trained.
    training: Option<String>,
    /// The bundled recipe that scans, if one does.
    bundled: Option<&'static BundledRecipe>,
    /// Seconds of a scan, if the directions are the same for all materials.
    seconds: Option<f64>,
}

impl Contender<'static> {
    /// The scan by a bundled recipe that needs no basis.
    fn bundled(bundled: &'static BundledRecipe, seed: u64) -> anyhow::Result<Self> {
        let recipe = bundled.recipe()?;
        Ok(Self {
            label: bundled.name.into(),
            method: Method::ours(&recipe, None)?,
            training: Some(training_of(&recipe)?),
            bundled: Some(bundled),
            seconds: Some(seconds_of_scan(&recipe, seed)?),
        })
    }
}

/// Schedule, effort and training set of a recipe.
fn training_of(recipe: &Recipe<'_>) -> anyhow::Result<String> {
    let training = recipe.metadata()?.training;
    let training = training.context("a bundled recipe lacks its training section")?;
    let sources = training
        .sources
        .map(|source| format!("{} ({} materials)", source.label, source.materials));
    Ok(format!(
        "schedule {} at effort {}, {}",
        training.schedule.name(),
        training.effort.name(),
        sources.collect::<Vec<_>>().join(" and ")
    ))
}

/// The trainings of all contenders, each once.
fn trainings(contenders: &[Contender<'_>]) -> String {
    let mut parts: Vec<(String, Vec<&str>)> = Vec::new();
    for contender in contenders {
        let Some(training) = &contender.training else {
            continue;
        };
        match parts.iter_mut().find(|(known, _)| known == training) {
            Some((_, labels)) => labels.push(&contender.label),
            None => parts.push((training.clone(), vec![&contender.label])),
        }
    }
    let parts = parts
        .into_iter()
        .map(|(training, labels)| format!("{}: {training}", labels.join(", ")));
    parts.collect::<Vec<_>>().join("; ")
}

/// Seconds of motion and settling on the default machine within the recipe's limits.
fn seconds_of_scan(recipe: &Recipe<'_>, seed: u64) -> anyhow::Result<f64> {
    let machine = Machine {
        limits: recipe.metadata()?.limits.unwrap_or(Limits::NONE),
        ..Machine::default()
    };
    let Ok(stops) = stops(recipe, &machine.limits, false) else {
        bail!("a bundled recipe leaves its own limits");
    };
    Ok(Route::new(&machine, &stops, Order::Travel, seed).total())
}

/// A material's results by each method.
struct Scans {
    material: String,
    each: Vec<(Metrics, Picture)>,
}

fn scan_all(
    judge: &Evaluator<'_>,
    contenders: &[Contender<'_>],
    seed: u64,
) -> anyhow::Result<Vec<Scans>> {
    let scan = |index: usize| -> anyhow::Result<Scans> {
        let material: &dyn Material = &*judge.materials()[index];
        let each = contenders.iter().map(|contender| {
            let seed = seed.wrapping_add(index as u64);
            let fitted = contender.method.fit(material, seed)?;
            Ok(judge.score(index, &fitted)?)
        });
        Ok(Scans {
            material: material.name().to_owned(),
            each: each.collect::<anyhow::Result<_>>()?,
        })
    };
    (0..judge.materials().len())
        .into_par_iter()
        .map(scan)
        .collect()
}

/// The metrics that are shown: title, decimals, and the better direction.
const METRICS: [(&str, usize, Best); 4] = [
    ("Loss", 4, Best::Least),
    ("delta E", 2, Best::Least),
    ("DSSIM", 4, Best::Least),
    ("PSNR (dB)", 1, Best::Greatest),
];

/// The metrics of [`METRICS`].
fn metrics(scores: &Metrics) -> [f64; METRICS.len()] {
    [scores.loss, scores.delta_e, scores.dssim, scores.psnr]
}

/// Means over the materials, and costs.
fn table(caption: String, contenders: &[Contender<'_>], scans: &[Scans]) -> Table {
    let number = |number: Option<f64>| number.map_or(Cell::Missing, Cell::Number);
    let rows = contenders.iter().enumerate().map(|(index, contender)| {
        let scores = scans.iter().map(|scans| scans.each[index].0);
        let mean = Metrics::mean(scores).unwrap_or_default();
        let cycles = contender.bundled.and_then(BundledRecipe::cycles);
        let mut row = vec![Cell::Text(contender.label.clone())];
        row.extend(metrics(&mean).map(Cell::Number));
        row.push(number(contender.seconds));
        row.push(number(cycles.map(|cycles| cycles as f64)));
        row
    });
    let mut columns = vec![Column::text("Method")];
    columns.extend(METRICS.map(|(title, decimals, best)| Column::number(title, decimals, best)));
    columns.extend([
        Column::number("Scan (s)", 1, Best::None),
        Column::number("Fit (cycles)", 0, Best::None),
    ]);
    Table {
        caption,
        columns,
        rows: rows.collect(),
        compare: Compare::Down,
    }
}

/// Each material as it is and by each method, with its errors.
fn gallery(
    caption: String,
    judge: &Evaluator<'_>,
    contenders: &[Contender<'_>],
    scans: &[Scans],
) -> Gallery {
    let rows = scans.iter().enumerate().map(|(index, scans)| {
        let losses = scans.each.iter().map(|(scores, _)| scores.loss);
        let least = losses.fold(f64::INFINITY, f64::min);
        let reference = Tile {
            label: "Reference".into(),
            details: Vec::new(),
            best: false,
            picture: judge.reference(index).clone(),
        };
        let fits = contenders.iter().zip(&scans.each);
        let fits = fits.map(|(contender, (scores, picture))| Tile {
            label: contender.label.clone(),
            details: vec![
                format!("loss {:.4}", scores.loss),
                format!("{:.1} dB", scores.psnr),
            ],
            best: scores.loss == least,
            picture: picture.clone(),
        });
        GalleryRow {
            title: scans.material.clone(),
            tiles: [reference].into_iter().chain(fits).collect(),
        }
    });
    Gallery {
        caption,
        rows: rows.collect(),
    }
}
