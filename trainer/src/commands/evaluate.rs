//! `trainer evaluate`

use std::path::PathBuf;

use anyhow::bail;
use clap::Args;
use glimpse_trainer::evaluation::{Judge, Method, Verdict};
use glimpse_trainer::export::RecipeFile;
use glimpse_trainer::material::Source;
use glimpse_trainer::meta::plan::{Effort, Schedule};
use glimpse_trainer::meta::run::{INNER_STEPS, Options};

use super::progress::train_with_progress;
use super::train::recipe_of;
use super::{ModelName, load, print};

/// How a method fits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum MethodName {
    /// A recipe's pattern, start and step sizes.
    Ours,
    /// Learned start and step sizes, random samples.
    Meta,
    /// Random start, Adam, random samples.
    Random,
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
    /// The method [default: ours]
    #[arg(long, value_enum)]
    method: Option<MethodName>,
    /// The model, without a recipe
    #[arg(long, value_enum, required_unless_present = "recipe")]
    model: Option<ModelName>,
    /// How many directions are measured, without a recipe
    #[arg(long, short = 'n', required_unless_present = "recipe")]
    samples: Option<usize>,
    /// Materials to train on, where the method learns and there is no recipe
    #[arg(long, default_value = "procedural:100")]
    train: Source,
    /// How long to train then
    #[arg(long, value_enum, default_value_t = Effort::Standard)]
    effort: Effort,
    /// Materials to judge on
    #[arg(long)]
    test: Source,
    /// Repetitions of random methods
    #[arg(long, default_value_t = 5)]
    seeds: u64,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

impl Evaluate {
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        let materials = load(&self.test)?;
        let name = match (self.method, &self.recipe) {
            (Some(MethodName::Random), Some(_)) => {
                bail!(
                    "--method random learns nothing and takes no --recipe: give --model and --samples"
                )
            }
            (Some(name), _) => name,
            (None, Some(_)) => MethodName::Ours,
            (None, None) => bail!("give --recipe FILE, or --method with --model and --samples"),
        };
        let learned = match (name, &self.recipe) {
            (MethodName::Random, _) => None,
            (_, Some(path)) => Some(RecipeFile::read(path)?),
            (_, None) => Some(self.learn(name, seed)?),
        };
        let recipe = learned.as_ref().map(RecipeFile::recipe).transpose()?;
        let method = match (&recipe, name, self.model, self.samples) {
            (Some(recipe), MethodName::Ours, ..) => Method::Ours(recipe),
            (Some(recipe), MethodName::Meta, ..) => Method::Meta(recipe),
            (_, _, Some(model), Some(samples)) => Method::Random {
                model: model.into(),
                samples,
                steps: INNER_STEPS,
            },
            _ => bail!("give --model and --samples"),
        };
        let verdict = Judge::new(&materials, seed).judge(method, seed, self.seeds)?;
        if self.json {
            print(&(serde_json::to_string_pretty(&verdict)? + "\n"))
        } else {
            print(&table(&verdict))
        }
    }

    /// Trains what the method needs.
    fn learn(&self, name: MethodName, seed: u64) -> anyhow::Result<RecipeFile> {
        let (Some(model), Some(samples)) = (self.model, self.samples) else {
            bail!("give --model and --samples");
        };
        let options = Options {
            model: model.into(),
            samples,
            schedule: Schedule::Joint,
            effort: self.effort,
            without_pattern: name == MethodName::Meta,
            seed,
            checkpoints: None,
        };
        let learned = train_with_progress(&options, load(&self.train)?)?;
        recipe_of(&learned, &options, &self.train)
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
