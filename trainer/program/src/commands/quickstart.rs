//! `trainer quickstart`

use std::ops::Range;
use std::path::PathBuf;
use std::time::Instant;

use crate::report::{Cell, Column, Gallery, GalleryRow, Page, Table, metric_columns, pattern_svg};
use anyhow::Context;
use clap::Args;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;
use glimpse_evaluation::evaluation::{Evaluator, Method, SPHERE_SIZE, names};
use glimpse_evaluation::metrics::Metrics;
use glimpse_evaluation::render::Picture;
use glimpse_fitting::bundled::{self, BundledRecipe};
use glimpse_materials::{Material, Source};
use glimpse_training::meta::options::Effort;
use glimpse_training::meta::run::INNER_STEPS;
use glimpse_training::recipe::Metadata;
use glimpse_training::route::{Machine, Order, Route};
use rayon::prelude::*;

use super::lock::Lock;
use super::output::{check_out, create_out_folder, write_file};
use super::progress::StepProgress;
use super::{load, print};

/// Number of procedural test materials, and the largest number of materials of --data.
const MATERIAL_COUNT: usize = 8;
/// Bundled recipes in the order of n.
const RECIPES_BY_SAMPLES: [&str; 6] = [
    "neural-n1",
    "neural-n2",
    "neural-n4",
    "neural-n8",
    "neural-n16",
    "neural-n16-16s",
];
/// The bundled recipe that is compared with the paper's methods, and written to the output folder.
const MAIN_RECIPE: &str = "neural-n8";
/// The pictured methods: all but the first, Random.
const PICTURED: Range<usize> = 1..4;

/// Scan unseen materials with bundled recipes, and write a page of results: start here.
///
/// The command measures eight materials, and fits them as a scanner's microcontroller does. They come
/// from the generator of procedural materials that also trained the bundled recipes, with another seed;
/// --data takes your own materials, whose losses are larger. The page DIR/index.html shows
///
/// - recipes of the model neural for n = 1, 2, 4, 8 and 16 measurements, and for 16 in 16 seconds:
///   errors, duration of the scan in seconds (as in `trainer plan`) and cycles of the fit on a
///   Cortex-M4F;
/// - the paper's methods at n = 8, trained with the paper's schedule, and the recipe for n = 8.
///
/// The command trains nothing and takes 10 to 30 seconds. DIR/neural-n8.recipe is the bundled recipe
/// for n = 8, for use in other commands such as `trainer plan` and `trainer inspect`.
///
/// Example: trainer quickstart
///          trainer quickstart --seed 7 --out other/
///          trainer quickstart --data MERL/ --out merl/
///          trainer plan quickstart/neural-n8.recipe
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Quickstart {
    /// Materials to scan, the first eight of the source [default: procedural:8, with a seed after --seed]
    #[arg(long, value_name = "SOURCE")]
    data: Option<Source>,
    /// Output folder for index.html, its pictures and the recipe
    #[arg(long, short, value_name = "DIR", default_value = "quickstart")]
    out: PathBuf,
    /// Replace another recipe of the same name in DIR
    #[arg(long)]
    force: bool,
}

impl Quickstart {
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        let begin = Instant::now();
        create_out_folder(&self.out)?;
        let index = self.out.join("index.html");
        check_out(&index)?;
        let _lock = Lock::of_folder(&self.out)?;
        let main_recipe = find_bundled(MAIN_RECIPE)?;
        let path = self.out.join(format!("{MAIN_RECIPE}.recipe"));
        write_file(&path, main_recipe.bytes, self.force)?;

        // The bundled recipes were trained on the materials of seed 0.
        let unseen = seed.wrapping_add(1).max(1);
        let unseen = || Source(format!("procedural:{MATERIAL_COUNT}:{unseen}"));
        let source = self.data.clone().unwrap_or_else(unseen);
        let mut materials = load(&source)?;
        if materials.len() > MATERIAL_COUNT {
            eprintln!("the page shows the first {MATERIAL_COUNT} of them");
            materials.truncate(MATERIAL_COUNT);
        }
        let count = materials.len();
        let evaluator = Evaluator::new(&materials);

        let mut by_samples = Vec::new();
        for name in RECIPES_BY_SAMPLES {
            by_samples.push(ComparedMethod::from_bundled(find_bundled(name)?)?);
        }
        let progress = StepProgress::new("scanning with bundled recipes", count);
        let scans_by_samples = scan_all(&evaluator, &by_samples, seed, &progress)?;
        drop(progress);

