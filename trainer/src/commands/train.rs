//! `trainer train`

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::Context;
use clap::Args;
use glimpse_core::recipe::Provenance;
use glimpse_trainer::export::{RecipeFile, to_recipe, to_ridge_recipe};
use glimpse_trainer::linear::Prior;
use glimpse_trainer::material::Source;
use glimpse_trainer::meta::checkpoint::Checkpoint;
use glimpse_trainer::meta::outer::Checkpoints;
use glimpse_trainer::meta::plan::{Effort, Schedule};
use glimpse_trainer::meta::run::{Learned, Options};

use super::progress::train_with_progress;
use super::{ModelName, PriorArgs, load, write_file};

/// Train a recipe on materials.
///
/// Every tenth material is held out; the loss on those is what the recipe promises, and the best
/// meta-parameters by it are kept. The run is saved every ten seconds and upon Ctrl-C; repeat the
/// command with --resume to go on.
///
/// Example: trainer train --model neural --samples 8 --data MERL/ --out neural-n8.recipe
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Train {
    /// The model to fit
    #[arg(long, value_enum)]
    model: ModelName,
    /// How many directions the scanner will measure
    #[arg(long, short = 'n')]
    samples: usize,
    /// Materials to train on
    #[arg(long, default_value = "procedural:100")]
    data: Source,
    /// The recipe file to write
    #[arg(long, short)]
    out: PathBuf,
    #[command(flatten)]
    prior: PriorArgs,
    /// How the parts are trained
    #[arg(long, value_enum, default_value_t = Schedule::Joint)]
    schedule: Schedule,
    /// How long to train
    #[arg(long, value_enum, default_value_t = Effort::Standard)]
    effort: Effort,
    /// Where to keep the run while it lasts [default: OUT.checkpoint]
    #[arg(long)]
    checkpoint: Option<PathBuf>,
    /// Go on from the checkpoint
    #[arg(long)]
    resume: bool,
}

impl Train {
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        let directory = match &self.checkpoint {
            Some(directory) => directory.clone(),
            None => beside(&self.out),
        };
        // Better now than after an hour.
        let parent = self.out.parent().filter(|parent| *parent != Path::new(""));
        let parent = parent.unwrap_or(Path::new("."));
        std::fs::create_dir_all(parent)
            .and_then(|()| tempfile::NamedTempFile::new_in(parent).map(drop))
            .with_context(|| format!("cannot write to {}", parent.display()))?;

        let materials = load(&self.data)?;
        let options = Options {
            model: self.model.into(),
            samples: self.samples,
            schedule: self.schedule,
            effort: self.effort,
            without_pattern: false,
            prior: self.prior.or(match self.schedule {
                Schedule::Paper => Prior::PAPER,
                Schedule::Joint => Prior::LEARNED,
            })?,
            seed,
            checkpoints: Some(Checkpoints {
                directory: directory.clone(),
                every: Duration::from_secs(10),
                resume: self.resume,
            }),
        };
        let begin = Instant::now();
        let learned = train_with_progress(&options, materials)?;
        let file = recipe_of(&learned, &options, &self.data)?;
        if let Learned::Ridge(learned) = &learned {
            // First: a recipe without its basis would be of no use.
            write_file(&self.out.with_extension("basis"), &learned.basis)?;
        }
        write_file(&self.out, file.bytes())?;
        Checkpoint::remove(&directory);
        eprintln!(
            "trained in {:.0} s; expect a loss of {:.4} on an unseen material",
            begin.elapsed().as_secs_f64(),
            learned.expected_loss()
        );
        Ok(())
    }
}

/// Writes down what was learned, with where it came from.
pub(crate) fn recipe_of(
    learned: &Learned,
    options: &Options,
    data: &Source,
) -> anyhow::Result<RecipeFile> {
    let schedule = format!("{:?} {:?}", options.schedule, options.effort).to_lowercase();
    let provenance = Provenance {
        trainer: concat!("glimpse-trainer ", env!("CARGO_PKG_VERSION")),
        data: label(data),
        materials: learned.materials() as u32,
        schedule: &schedule,
        seed: options.seed,
    };
    let file = match learned {
        Learned::Descent(learned) => to_recipe(learned, &provenance),
        Learned::Ridge(learned) => to_ridge_recipe(&learned.reduced, &provenance),
    };
    file.context("training did not converge to a recipe")
}

/// A source's name without the directories that lead to it: those are nobody's business.
fn label(source: &Source) -> &str {
    let name = Path::new(&source.0)
        .file_name()
        .and_then(|name| name.to_str());
    name.unwrap_or(&source.0)
}

/// OUT.checkpoint
fn beside(out: &Path) -> PathBuf {
    let mut name = out.as_os_str().to_owned();
    name.push(".checkpoint");
    name.into()
}
