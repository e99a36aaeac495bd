//! `trainer evaluate`

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use anyhow::{Context, Error, anyhow, bail, ensure};
use clap::{ArgGroup, Args, ValueEnum};
use glimpse_core::model::ModelKind;
use glimpse_materials::basis::Basis;
use glimpse_materials::{Source, SourceShare};
use glimpse_trainer::evaluation::{
    Degradation, Evaluator, Method, OPTIMUM_STEPS, Report, TrainingMaterials,
};
use glimpse_training::linear::{Columns, Prior, min_condition_pattern, principal_components};
use glimpse_training::meta::options::Options;
use glimpse_training::meta::plan::TrainedParts;
use glimpse_training::meta::plan::{Effort, Schedule};
use glimpse_training::meta::run::INNER_STEPS;
use glimpse_training::recipe::{RecipeFile, pack_recipe};

use super::evaluation_report::{MethodReport, StatedLoss, comparison, comparison_as_json};
use super::export_basis::read_compact;
use super::progress::{StepProgress, train_with_progress};
use super::training_overlap::training_overlaps;
use super::{LinearPriorArgs, environment, load, model, numbers, print, read_recipe};

/// A fitting method, as named on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum MethodName {
    /// Learned pattern, initial parameters and step sizes: a recipe.
    Ours,
    /// Learned initial parameters and step sizes, random samples.
    Meta,
    /// Random initial parameters, Adam, random samples; Linear: a fixed prior, random samples.
    Random,
    /// Linear only: samples that make its ridge problem well conditioned (Nielsen et al. 2015).
    Njr15,
    /// The best fit that the model allows: unlimited samples and steps.
    Optimum,
}