        let paper = &bundled::PAPER;
        let recipe = paper.recipe()?;
        let methods = [
            ComparedMethod {
                label: names::RANDOM.into(),
                method: Method::random(ModelKind::Neural, recipe.samples(), INNER_STEPS),
                cycles: None,
                seconds: None,
            },
            ComparedMethod {
                label: names::META.into(),
                method: Method::meta(&recipe, None)?,
                cycles: None,
                seconds: None,
            },
            ComparedMethod {
                label: names::PAPER.into(),
                ..ComparedMethod::from_bundled(paper)?
            },
            ComparedMethod {
                label: names::GLIMPSE.into(),
                ..ComparedMethod::from_bundled(main_recipe)?
            },
        ];
        let progress = StepProgress::new("scanning with the paper's methods", count);
        let scans_of_methods = scan_all(&evaluator, &methods, seed, &progress)?;
        drop(progress);

        let origin = match self.data {
            Some(_) => "",
            None => ", made by the generator whose materials trained the bundled recipes",
        };
        let test = format!("Test set: {source} ({count} materials){origin}");
        let samples_table = table(
            format!("Bundled recipes of the model neural. {test}"),
            &by_samples,
            &scans_by_samples,
        );
        let methods_table = table(
            format!(
                "Methods for the model neural at n = {}. {test}",
                recipe.samples(),
            ),
            &methods,
            &scans_of_methods,
        );
        let pattern: Vec<_> = main_recipe.recipe()?.pattern().collect();
        Page::new("Glimpse: materials from few measurements")
            .paragraph(INTRODUCTION)
            .table(&samples_table)
            .paragraph(&explain_columns())
            .paragraph(&measured_losses(&by_samples))
            .heading("Spheres by number of measurements")
            .gallery(&gallery(
                test.clone(),
                &evaluator,
                &by_samples,
                &scans_by_samples,
                0,
            ))
            .heading("The paper's methods")
            .gallery(&gallery(
                test,
                &evaluator,
                &methods[PICTURED],
                &scans_of_methods,
                PICTURED.start,
            ))
            .table(&methods_table)
            .paragraph(&explain_methods())
            .heading("Directions of a recipe")
            .drawing(
                &pattern_svg(&pattern),
                &format!(
                    "The directions of {MAIN_RECIPE}, {}",
                    describe_training(&main_recipe.recipe()?)?
                ),
            )
            .heading("Next: your own materials")
            .paragraph(NEXT_STEP)
            .code(TRAIN_COMMAND)
            .write(&self.out)?;
        print(&format!(
            "{}\n{}\n{}\n\n{}\n{}\n{BEST_MARK}\n\n{NEXT_STEP}\n  {TRAIN_COMMAND}\n",
            samples_table.caption,
            samples_table.to_text(),
            measured_losses(&by_samples),
            methods_table.caption,
            methods_table.to_text()
        ))?;
        eprintln!(
            "wrote {} in {:.0} s",
            index.display(),
            begin.elapsed().as_secs_f64()
        );
        Ok(())
    }
}

const INTRODUCTION: &str = "A recipe holds learned directions of measurement, and learned initial \
    parameters of a small network that is fitted to the readings. This page shows scans of unseen \
    materials with bundled recipes for 1, 2, 4, 8 and 16 pairs of directions, and for 16 pairs in 16 seconds. Each material is measured \
    without noise and fitted as on a scanner's microcontroller.";
const BEST_MARK: &str = "An asterisk marks the best value of a column.";
const NEXT_STEP: &str =
    "Train a recipe for your own materials at standard effort, in 1 to 5 minutes on two cores:";
const TRAIN_COMMAND: &str =
    "trainer train --model neural --samples 16 --scan-seconds 16 --data YOUR/ --out mine.recipe";

fn explain_columns() -> String {
    let machine = Machine::default();
    format!(
        "The loss is that of the paper: the mean cosine-weighted logarithmic error over directions that are \
         uniform in (theta_h, theta_d, phi_d). DSSIM and PSNR compare the pictures below, of {SPHERE_SIZE} x \
         {SPHERE_SIZE} pixels. The duration of a scan covers motion and settling in the fastest order, at {} degrees per second \
         and with {} s at each sample. The arms start along the normal, with opposite azimuths. The cycles are those of one fit on a Cortex-M4F, \
         for recipes that the firmware's tests measure. {BEST_MARK}",
        machine.speeds.theta_i, machine.settle
    )
}

