//! `trainer train`

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use clap::Args;
use glimpse_core::recipe::Recipe;
use glimpse_trainer::export::{RecipeFile, options_of, provenance, recipe_of, schedule_of};
use glimpse_trainer::files::try_write;
use glimpse_trainer::linear::{Basis, Prior};
use glimpse_trainer::material::{Material, Source};
use glimpse_trainer::meta::checkpoint::Checkpoint;
use glimpse_trainer::meta::outer::Checkpoints;
use glimpse_trainer::meta::plan::{Effort, Schedule};
use glimpse_trainer::meta::run::{Learned, Options, Parts};

use super::progress::train_with_progress;
use super::{ModelName, PriorArgs, load, write_file};

/// Train a recipe on materials, or many with --grid.
///
/// Every tenth material is held out, and the loss on those is what the recipe promises. (Linear
/// holds none out: each material is learned on with the components of others.)
///
/// The run is saved every ten seconds and upon Ctrl-C; repeat the command with --resume to go on. A
/// resumed run, however it ended, comes to the same bytes as an undisturbed one.
///
/// With --grid every one of several models is trained at every one of several n, into
/// OUT/MODEL-nN.recipe. Recipes that are there already are not trained again, so that the same
/// command goes on after Ctrl-C; a cell that fails does not stop the others. A table of all of them
/// is printed at the end, and kept in OUT/grid.csv.
///
/// Example: trainer train --model neural --samples 8 --data MERL/ --out neural-n8.recipe
///          trainer train --grid --model phong,neural --samples 1,2,4,8 --data MERL/ --out recipes/
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Train {
    /// The model to fit; in a grid several, separated by commas [default there: all]
    #[arg(
        long,
        value_enum,
        value_delimiter = ',',
        required_unless_present = "grid"
    )]
    pub(super) model: Vec<ModelName>,
    /// How many directions the scanner will measure; in a grid several [default there: 1,2,4,...,512]
    #[arg(
        long,
        short = 'n',
        value_delimiter = ',',
        required_unless_present = "grid"
    )]
    pub(super) samples: Vec<usize>,
    /// Materials to train on
    #[arg(long, default_value = "procedural:100")]
    pub(super) data: Source,
    /// The recipe file to write; in a grid the directory
    #[arg(long, short)]
    pub(super) out: PathBuf,
    #[command(flatten)]
    prior: PriorArgs,
    /// How the parts are trained
    #[arg(long, value_enum, default_value_t = Schedule::Joint)]
    schedule: Schedule,
    /// How long to train
    #[arg(long, value_enum, default_value_t = Effort::Standard)]
    effort: Effort,
    /// Where to keep the run while it lasts [default: OUT.checkpoint]
    #[arg(long, conflicts_with = "grid")]
    checkpoint: Option<PathBuf>,
    /// Save the run when so many seconds have passed; 0 saves it after every step
    #[arg(long, value_name = "SECONDS", default_value = "10", value_parser = seconds)]
    checkpoint_every: Duration,
    /// Go on from the checkpoint, if there is one (a grid always does)
    #[arg(long)]
    resume: bool,
    /// Train many recipes, one for each of the models at each n
    #[arg(long)]
    pub(crate) grid: bool,
}

fn seconds(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text.parse().map_err(|_| "it is no number".to_owned())?;
    Duration::try_from_secs_f64(seconds).map_err(|error| error.to_string())
}

impl Train {
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        let (&[model], &[samples]) = (&self.model[..], &self.samples[..]) else {
            bail!("several models, or several numbers of samples, take --grid");
        };
        let job = self.job(model, samples, self.out.clone(), seed)?;
        // Better now than after an hour.
        job.try_write()?;
        let materials = load(&self.data)?;
        if self.resume && !Checkpoint::is_in(&job.checkpoint) {
            if matches!(job.find(materials.len()), Found::Done(_)) {
                job.clean_up();
                eprintln!("nothing is left to do: {} is trained", self.out.display());
                return Ok(());
            }
            eprintln!(
                "no checkpoint in {}: starting from the beginning",
                job.checkpoint.display()
            );
        }
        let begin = Instant::now();
        let expected_loss = job.train(materials, self.resume)?;
        eprintln!(
            "trained in {:.0} s; expect a loss of {expected_loss:.4} on an unseen material",
            begin.elapsed().as_secs_f64(),
        );
        Ok(())
    }

    /// The training of one recipe.
    pub(super) fn job(
        &self,
        model: ModelName,
        samples: usize,
        out: PathBuf,
        seed: u64,
    ) -> anyhow::Result<Job<'_>> {
        let default = match self.schedule {
            Schedule::Paper => Prior::PAPER,
            Schedule::Joint => Prior::LEARNED,
        };
        Ok(Job {
            options: Options {
                model: model.into(),
                samples,
                schedule: self.schedule,
                effort: self.effort,
                parts: Parts::All,
                prior: self.prior.or(default)?,
                seed,
                checkpoints: None,
            },
            data: &self.data,
            checkpoint: match &self.checkpoint {
                Some(directory) => directory.clone(),
                None => beside(&out),
            },
            every: self.checkpoint_every,
            out,
        })
    }
}

