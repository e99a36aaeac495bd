//! `trainer evaluate`

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use anyhow::{Context, ensure};
use clap::Args;
use glimpse_evaluation::evaluation::{Degradation, Evaluator, Method};
use glimpse_fitting::measurement::{LossScale, NamedRecipe};
use glimpse_materials::Source;
use glimpse_materials::basis::BasisTable;

use super::adaptive::AdaptiveArgs;
use super::evaluation_report::{Comparison, RecipeReport};
use super::expected_loss::expected_loss;
use super::fits::{NamedMethod, add_fits};
use super::geometry::GeometryArgs;
use super::lock::Lock;
use super::{load, numbers, print, print_json};
use crate::progress::StepProgress;
use crate::report::Page;

/// Evaluate recipes on materials.
///
/// Each material is measured at the recipe's n directions and fitted as on the scanner. The fit is
/// compared with the material itself:
///
/// - loss: the mean cosine-weighted logarithmic error over 40,503 fixed directions, uniform in the
///   Rusinkiewicz angles (definition: docs/results.md);
/// - DSSIM, L2, PSNR and delta E (mean CIEDE2000 over the disk): errors of a sphere of 128 x 128
///   pixels, as `trainer render sphere` draws it.
///
/// With dropped or noisy readings, results are means over seeds. The standard error is over the
/// materials: it estimates how much the mean changes with another set of the same size. `trainer
/// reproduce` evaluates methods without a recipe.
///
/// Each material's loss is also predicted from its readings, and printed next to the true one.
///
/// With --out, the folder DIR gets a page, index.html, of the materials' spheres and those of their fits.
///
/// Several recipes are compared in one table, by paired differences to the first recipe. Training
/// materials are marked, since losses on them say nothing about unseen materials.
///
/// Example: trainer evaluate --recipe neural-n8.recipe --test MERL-test/
///          trainer evaluate --recipe old.recipe new.recipe --test MERL-test/
///          trainer evaluate --recipe neural-n16-masked.recipe --first 4 --noise 0.02 --test MERL-test/
///          trainer evaluate --recipe linear-n16-masked.recipe --target 0.01 --test MERL-test/
///          trainer evaluate --recipe linear-any.recipe --geometry multi-angle --test MERL-test/
///          trainer evaluate --recipe linear-any.recipe --adaptive 16 --speed 10 --test MERL-test/
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Evaluate {
    /// Recipe files, or names of bundled recipes
    #[arg(long, required = true, num_args = 1.., value_name = "FILE")]
    recipe: Vec<PathBuf>,
    /// Compact basis file (trainer export --format basis) that replaces the recipe's basis,
    /// as on a device
    #[arg(long, conflicts_with = "adaptive")]
    basis: Option<PathBuf>,
    /// Test materials
    #[arg(long, value_name = "SOURCE")]
    test: Source,
    #[command(flatten)]
    geometry: GeometryArgs,
    #[command(flatten)]
    adaptive: AdaptiveArgs,
    #[command(flatten)]
    degradation: Degradation,
    /// Also scan each material in the recipe's order until the upper bound of its loss is at most L, above
    /// 0; the recipe must tolerate missing readings
    #[arg(
        long,
        value_name = "L",
        conflicts_with_all = ["first", "lose", "adaptive"],
        value_parser = numbers::number(1e-6..=10.0)
    )]
    target: Option<f64>,
    /// Number of repetitions with dropped or noisy readings, 1 to 10000
    /// [default: 5]
    #[arg(long, value_name = "COUNT", value_parser = numbers::number(1..=10_000_u64))]
    seeds: Option<u64>,
    /// Folder for a page, index.html, with a sphere of each fit
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Default number of repetitions with random readings.
const DEFAULT_SEEDS: u64 = 5;

