//! `trainer evaluate`

use std::path::PathBuf;

use anyhow::{Context, anyhow, bail};
use clap::{Args, ValueEnum};
use glimpse_core::model::{ModelKind, linear};
use glimpse_core::recipe::MAX_SAMPLES;
use glimpse_trainer::evaluation::{Judge, Method, OPTIMUM_STEPS, Verdict};
use glimpse_trainer::export::{RecipeFile, recipe_of};
use glimpse_trainer::linear::{Basis, Columns, Prior, least_condition};
use glimpse_trainer::material::{Material, Source};
use glimpse_trainer::meta::plan::{Effort, Schedule};
use glimpse_trainer::meta::run::{INNER_STEPS, Learned as LearnedRecipe, Options, Parts};

use super::export_basis::read_compact;
use super::progress::train_with_progress;
use super::{ModelName, PriorArgs, environment, load, print, read_recipe};

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

/// Judge a recipe or a method on materials.
///
/// Each material is measured at the method's n directions and fitted as the scanner would; the
/// fit is compared with the whole material: Loss (mean cosine-weighted logarithmic error over
/// 16,384 uniform valid directions), and DSSIM, L2 and PSNR of a rendered sphere. Random methods
/// are averaged over seeds.
///
/// Example: trainer evaluate --recipe neural-n8.recipe --test MERL-test/
///          trainer evaluate --method random --model neural --samples 8 --test MERL-test/
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Evaluate {
    /// A recipe; with --method meta its start and step sizes are used on random samples
    #[arg(long)]
    recipe: Option<PathBuf>,
    /// A compact basis (trainer export --format basis): the recipe's coefficients become a BRDF by
    /// it, as on a device, and not by the whole basis
    #[arg(long, requires = "recipe")]
    basis: Option<PathBuf>,
    /// The method [default: ours]
    #[arg(long, value_enum)]
    method: Option<MethodName>,
    /// The model, without a recipe
    #[arg(long, value_enum, required_unless_present = "recipe")]
    model: Option<ModelName>,
    /// How many directions are measured, without a recipe [--method optimum needs none]
    #[arg(long, short = 'n')]
    samples: Option<usize>,
    /// Materials to learn on, where the method learns and there is no recipe; the model linear
    /// takes its components from them
    #[arg(long, default_value = "procedural:100")]
    train: Source,
    /// How long to train then
    #[arg(long, value_enum, default_value_t = Effort::Standard)]
    effort: Effort,
    #[command(flatten)]
    prior: PriorArgs,
    /// Materials to judge on
    #[arg(long)]
    test: Source,
    /// Light of the spheres: a panorama (*.hdr or *.exr) [default: the built-in studio]
    #[arg(long, value_name = "FILE")]
    environment: Option<PathBuf>,
    /// Repetitions of random methods
    #[arg(long, default_value_t = 5)]
    seeds: u64,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// A recipe and the basis that belongs to it.
type Learned = (RecipeFile, Option<Basis>);

impl Evaluate {
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        let name = match (self.method, &self.recipe) {
            (Some(name), Some(_)) if !name.learns() => bail!(
                "--method {} learns nothing and takes no --recipe: give --model and --samples",
                name.to_possible_value()
                    .map_or_else(String::new, |name| name.get_name().into())
            ),
            (Some(name), _) => name,
            (None, Some(_)) => MethodName::Ours,
            (None, None) => bail!("give --recipe FILE, or --method with --model and --samples"),
        };
        let materials = load(&self.test)?;
        let verdict = if name.learns() {
            let (file, basis) = match &self.recipe {
                Some(path) => read_recipe(path)?,
                None => self.learn(name, seed)?,
            };
            let recipe = file.recipe()?;
            let method = match name {
                MethodName::Meta => Method::meta(&recipe, basis.as_ref())?,
                _ => Method::ours(&recipe, basis.as_ref())?,
            };
            let compact = self.basis.as_deref().map(read_compact).transpose()?;
            let method = match &compact {
                Some(bytes) => method.by_compact(linear::Basis::parse(bytes)?)?,
                None => method,
            };
            self.judge(&materials, &method, seed)?
        } else if self.model()? == ModelKind::Linear {
            let prior = self.prior.or(Prior::PAPER)?;
            let Some(eta) = prior.eta else {
                bail!("--method {name:?} learns no precisions: give --eta");
            };
            let columns = Columns::new(&load(&self.train)?);
            let all: Vec<usize> = (0..columns.count()).collect();
            let basis = Basis::new(&columns, &all, prior.components);
            let method = match name {
                MethodName::Njr15 => {
                    let pattern = least_condition(&basis, self.samples()?, seed);
                    Method::linear_njr15(&basis, eta, pattern)
                }
                MethodName::Optimum => Method::linear_optimum(&basis, eta),
                _ => Method::linear_random(&basis, eta, self.samples()?),
            };
            self.judge(&materials, &method, seed)?
        } else {
            let method = match name {
                MethodName::Njr15 => bail!(
                    "--method njr15 is for --model linear: it looks for samples that make its \
                     ridge problem well conditioned"
                ),
                MethodName::Optimum => Method::optimum(self.model()?, OPTIMUM_STEPS),
                _ => Method::random(self.model()?, self.samples()?, INNER_STEPS),
            };
            self.judge(&materials, &method, seed)?
        };
        if self.json {
            print(&(serde_json::to_string_pretty(&verdict)? + "\n"))
        } else {
            print(&table(&verdict))
        }
    }

    fn judge(
        &self,
        materials: &[Box<dyn Material>],
        method: &Method<'_>,
        seed: u64,
    ) -> anyhow::Result<Verdict> {
        let environment = environment(self.environment.as_deref())?;
        Ok(Judge::under(environment, materials, seed).judge(method, seed, self.seeds)?)
    }

    fn model(&self) -> anyhow::Result<ModelKind> {
        let model = self.model.context("give --model, or --recipe FILE")?;
        Ok(model.into())
    }

    fn samples(&self) -> anyhow::Result<usize> {
        match self.samples {
            Some(samples @ 1..=MAX_SAMPLES) => Ok(samples),
            Some(_) => bail!("--samples must be 1 to {MAX_SAMPLES}"),
            None => bail!("give --samples, or --recipe FILE"),
        }
    }

    /// Trains what the method needs.
    fn learn(&self, name: MethodName, seed: u64) -> anyhow::Result<Learned> {
        let options = Options {
            model: self.model()?,
            samples: self.samples()?,
            schedule: Schedule::Joint,
            effort: self.effort,
            parts: match name {
                MethodName::Meta => Parts::WithoutPattern,
                _ => Parts::All,
            },
            prior: self.prior.or(Prior::LEARNED)?,
            seed,
            checkpoints: None,
        };
        let learned = train_with_progress(&options, load(&self.train)?)?;
        let basis = match &learned {
            LearnedRecipe::Ridge(ridge) => {
                Some(Basis::from_bytes(&ridge.basis).map_err(|what| anyhow!("the basis: {what}"))?)
            }
            LearnedRecipe::Descent(_) => None,
        };
        Ok((recipe_of(&learned, &options, &self.train)?, basis))
    }
}

impl MethodName {
    /// True if it comes with a recipe.
    fn learns(self) -> bool {
        matches!(self, Self::Ours | Self::Meta)
    }
}

/// The verdict as text: a line for each material, and the mean.
fn table(verdict: &Verdict) -> String {
    let width = verdict
        .materials
        .iter()
        .map(|material| material.name.len())
        .max();
    let width = width.unwrap_or(0).max(8);
    let mut text = format!(
        "{} {} n = {}\n{:width$} {:>8} {:>8} {:>9} {:>7}\n",
        verdict.method, verdict.model, verdict.samples, "material", "loss", "DSSIM", "L2", "PSNR"
    );
    let rows = verdict
        .materials
        .iter()
        .map(|material| (&material.name[..], material.scores));
    for (name, scores) in rows.chain([("mean", verdict.scores)]) {
        text += &format!(
            "{name:width$} {:8.4} {:8.4} {:9.6} {:7.2}\n",
            scores.loss, scores.dssim, scores.l2, scores.psnr
        );
    }
    if verdict.seeds > 1 {
        text += &format!(
            "mean of {} seeds; the loss has a standard deviation of {:.4} from seed to seed\n",
            verdict.seeds, verdict.loss_spread
        );
    }
    text
}