/// The training of one recipe.
pub(super) struct Job<'a> {
    options: Options,
    data: &'a Source,
    pub(super) out: PathBuf,
    pub(super) checkpoint: PathBuf,
    every: Duration,
}

/// What is there before a recipe is trained.
pub(super) enum Found {
    /// No recipe.
    Nothing,
    /// The one that training would write, and the loss that it promises.
    Done(f32),
    /// Something else, in words.
    Other(String),
}

impl Job<'_> {
    /// Makes sure that the recipe can be written.
    fn try_write(&self) -> anyhow::Result<()> {
        // The largest recipe but for Linear's: a network's with 512 samples takes 12 KB, the names
        // of a thousand materials some 30.
        try_write(&self.out, 1 << 16)
            .with_context(|| format!("cannot write {}", self.out.display()))
    }

    /// Looks at what is there, judged by its provenance.
    pub(super) fn find(&self, materials: usize) -> Found {
        if !self.out.exists() {
            return Found::Nothing;
        }
        let file = match RecipeFile::read(&self.out) {
            Ok(file) => file,
            Err(error) => return Found::Other(error.to_string()),
        };
        let parsed = file.recipe();
        let parsed = parsed.and_then(|recipe| Ok((recipe, recipe.statements()?)));
        let (recipe, statements) = match parsed {
            Ok(parsed) => parsed,
            Err(error) => return Found::Other(error.to_string()),
        };
        let schedule = schedule_of(&self.options);
        let provenance = provenance(&self.options, self.data, materials, &schedule);
        let wanted = options_of(self.options.model.name(), self.options.samples, &provenance);
        let (Some(provenance), Some(expectation)) = (statements.provenance, statements.expectation)
        else {
            return Found::Other(format!(
                "{} does not say how it was trained",
                self.out.display()
            ));
        };
        let found = options_of(recipe.model().name(), recipe.samples(), &provenance);
        match found == wanted && self.has_basis(&recipe) {
            true => Found::Done(expectation.loss),
            false if found == wanted => {
                Found::Other(format!("{} lacks its basis", self.out.display()))
            }
            false => Found::Other(format!(
                "{} was trained otherwise ({found}, not {wanted})",
                self.out.display()
            )),
        }
    }

    fn has_basis(&self, recipe: &Recipe<'_>) -> bool {
        recipe.ridge().is_none() || Basis::beside(&self.out).exists()
    }

    /// Trains and writes it; returns the loss that it promises.
    pub(super) fn train(
        &self,
        materials: Vec<Box<dyn Material>>,
        resume: bool,
    ) -> anyhow::Result<f32> {
        self.try_write()?;
        let options = Options {
            checkpoints: Some(Checkpoints {
                directory: self.checkpoint.clone(),
                every: self.every,
                resume,
            }),
            ..self.options.clone()
        };
        let learned = train_with_progress(&options, materials)?;
        let file = recipe_of(&learned, &options, self.data)?;
        if let Learned::Ridge(learned) = &learned {
            // First: a recipe without its basis would be of no use.
            write_file(&Basis::beside(&self.out), &learned.basis)?;
        }
        write_file(&self.out, file.bytes())?;
        self.clean_up();
        Ok(learned.promise().expected.loss)
    }

    /// Removes the checkpoint.
    pub(super) fn clean_up(&self) {
        Checkpoint::remove(&self.checkpoint);
    }
}

/// OUT.checkpoint
fn beside(out: &Path) -> PathBuf {
    let mut name = out.as_os_str().to_owned();
    name.push(".checkpoint");
    name.into()
}