/// Evaluate recipes, or a method without a recipe, on materials.
///
/// Give --recipe, or --method and --model (with --samples, except for --method optimum).
///
/// Each material is measured at the method's n directions and fitted as on the scanner. The fit is
/// compared with the material itself:
///
/// - loss: the mean cosine-weighted logarithmic error over 40,503 fixed directions, uniform in the
///   Rusinkiewicz angles (definition: docs/losses.md);
/// - DSSIM, L2, PSNR and delta E (mean CIEDE2000 over the disk): errors of a sphere of 128 x 128
///   pixels, as `trainer render sphere --size 128` draws it.
///
/// Results of random methods are means over seeds. The standard error is over the materials: it
/// estimates how much the mean changes with another set of the same size.
///
/// A recipe that completes readings (train --schedule prior) also predicts each material's loss
/// from its readings. The predicted loss is printed next to the true one.
///
/// Several recipes are compared in one table, by paired differences to the first recipe. Training
/// materials are marked, since losses on them say nothing about unseen materials.
///
/// Example: trainer evaluate --recipe neural-n8.recipe --test MERL-test/
///          trainer evaluate --recipe old.recipe new.recipe --test MERL-test/
///          trainer evaluate --recipe neural-n16-masked.recipe --first 4 --noise 0.02 --test MERL-test/
///          trainer evaluate --recipe linear-n16-masked.recipe --target 0.01 --test MERL-test/
///          trainer evaluate --method random --model neural --samples 8 --test MERL-test/
#[derive(Args)]
#[command(
    verbatim_doc_comment,
    override_usage = "trainer evaluate --recipe <FILE>... --test <SOURCE> [OPTIONS]\n       \
                      trainer evaluate --method <METHOD> --model <MODEL> --samples <N> --test <SOURCE> [OPTIONS]",
    group = ArgGroup::new("evaluated").args(["recipe", "model"]).required(true)
)]
pub(crate) struct Evaluate {
    /// Recipe files; --method meta uses their initial parameters and step sizes, at random samples
    #[arg(
        long,
        num_args = 1..,
        value_name = "FILE",
        conflicts_with_all = ["model", "samples", "train", "effort", "bases", "eta"]
    )]
    recipe: Vec<PathBuf>,
    /// Compact basis file (trainer export --format basis) that replaces the recipe's whole basis,
    /// as on a device
    #[arg(long, requires = "recipe", conflicts_with = "model")]
    basis: Option<PathBuf>,
    /// Fitting method [default with --recipe: ours]
    #[arg(long, value_enum)]
    method: Option<MethodName>,
    /// Model of a method without a recipe
    #[arg(long, value_parser = model(), requires = "method")]
    model: Option<ModelKind>,
    /// Number n of samples of a method without a recipe, 1 to 4096; not with --method optimum
    #[arg(long, short = 'n', value_name = "N", value_parser = numbers::samples)]
    samples: Option<usize>,
    /// Training materials for ours and meta without a recipe, and for the components of the model
    /// linear [default: procedural:100]
    #[arg(long, value_name = "SOURCE")]
    train: Option<Source>,
    /// Length of the training of a method without a recipe [default: standard]
    #[arg(long, value_enum)]
    effort: Option<Effort>,
    #[command(flatten)]
    linear_prior: LinearPriorArgs,
    /// Test materials
    #[arg(long, value_name = "SOURCE")]
    test: Source,
    /// Environment light of the spheres: a panorama (*.hdr) [default: the built-in studio]
    #[arg(long, value_name = "FILE")]
    environment: Option<PathBuf>,
    /// Number of readings to use, from the start of each recipe's pattern, 1 to 4096 [default: all]
    #[arg(long, value_name = "K", requires = "recipe", value_parser = numbers::samples)]
    first: Option<usize>,
    /// Number of random readings of each material to drop, 1 to 4096 [default: none]
    #[arg(long, value_name = "K", requires = "recipe", value_parser = numbers::samples)]
    lose: Option<usize>,
    /// Standard deviation of the readings' noise, relative to each value, 0 to 1: 0.02 is 2 %
    /// [default: 0]
    #[arg(long, value_name = "S", requires = "recipe", value_parser = numbers::share)]
    noise: Option<f32>,
    /// Standard deviation of noise that does not depend on the value, relative to the BRDF 1/pi
    /// of a white surface, 0 to 1: 0.01 is 1 % [default: 0]
    #[arg(long, value_name = "S", requires = "recipe", value_parser = numbers::share)]
    additive: Option<f32>,
    /// Number of quantization levels of the sensor between darkness and a white surface that faces
    /// the light; 0 for no quantization [default: 0]
    #[arg(
        long,
        value_name = "COUNT",
        requires = "recipe",
        value_parser = numbers::integer(0..=u32::MAX)
    )]
    levels: Option<u32>,
    /// Also scan each material in the recipe's order until the upper bound of its loss is at most L, above
    /// 0; the recipe must tolerate missing readings
    #[arg(
        long,
        value_name = "L",
        requires = "recipe",
        conflicts_with_all = ["first", "lose"],
        value_parser = numbers::number(1e-6..=10.0)
    )]
    target: Option<f64>,
    /// Number of repetitions with random methods, or with dropped or noisy readings, 1 to 10000
    /// [default: 5]
    #[arg(long, value_name = "COUNT", value_parser = numbers::seeds)]
    seeds: Option<u64>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Default number of repetitions of random methods.
const DEFAULT_SEEDS: u64 = 5;

