//! `trainer evaluate`

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use anyhow::{Context, Error, anyhow, bail, ensure};
use clap::{ArgGroup, Args, ValueEnum};
use glimpse_core::model::ModelKind;
use glimpse_materials::basis::Basis;
use glimpse_materials::{Portion, Source};
use glimpse_trainer::evaluation::{Evaluator, Method, OPTIMUM_STEPS, Readings, Report, TrainedOn};
use glimpse_training::linear::{Columns, Prior, least_condition, principal_components};
use glimpse_training::meta::options::{Options, Parts};
use glimpse_training::meta::plan::{Effort, Schedule};
use glimpse_training::meta::run::INNER_STEPS;
use glimpse_training::recipe::{RecipeFile, recipe_of};

use super::evaluation_report::{MethodReport, comparison, comparison_as_json, promised};
use super::export_basis::read_compact;
use super::known::known;
use super::progress::{Steps, train_with_progress};
use super::{ModelName, PriorArgs, environment, load, numbers, print, read_recipe};

/// How a method fits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum MethodName {
    /// A recipe's pattern, start and step sizes.
    Ours,
    /// Learned start and step sizes, random samples.
    Meta,
    /// Random start, Adam, random samples; Linear: a fixed prior, random samples.
    Random,
    /// Linear only: samples that make its ridge problem well conditioned (Nielsen et al. 2015).
    Njr15,
    /// The best that the model can do: samples and steps without limit.
    Optimum,
}

/// Evaluator recipes, or a method without a recipe, on materials.
///
/// Give --recipe, or else --method and --model (and --samples, but for --method optimum).
///
/// Each material is measured at the method's n directions and fitted as the scanner would; the
/// fit is compared with the whole material. The loss is the mean cosine-weighted logarithmic error
/// over 40,503 directions, uniform in the Rusinkiewicz angles, always the same (docs/losses.md defines
/// it). DSSIM, L2, PSNR and delta E (mean CIEDE2000 over the disc) are of a sphere of 128 x 128 pixels,
/// as `trainer render sphere --size 128` draws it.
/// Random methods are averaged over seeds. The standard error is over the materials: how far as
/// many others would move the mean.
///
/// A recipe that completes readings (train --schedule prior) also predicts each material's loss from
/// its readings; what was predicted stands beside what was found.
///
/// Several recipes are compared in one table, by differences to the first one, material by material.
/// What was trained on is marked: a loss on it says nothing of unseen materials.
///
/// Example: trainer evaluate --recipe neural-n8.recipe --test MERL-test/
///          trainer evaluate --recipe old.recipe new.recipe --test MERL-test/
///          trainer evaluate --recipe neural-n16-masked.recipe --first 4 --noise 0.02 --test MERL-test/
///          trainer evaluate --method random --model neural --samples 8 --test MERL-test/
#[derive(Args)]
#[command(
    verbatim_doc_comment,
    override_usage = "trainer evaluate --recipe <FILE>... --test <SRC> [OPTIONS]\n       \
                      trainer evaluate --method <METHOD> --model <MODEL> --samples <N> --test <SRC> [OPTIONS]",
    group = ArgGroup::new("judged").args(["recipe", "model"]).required(true)
)]
pub(crate) struct Evaluate {
    /// Recipes; with --method meta their start and step sizes are used on random samples
    #[arg(
        long,
        num_args = 1..,
        value_name = "FILE",
        conflicts_with_all = ["model", "samples", "train", "effort", "bases", "eta"]
    )]
    recipe: Vec<PathBuf>,
    /// A compact basis (trainer export --format basis): the recipe's coefficients become a BRDF by
    /// it, as on a device, and not by the whole basis
    #[arg(long, requires = "recipe", conflicts_with = "model")]
    basis: Option<PathBuf>,
    /// The method [default with --recipe: ours]
    #[arg(long, value_enum)]
    method: Option<MethodName>,
    /// The model, without a recipe
    #[arg(long, value_enum, requires = "method")]
    model: Option<ModelName>,
    /// Number of directions that are measured, without a recipe: 1 to 4096 [--method optimum takes none]
    #[arg(long, short = 'n', value_name = "N", value_parser = numbers::samples)]
    samples: Option<usize>,
    /// Materials to learn on, where the method learns and there is no recipe; the model linear
    /// takes its components from them [default: procedural:100]
    #[arg(long)]
    train: Option<Source>,
    /// How long to train then [default: standard]
    #[arg(long, value_enum)]
    effort: Option<Effort>,
    #[command(flatten)]
    prior: PriorArgs,
    /// Materials to judge on
    #[arg(long, value_name = "SRC")]
    test: Source,
    /// Light of the spheres: a panorama (*.hdr or *.exr) [default: the built-in studio]
    #[arg(long, value_name = "FILE")]
    environment: Option<PathBuf>,
    /// Number of each recipe's readings that are taken, the first ones of its pattern: 1 to 4096
    #[arg(long, value_name = "K", requires = "recipe", value_parser = numbers::samples)]
    first: Option<usize>,
    /// Number of readings of each material that are lost at random: 1 to 4096
    #[arg(long, value_name = "K", requires = "recipe", value_parser = numbers::samples)]
    lose: Option<usize>,
    /// Noise of a recipe's readings, relative to each, 0 to 1: 0.02 is 2 % [default: 0]
    #[arg(long, value_name = "S", requires = "recipe", value_parser = numbers::share)]
    noise: Option<f32>,
    /// Noise in addition, relative to a white surface, whose BRDF is 1/pi, 0 to 1: 0.01 is 1 % [default: 0]
    #[arg(long, value_name = "S", requires = "recipe", value_parser = numbers::share)]
    additive: Option<f32>,
    /// Number of levels that the sensor tells apart between darkness and a white surface that faces the
    /// light [default: 0, no limit]
    #[arg(
        long,
        value_name = "COUNT",
        requires = "recipe",
        value_parser = numbers::whole(0..=u32::MAX)
    )]
    levels: Option<u32>,
    /// Repetitions of what is random, methods and readings that are lost or noisy: 1 to 10000 [default: 5]
    #[arg(long, value_name = "COUNT", value_parser = numbers::seeds)]
    seeds: Option<u64>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Repetitions of random methods, unless told.