impl Evaluate {
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        self.refuse_unused_options()?;
        let recipes = self.recipe.iter().map(|path| match self.adaptive.adaptive {
            Some(_) => Ok(NamedRecipe::read(path)?),
            None => self.geometry.read(path),
        });
        let mut recipes = recipes.collect::<anyhow::Result<Vec<_>>>()?;
        if let (Some(path), [named, ..]) = (&self.basis, &mut recipes[..]) {
            let checksum = named.file.recipe().basis_checksum();
            let checksum = checksum.with_context(|| {
                format!(
                    "--basis has no effect: {} has no basis; remove it",
                    named.name
                )
            })?;
            named.basis = Some(Arc::new(BasisTable::read(path, checksum)?));
        }
        for named in &recipes {
            let recipe = named.file.recipe();
            match self.adaptive.adaptive {
                Some(samples) => self.degradation.validate(samples, None)?,
                None => self.degradation.validate(recipe.samples(), Some(&recipe))?,
            }
        }
        let continuing: Vec<_> = recipes.iter().map(NamedRecipe::continuing).collect();
        let adaptive = recipes.iter().zip(&continuing);
        let adaptive = adaptive.map(|(named, any)| self.adaptive.scans(named, any));
        let adaptive = adaptive.collect::<anyhow::Result<Vec<_>>>()?;
        let materials = load(&self.test)?;
        let progress = StepProgress::new("rendering the materials", materials.len());
        let evaluator = Evaluator::new(&materials);
        drop(progress);
        let black = (0..materials.len()).map(|index| evaluator.loss(index, LossScale::BLACK));
        let loss_scale = LossScale::new(black.sum::<f64>() / materials.len() as f64);
        let (mut reports, mut methods) = (Vec::new(), Vec::new());
        for ((path, named), adaptive) in self.recipe.iter().zip(&recipes).zip(adaptive) {
            let recipe = named.file.recipe();
            let mut method = match adaptive {
                Some(adaptive) => Method::adaptive(adaptive),
                None => Method::on_host(named)?,
            };
            method.degradation = self.degradation;
            let progress = StepProgress::new("evaluating", materials.len());
            let (on_done, cancel) = (|| progress.increment(), AtomicBool::new(false));
            let seeds = self.seeds.unwrap_or(DEFAULT_SEEDS);
            let report =
                evaluator.evaluate_with_progress(&method, seed, seeds, &on_done, &cancel)?;
            drop(progress);
            let report = report.with_overlaps(&named.file.metadata().materials, &materials);
            let target = self
                .target
                .map(|target| evaluator.evaluate_target(&recipe, &method, target, seed));
            let name = path.display().to_string();
            reports.push(RecipeReport {
                recipe: name.clone(),
                report,
                loss_scale,
                promise: named.file.metadata().expected_loss,
                stated_loss: expected_loss(&recipe)?,
                target: target.transpose()?,
            });
            methods.push(NamedMethod::of_recipe(&name, &recipe, method)?);
        }
        if let Some(out) = &self.out {
            let _lock = Lock::of_folder(out)?;
            let mut page = Page::new("Glimpse: scans and their materials");
            let caption = format!("Test set: {} ({} materials)", self.test, materials.len());
            add_fits(&mut page, &caption, &evaluator, &methods, seed)?;
            page.write(out)?;
        }
        match (&reports[..], self.json) {
            ([one], false) => print(&one.to_text()),
            ([one], true) => print_json(one),
            (all, false) => print(&Comparison::new(all).to_text()),
            (all, true) => print_json(&Comparison::new(all)),
        }
    }

    /// Refuses options without effect. (clap refuses those that exclude each other.)
    fn refuse_unused_options(&self) -> anyhow::Result<()> {
        ensure!(
            self.recipe.len() <= 1 || (self.basis.is_none() && self.target.is_none()),
            "--basis and --target apply to a single --recipe: evaluate the recipes one by one"
        );
        ensure!(
            self.seeds.is_none() || self.degradation.is_random(),
            "--seeds has no effect without --lose, --noise or --additive: remove it"
        );
        Ok(())
    }
}