impl Evaluate {
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        let method_name = self.method.unwrap_or(MethodName::Ours);
        self.refuse_unused_options(method_name)?;
        let compact = match &self.basis {
            Some(path) => {
                Some(Basis::from_compact_bytes(&read_compact(path)?).map_err(Error::msg)?)
            }
            None => None,
        };
        let mut recipes = Vec::new();
        for path in &self.recipe {
            recipes.push((Some(path.display().to_string()), read_recipe(path)?));
        }
        let materials = load(&self.test)?;
        let environment = environment(self.environment.as_deref())?;
        if recipes.is_empty() && method_name.uses_recipe() {
            recipes.push((None, self.train_recipe(method_name, seed)?));
        }
        let progress = StepProgress::new("rendering the materials", materials.len());
        let evaluator = Evaluator::with_environment(environment, &materials);
        drop(progress);
        let evaluate = |method: &Method<'_>| -> anyhow::Result<Report> {
            let progress = StepProgress::new("evaluating", materials.len());
            let seeds = self.seeds.unwrap_or(DEFAULT_SEEDS);
            let (on_done, cancel) = (|| progress.increment(), AtomicBool::new(false));
            Ok(evaluator.evaluate_with_progress(method, seed, seeds, &on_done, &cancel)?)
        };
        let mut all = Vec::new();
        for (path, (file, basis)) in &recipes {
            let recipe = file.recipe();
            let method = match method_name {
                MethodName::Meta => Method::meta(&recipe, basis.as_ref())?,
                _ => Method::ours(&recipe, basis.as_ref())?,
            };
            let degradation = self.degradation();
            let method = match degradation == Degradation::default() {
                true => method,
                false => method.with_degradation(degradation)?,
            };
            let method = match &compact {
                Some(compact) => method.with_compact_basis(compact)?,
                None => method,
            };
            let report = evaluate(&method)?;
            let target = self.target.map(|target| {
                evaluator.evaluate_target(&recipe, &method, degradation, target, seed)
            });
            all.push(MethodReport {
                recipe: path.clone(),
                target: target.transpose()?,
                report,
                overlaps: training_overlaps(
                    TrainingMaterials::from_recipe(&recipe)?.as_ref(),
                    &materials,
                ),
                stated_loss: StatedLoss::of(&recipe)?,
            });
        }
        if recipes.is_empty() {
            let (report, trained_on) =
                self.evaluate_without_recipe(method_name, seed, &evaluate)?;
            all.push(MethodReport {
                recipe: None,
                report,
                overlaps: training_overlaps(Some(&trained_on), &materials),
                stated_loss: None,
                target: None,
            });
        }
        let text = match (&all[..], self.json) {
            ([one], false) => one.to_text(),
            ([one], true) => serde_json::to_string_pretty(&one.to_json()?)? + "\n",
            (all, false) => comparison(all),
            (all, true) => serde_json::to_string_pretty(&comparison_as_json(all)?)? + "\n",
        };
        print(&text)
    }

    /// Refuses options without effect. (clap refuses those that exclude --recipe.)
    fn refuse_unused_options(&self, method_name: MethodName) -> anyhow::Result<()> {
        let method = method_name.name();
        if !self.recipe.is_empty() && !method_name.uses_recipe() {
            bail!(
                "--recipe has no effect: --method {method} uses no recipe; give --model and \
                 --samples instead"
            );
        }
        ensure!(
            self.recipe.len() <= 1 || (self.basis.is_none() && self.target.is_none()),
            "--basis and --target apply to a single --recipe: evaluate the recipes one by one"
        );
        if method_name != MethodName::Ours && self.target.is_some() {
            bail!("--target has no effect with --method {method}: remove it");
        }
        if method_name != MethodName::Ours && self.degradation() != Degradation::default() {
            bail!(
                "--first, --lose, --noise, --additive and --levels have no effect with --method {method}: \
                 remove them"
            );
        }
        if let (Some(first), Some(lose)) = (self.first, self.lose)
            && lose >= first
        {
            bail!(
                "--lose {lose} of --first {first} leaves no reading to fit: give a smaller --lose"
            );
        }
        if self.seeds.is_some() && !method_name.is_random() && !self.degradation().is_random() {
            bail!("--seeds has no effect: --method {method} is not random; remove it");
        }
        let Some(model) = self.model else {
            return Ok(());
        };
        self.linear_prior.refuse_for_other_models(&[model])?;
        let is_linear = model == ModelKind::Linear;
        let refuse = |option: &str, is_unused: bool, why: &str| match is_unused {
            true => Err(anyhow!(
                "{option} has no effect: --method {method} {why}; remove it"
            )),
            false => Ok(()),
        };
        refuse(
            "--effort",
            self.effort.is_some() && !method_name.uses_recipe(),
            "is not trained",
        )?;
        refuse(
            "--train",
            self.train.is_some() && !method_name.uses_recipe() && !is_linear,
            "of this model is not trained",
        )?;
        refuse(
            "--samples",
            self.samples.is_some() && method_name == MethodName::Optimum,
            "uses unlimited samples",
        )
    }

    /// Evaluates a method without a recipe. Also returns the materials that the principal components of the model
    /// linear are computed from.
    fn evaluate_without_recipe(
        &self,
        method_name: MethodName,
        seed: u64,
        evaluate: &dyn Fn(&Method<'_>) -> anyhow::Result<Report>,
    ) -> anyhow::Result<(Report, TrainingMaterials)> {
        if self.model()? == ModelKind::Linear {
            let prior = self.linear_prior.or(Prior::PAPER)?;
            let Some(eta) = prior.eta else {
                bail!(
                    "--method {} learns no precisions: give --eta",
                    method_name.name()
                );
            };
            let training = load(&self.training_source())?;
            let columns = Columns::new(&training);
            let all: Vec<usize> = (0..columns.count()).collect();
            let basis = principal_components(&columns, &all, prior.components);
            let method = match method_name {
                MethodName::Njr15 => {
                    let pattern = min_condition_pattern(&basis, self.samples()?, seed);
                    Method::linear_njr15(&basis, eta, pattern)
                }
                MethodName::Optimum => Method::linear_optimum(&basis, eta),
                _ => Method::linear_random(&basis, eta, self.samples()?),
            };
            return Ok((
                evaluate(&method)?,
                TrainingMaterials::from_materials(&training),
            ));
        }
        let method = match method_name {
            MethodName::Njr15 => {
                bail!("--method njr15 applies to --model linear only: give another --method")
            }
            MethodName::Optimum => Method::optimum(self.model()?, OPTIMUM_STEPS),
            _ => Method::random(self.model()?, self.samples()?, INNER_STEPS),
        };
        Ok((evaluate(&method)?, TrainingMaterials::default()))
    }

    fn degradation(&self) -> Degradation {
        Degradation {
            first: self.first,
            lost: self.lose.unwrap_or(0),
            noise: self.noise.unwrap_or(0.0),
            additive: self.additive.unwrap_or(0.0),
            levels: self.levels.unwrap_or(0),
        }
    }

    fn model(&self) -> anyhow::Result<ModelKind> {
        self.model
            .context("no model: give --model, or --recipe FILE")
    }

    fn samples(&self) -> anyhow::Result<usize> {
        self.samples
            .context("no number of samples: give --samples, or --recipe FILE")
    }

    fn training_source(&self) -> Source {
        let default = || Source("procedural:100".into());
        self.train.clone().unwrap_or_else(default)
    }

    /// Trains a recipe for the method, with its basis for the model linear.
    fn train_recipe(
        &self,
        method_name: MethodName,
        seed: u64,
    ) -> anyhow::Result<(RecipeFile, Option<Basis>)> {
        let effort = self.effort.unwrap_or(Effort::Standard);
        let mut options = Options {
            parts: match method_name {
                MethodName::Meta => TrainedParts::WithoutPattern,
                _ => TrainedParts::All,
            },
            prior: self.linear_prior.or(Prior::LEARNED)?,
            ..Options::new(
                self.model()?,
                self.samples()?,
                Schedule::Joint,
                effort,
                seed,
            )
        };
        let source = self.training_source();
        let materials = load(&source)?;
        options.source_shares = vec![SourceShare::single(&source, materials.len())];
        let learned = train_with_progress(&options, materials)?;
        let basis = learned.basis.as_deref().map(Basis::from_bytes).transpose();
        let basis = basis.map_err(|reason| anyhow!("the trained basis is invalid: {reason}"))?;
        Ok((pack_recipe(&learned, &options, source.label())?, basis))
    }
}

impl MethodName {
    /// Returns true if the method uses learned values of a recipe.
    fn uses_recipe(self) -> bool {
        matches!(self, Self::Ours | Self::Meta)
    }

    /// Returns true if the method measures at random directions.
    fn is_random(self) -> bool {
        matches!(self, Self::Meta | Self::Random)
    }

    /// Returns the name on the command line.
    fn name(self) -> String {
        let value = self.to_possible_value();
        value.map_or_else(String::new, |value| value.get_name().to_owned())
    }
}