/// Returns the losses of bundled recipes on measured materials, for comparison.
fn measured_losses(methods: &[ComparedMethod<'_>]) -> String {
    let losses = methods.iter().filter_map(|method| {
        let losses = bundled::find(&method.label)?.losses()?;
        let rgl = losses
            .rgl
            .map_or_else(String::new, |loss| format!(" ({loss:.4})"));
        Some(format!("{} {:.4}{rgl}", method.label, losses.merl))
    });
    let losses: Vec<String> = losses.collect();
    format!(
        "Measured materials have larger losses than those of the built-in generator. On 80 networks of MERL's (and on RGL's 17, by \
         cross-validation): {}.",
        losses.join(", ")
    )
}

fn explain_methods() -> String {
    format!(
        "Random starts from random parameters, and draws random directions once for each material. Meta has \
         learned initial parameters and step sizes, and random directions. The paper's has learned directions too. \
         These three take {INNER_STEPS} steps. At effort standard, schedule paper takes 1/{} of the paper's \
         steps. Glimpse obtains its initial parameters from the readings by learned maps, and takes two Gauss-Newton steps. \
         Its recipe allows for noisy readings and limited arms; the recipes of the paper's methods do not.",
        Effort::Standard.paper_step_divisor()
    )
}

fn find_bundled(name: &str) -> anyhow::Result<&'static BundledRecipe> {
    bundled::find(name).with_context(|| format!("the program lacks the bundled recipe {name}"))
}

/// One of the compared methods.
struct ComparedMethod<'a> {
    label: String,
    method: Method<'a>,
    /// Cycles of a fit on a Cortex-M4F, if they were measured.
    cycles: Option<u64>,
    /// Duration of a scan in seconds; None if the directions differ between materials.
    seconds: Option<f64>,
}

impl ComparedMethod<'static> {
    /// Creates the method of a bundled recipe without a basis.
    fn from_bundled(bundled: &'static BundledRecipe) -> anyhow::Result<Self> {
        let recipe = bundled.recipe()?;
        let machine = Metadata::of(&recipe)?.machine();
        let route = Route::of_recipe(&recipe, &machine, Order::Travel);
        Ok(Self {
            label: bundled.name.into(),
            method: Method::with_recipe(&recipe, None)?,
            cycles: bundled.cycles(),
            seconds: route.map(|route| route.total()),
        })
    }
}

/// Describes the schedule, effort and training set of a recipe.
fn describe_training(recipe: &Recipe<'_>) -> anyhow::Result<String> {
    let training = Metadata::of(recipe)?.training;
    let training = training.context("a bundled recipe does not state its training")?;
    Ok(format!(
        "trained with schedule {} on {}",
        training.describe_schedule(),
        training.data
    ))
}

/// The errors and the sphere of each method on a material.
type MaterialResults = Vec<(Metrics, Picture)>;

fn scan_all(
    evaluator: &Evaluator<'_>,
    methods: &[ComparedMethod<'_>],
    seed: u64,
    progress: &StepProgress,
) -> anyhow::Result<Vec<MaterialResults>> {
    let scan = |index: usize| -> anyhow::Result<MaterialResults> {
        let material: &dyn Material = &*evaluator.materials()[index];
        let results = methods.iter().map(|method| {
            let seed = seed.wrapping_add(index as u64);
            let fitted = method.method.fit(material, seed)?;
            Ok(evaluator.compare(index, &fitted)?)
        });
        let results = results.collect();
        progress.increment();
        results
    };
    (0..evaluator.materials().len())
        .into_par_iter()
        .map(scan)
        .collect()
}

/// Returns a table of means over the materials, and of the costs of each method.
fn table(caption: String, methods: &[ComparedMethod<'_>], results: &[MaterialResults]) -> Table {
    let rows = methods.iter().enumerate().map(|(index, method)| {
        let metrics = results.iter().map(|results| results[index].0);
        let mean = Metrics::mean(metrics).unwrap_or_default();
        let mut row = vec![method.label[..].into()];
        row.extend(Cell::of_metrics(&mean));
        row.push(method.seconds.into());
        row.push(method.cycles.map(|cycles| cycles as f64).into());
        row
    });
    let mut columns = vec![Column::text("Method")];
    columns.extend(metric_columns());
    columns.push(Column::plain("Scan (s)", 1));
    columns.push(Column::plain("Fit (cycles)", 0));
    Table::new(caption, columns, rows)
}

/// Returns the pictures of each material, and of its scans with their errors. `first` is the result of the first method.
fn gallery(
    caption: String,
    evaluator: &Evaluator<'_>,
    methods: &[ComparedMethod<'_>],
    results: &[MaterialResults],
    first: usize,
) -> Gallery {
    let rows = results.iter().enumerate().map(|(index, results)| {
        let fits = methods.iter().zip(&results[first..]);
        let fits = fits
            .map(|(method, (metrics, picture))| (method.label.clone(), *metrics, picture.clone()));
        let reference = evaluator.reference(index).clone();
        GalleryRow::of_fits(
            evaluator.materials()[index].name(),
            reference,
            fits.collect(),
        )
    });
    Gallery {
        caption,
        rows: rows.collect(),
    }
}