const SEEDS: u64 = 5;

/// A recipe and the basis that belongs to it.
type Learned = (RecipeFile, Option<Basis>);

impl Evaluate {
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        let name = self.method.unwrap_or(MethodName::Ours);
        self.refuse_what_has_no_effect(name)?;
        let compact = match &self.basis {
            Some(path) => Some(Basis::of_compact(&read_compact(path)?).map_err(Error::msg)?),
            None => None,
        };
        let mut recipes = Vec::new();
        for path in &self.recipe {
            recipes.push((Some(path.display().to_string()), read_recipe(path)?));
        }
        let materials = load(&self.test)?;
        let environment = environment(self.environment.as_deref())?;
        if recipes.is_empty() && name.learns() {
            recipes.push((None, self.learn(name, seed)?));
        }
        let steps = Steps::new("rendering what fits are compared with", materials.len());
        let judge = Evaluator::under(environment, &materials);
        drop(steps);
        let judge = |method: &Method<'_>| -> anyhow::Result<Report> {
            let steps = Steps::new("judging", materials.len());
            let seeds = self.seeds.unwrap_or(SEEDS);
            let (done, never) = (|| steps.done(), AtomicBool::new(false));
            Ok(judge.evaluate_with_progress(method, seed, seeds, &done, &never)?)
        };
        let mut all = Vec::new();
        for (path, (file, basis)) in &recipes {
            let recipe = file.recipe();
            let method = match name {
                MethodName::Meta => Method::meta(&recipe, basis.as_ref())?,
                _ => Method::ours(&recipe, basis.as_ref())?,
            };
            let readings = self.readings();
            let method = match readings == Readings::default() {
                true => method,
                false => method.with_readings(readings)?,
            };
            let method = match &compact {
                Some(compact) => method.by_compact(compact)?,
                None => method,
            };
            all.push(MethodReport {
                recipe: path.clone(),
                report: judge(&method)?,
                known: known(TrainedOn::of_recipe(&recipe)?.as_ref(), &materials),
                promise: promised(&recipe)?,
            });
        }
        if recipes.is_empty() {
            let (report, trained_on) = self.evaluate_unlearned(name, seed, &judge)?;
            all.push(MethodReport {
                recipe: None,
                report,
                known: known(Some(&trained_on), &materials),
                promise: None,
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

    /// Refuses, by name, what would be asked for in vain. (What a recipe excludes, clap does.)
    fn refuse_what_has_no_effect(&self, name: MethodName) -> anyhow::Result<()> {
        let method = name.name();
        if !self.recipe.is_empty() && !name.learns() {
            bail!(
                "--recipe has no effect: --method {method} learns nothing; give --model and \
                 --samples"
            );
        }
        ensure!(
            self.recipe.len() <= 1 || self.basis.is_none(),
            "--basis takes a single --recipe"
        );
        if name != MethodName::Ours && self.readings() != Readings::default() {
            bail!(
                "--first, --lose, --noise, --additive and --levels have no effect with --method {method}: they \
                 are for a recipe's own readings"
            );
        }
        if let (Some(first), Some(lose)) = (self.first, self.lose)
            && lose >= first
        {
            bail!("--lose {lose} of --first {first} leaves nothing to fit");
        }
        if self.seeds.is_some() && !name.is_random() && !self.readings().are_random() {
            bail!("--seeds has no effect: nothing of --method {method} is random");
        }
        let Some(model) = self.model else {
            return Ok(());
        };
        self.prior.refuse_for_others(&[model])?;
        let is_linear = ModelKind::from(model) == ModelKind::Linear;
        let refuse = |option: &str, given: bool, why: &str| match given {
            true => Err(anyhow!("{option} has no effect: --method {method} {why}")),
            false => Ok(()),
        };
        refuse(
            "--effort",
            self.effort.is_some() && !name.learns(),
            "trains nothing",
        )?;
        refuse(
            "--train",
            self.train.is_some() && !name.learns() && !is_linear,
            "of this model learns nothing",
        )?;
        refuse(
            "--samples",
            self.samples.is_some() && name == MethodName::Optimum,
            "takes samples without limit",
        )
    }

    /// Judges a method that comes without a recipe; returns what it took its components from, too.
    fn evaluate_unlearned(
        &self,
        name: MethodName,
        seed: u64,
        judge: &dyn Fn(&Method<'_>) -> anyhow::Result<Report>,
    ) -> anyhow::Result<(Report, TrainedOn)> {
        if self.model()? == ModelKind::Linear {
            let prior = self.prior.or(Prior::PAPER)?;
            let Some(eta) = prior.eta else {
                bail!("--method {} learns no precisions: give --eta", name.name());
            };
            let training = load(&self.train())?;
            let columns = Columns::new(&training);
            let all: Vec<usize> = (0..columns.count()).collect();
            let basis = principal_components(&columns, &all, prior.components);
            let method = match name {
                MethodName::Njr15 => {
                    let pattern = least_condition(&basis, self.samples()?, seed);
                    Method::linear_njr15(&basis, eta, pattern)
                }
                MethodName::Optimum => Method::linear_optimum(&basis, eta),
                _ => Method::linear_random(&basis, eta, self.samples()?),
            };
            return Ok((judge(&method)?, TrainedOn::of_materials(&training)));
        }
        let method = match name {
            MethodName::Njr15 => bail!(
                "--method njr15 is for --model linear: it looks for samples that make its ridge \
                 problem well conditioned"
            ),
            MethodName::Optimum => Method::optimum(self.model()?, OPTIMUM_STEPS),
            _ => Method::random(self.model()?, self.samples()?, INNER_STEPS),
        };
        Ok((judge(&method)?, TrainedOn::default()))
    }

    fn readings(&self) -> Readings {
        Readings {
            first: self.first,
            lost: self.lose.unwrap_or(0),
            noise: self.noise.unwrap_or(0.0),
            additive: self.additive.unwrap_or(0.0),
            levels: self.levels.unwrap_or(0),
        }
    }

    fn model(&self) -> anyhow::Result<ModelKind> {
        let model = self.model.context("give --model, or --recipe FILE")?;
        Ok(model.into())
    }

    fn samples(&self) -> anyhow::Result<usize> {
        self.samples.context("give --samples, or --recipe FILE")
    }

    fn train(&self) -> Source {
        let default = || Source("procedural:100".into());
        self.train.clone().unwrap_or_else(default)
    }

    /// Trains what the method needs.
    fn learn(&self, name: MethodName, seed: u64) -> anyhow::Result<Learned> {
        let effort = self.effort.unwrap_or(Effort::Standard);
        let mut options = Options {
            parts: match name {
                MethodName::Meta => Parts::WithoutPattern,
                _ => Parts::All,
            },
            prior: self.prior.or(Prior::LEARNED)?,
            ..Options::new(
                self.model()?,
                self.samples()?,
                Schedule::Joint,
                effort,
                seed,
            )
        };
        let train = self.train();
        let materials = load(&train)?;
        options.portions = vec![Portion::whole(&train, materials.len())];
        let learned = train_with_progress(&options, materials)?;
        let basis = learned.basis.as_deref().map(Basis::from_bytes).transpose();
        let basis = basis.map_err(|what| anyhow!("the basis: {what}"))?;
        Ok((recipe_of(&learned, &options, train.label())?, basis))
    }
}

impl MethodName {
    /// True if it comes with a recipe.
    fn learns(self) -> bool {
        matches!(self, Self::Ours | Self::Meta)
    }

    /// True if it measures at random directions.
    fn is_random(self) -> bool {
        matches!(self, Self::Meta | Self::Random)
    }

    /// As on the command line.
    fn name(self) -> String {
        let value = self.to_possible_value();
        value.map_or_else(String::new, |value| value.get_name().to_owned())
    }
}
