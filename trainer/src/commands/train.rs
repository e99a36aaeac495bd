//! `trainer train`

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use clap::Args;
use glimpse_core::model::ModelKind;
use glimpse_materials::basis::Basis;
use glimpse_materials::files::{is_stream, try_write};
use glimpse_materials::{Joined, Portion, Source, Sources};
use glimpse_training::linear::Prior;
use glimpse_training::meta::checkpoint::Checkpoint;
use glimpse_training::meta::options::Options;
use glimpse_training::meta::outer::Checkpoints;
use glimpse_training::meta::plan::{Effort, Schedule};
use glimpse_training::recipe::{RecipeFile, recipe_of};

use super::completion_args::CompletionArgs;
use super::existing::{Existing, existing_at};
use super::expected_loss::expected_loss;
use super::lock::Lock;
use super::output::write_file_forced;
use super::progress::train_with_progress;
use super::{ModelName, PriorArgs, load_all, numbers};

/// Train a recipe on materials, or many with --grid.
///
/// By default a recipe completes readings (--schedule prior): a small learned map makes of them what a
/// whole material is likely to be, and a descent goes on from there. It is trained on all materials;
/// then four times more, and shorter, without a quarter of them, to find what loss to promise for
/// unseen ones, and how to predict each material's from its readings.
///
/// By the schedules joint and paper every tenth material is held out, and the loss on those is what
/// the recipe promises. (Linear holds none out: each is learned on with the components of others.)
///
/// The run is saved every ten seconds and upon Ctrl-C; repeat the command with --resume to go on. A
/// resumed run, however it ended, comes to the same bytes as an undisturbed one.
///
/// A recipe that is there, of other options, stays unless --force is given; and while a run lasts no
/// other one writes the same recipe.
///
/// With --grid every one of several models is trained at every one of several n, into
/// OUT/MODEL-nN.recipe. Recipes that are there already are not trained again, so that the same
/// command goes on after Ctrl-C; a cell that fails does not stop the others. A table of all of them
/// is printed at the end, and kept in OUT/grid.csv.
///
/// With --grid --list each cell is printed as a command of its own, for a cluster: what they leave is
/// what the grid would, and the same command without --list finds them done and prints the table.
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
    /// How many directions the scanner will measure, 1 to 4096; in a grid several [default there:
    /// 1,2,4,...,512]
    #[arg(
        long,
        short = 'n',
        value_delimiter = ',',
        value_parser = numbers::samples,
        required_unless_present = "grid"
    )]
    pub(super) samples: Vec<usize>,
    /// Materials to train on; may be given several times
    #[arg(long, default_value = "procedural:100")]
    data: Vec<Source>,
    /// Schedule prior, several --data: in what proportion training takes materials of each, as 3,1
    /// [default: all materials alike]
    #[arg(long, value_name = "SHARE", value_delimiter = ',')]
    share: Vec<f32>,
    /// The recipe file to write; in a grid the directory
    #[arg(long, short)]
    pub(super) out: PathBuf,
    #[command(flatten)]
    pub(super) prior: PriorArgs,
    #[command(flatten)]
    completion_options: CompletionArgs,
    /// How the parts are trained
    #[arg(long, value_enum, default_value_t = Schedule::Prior)]
    schedule: Schedule,
    /// How long to train
    #[arg(long, value_enum, default_value_t = Effort::Standard)]
    effort: Effort,
    /// Where to keep the run while it lasts [default: OUT.checkpoint]
    #[arg(long, conflicts_with = "grid")]
    checkpoint: Option<PathBuf>,
    /// Seconds between two saves of the run, 0 to 1e9; 0 saves it after every step
    #[arg(long, value_name = "SECONDS", default_value = "10", value_parser = seconds)]
    checkpoint_every: Duration,
    /// Go on from the checkpoint, if there is one (a grid always does)
    #[arg(long, conflicts_with = "grid")]
    resume: bool,
    /// Replace a recipe of other options, or throw away a run that was not finished
    #[arg(long)]
    pub(super) force: bool,
    /// Train many recipes, one for each of the models at each n
    #[arg(long)]
    pub(crate) grid: bool,
    /// With --grid: train nothing, and print each recipe's own command as a line of JSON: its words, what it
    /// reads and writes, and whether it is done
    #[arg(long, requires = "grid")]
    pub(crate) list: bool,
}

fn seconds(text: &str) -> Result<Duration, String> {
    numbers::number(0.0..=1e9)(text).map(Duration::from_secs_f64)
}

impl Train {
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        self.prior.refuse_for_others(&self.model)?;
        let sources = self.sources()?;
        let (&[model], &[samples]) = (&self.model[..], &self.samples[..]) else {
            bail!("several models, or several numbers of samples, take --grid");
        };
        let job = self.job(model, samples, self.out.clone(), sources.label(), seed)?;
        job.refuse_streams(self.checkpoint.is_some())?;
        // Better now than after an hour.
        job.try_write()?;
        let _locks = job.lock()?;
        let materials = load_all(&sources)?;
        let found = job.find(&materials.1);
        job.refuse_to_lose(&found, self.resume, self.force)?;
        if self.resume && !Checkpoint::is_in(&job.checkpoint) {
            if matches!(found, Existing::Done(_)) {
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
        let trained = job.train(materials, self.resume)?;
        let expected_loss = expected_loss(&trained.file.recipe())?;
        eprintln!(
            "trained in {:.0} s; expected loss {}",
            begin.elapsed().as_secs_f64(),
            expected_loss.unwrap_or_else(|| "not stated".into()),
        );
        if let Some(rank) = trained.predicts {
            eprintln!(
                "each material's loss is predicted from its readings; over the folds ranks of predicted and \
                 true losses correlate by {rank:.2}"
            );
        }
        Ok(())
    }

    /// Where materials come from.
    pub(super) fn sources(&self) -> anyhow::Result<Sources> {
        if !self.share.is_empty() && self.schedule != Schedule::Prior {
            bail!("--share has no effect: it is for --schedule prior");
        }
        if !self.share.is_empty() && self.data.len() == 1 {
            bail!("--share has no effect with a single --data");
        }
        Ok(Sources::new(self.data.clone(), &self.share)?)
    }

    /// The training of one recipe, of materials that are called `data`.
    pub(super) fn job(
        &self,
        model: ModelName,
        samples: usize,
        out: PathBuf,
        data: String,
        seed: u64,
    ) -> anyhow::Result<Job> {
        let default = match self.schedule {
            Schedule::Paper => Prior::PAPER,
            Schedule::Joint | Schedule::Prior => Prior::LEARNED,
        };
        if self.schedule == Schedule::Prior {
            self.prior.refuse_for_schedule("prior")?;
        }
        Ok(Job {
            options: Options {
                prior: self.prior.or(default)?,
                completion_options: self.completion_options.of(self.schedule, samples)?,
                ..Options::new(model.into(), samples, self.schedule, self.effort, seed)
            },
            data,
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
pub(super) struct Job {
    options: Options,
    data: String,
    pub(super) out: PathBuf,
    pub(super) checkpoint: PathBuf,
    every: Duration,
}

/// A recipe that was trained.
pub(super) struct Trained {
    pub(super) file: RecipeFile,
    /// How well it ranks materials by the losses that it predicts for them.
    predicts: Option<f64>,
}

impl Job {
    /// Refuses a recipe that goes to a pipe or a device where a file has to lie beside it.
    fn refuse_streams(&self, has_checkpoint: bool) -> anyhow::Result<()> {
        if !is_stream(&self.out) {
            return Ok(());
        }
        if self.options.model == ModelKind::Linear {
            bail!(
                "{} is no regular file, and the model linear writes a basis beside its recipe: \
                 give a file as --out",
                self.out.display()
            );
        }
        if !has_checkpoint {
            bail!(
                "{} is no regular file, beside which a checkpoint could lie: say by --checkpoint \
                 where the run is kept",
                self.out.display()
            );
        }
        Ok(())
    }

    /// Keeps other runs from writing the same files.
    pub(super) fn lock(&self) -> anyhow::Result<Vec<Lock>> {
        let mut locks = Vec::new();
        if !is_stream(&self.out) {
            locks.push(Lock::beside(&self.out)?);
        }
        locks.push(Lock::beside(&self.checkpoint)?);
        Ok(locks)
    }

    /// Refuses to lose, without being told to, what somebody may have waited for.
    pub(super) fn refuse_to_lose(
        &self,
        found: &Existing,
        resume: bool,
        force: bool,
    ) -> anyhow::Result<()> {
        let unfinished = Checkpoint::is_in(&self.checkpoint);
        let basis = Basis::beside(&self.out);
        let is_linear = self.options.model == ModelKind::Linear;
        match found {
            _ if force => Ok(()),
            Existing::Other(what) => {
                bail!("{what}: give --force to replace it, or another --out")
            }
            _ if unfinished && !resume => bail!(
                "{} holds a run that was not finished: give --resume to go on with it, or --force \
                 to throw it away",
                self.checkpoint.display()
            ),
            // A run that was killed has left the basis and not the recipe, and is being resumed.
            Existing::Nothing if is_linear && basis.exists() && !unfinished => bail!(
                "{} is there without its recipe {}, and may belong to another one: give --force to \
                 replace it, or another --out",
                basis.display(),
                self.out.display()
            ),
            _ => Ok(()),
        }
    }

    /// Makes sure that the recipe can be written.
    fn try_write(&self) -> anyhow::Result<()> {
        // The largest recipe but for Linear's: a network's with 512 samples takes 12 KB, the names
        // of a thousand materials some 30. Where readings are completed it is 38, and 0.3 a sample.
        let bytes = match self.options.schedule {
            Schedule::Prior => (1 << 16) + 512 * self.options.samples,
            Schedule::Joint | Schedule::Paper => 1 << 16,
        };
        try_write(&self.out, bytes).with_context(|| format!("cannot write {}", self.out.display()))
    }

    /// What it writes.
    pub(super) fn outputs(&self) -> Vec<PathBuf> {
        match self.options.model {
            // First: it is written first.
            ModelKind::Linear => vec![Basis::beside(&self.out), self.out.clone()],
            _ => vec![self.out.clone()],
        }
    }

    /// Looks at what is there, for materials of these portions.
    pub(super) fn find(&self, portions: &[Portion]) -> Existing {
        let options = Options {
            portions: portions.to_vec(),
            ..self.options.clone()
        };
        existing_at(&self.out, &options, &self.data)
    }

    /// Trains and writes it; what is there is replaced.
    pub(super) fn train(
        &self,
        (materials, portions): Joined,
        resume: bool,
    ) -> anyhow::Result<Trained> {
        self.try_write()?;
        let options = Options {
            portions,
            checkpoints: Some(Checkpoints {
                directory: self.checkpoint.clone(),
                every: self.every,
                resume,
            }),
            ..self.options.clone()
        };
        if options.schedule == Schedule::Prior {
            eprintln!("training takes {}", self.mixture(&options.portions));
        }
        let learned = train_with_progress(&options, materials)?;
        let file = recipe_of(&learned, &options, &self.data)?;
        if let Some(basis) = &learned.basis {
            // First: a recipe without its basis would be of no use.
            write_file_forced(&Basis::beside(&self.out), basis, true)?;
        }
        write_file_forced(&self.out, file.bytes(), true)?;
        self.clean_up();
        Ok(Trained {
            file,
            predicts: learned.prediction.and_then(|each| each.rank_correlation),
        })
    }

    /// What tasks are of, in words.
    fn mixture(&self, portions: &[Portion]) -> String {
        let procedural = self.options.completion_options.procedural;
        let percent = |share: f32| 100.0 * share;
        let mut parts: Vec<String> = portions
            .iter()
            .map(|portion| {
                let share = percent(portion.share * (1.0 - procedural));
                format!("{share:.0} % of {} materials", portion.materials)
            })
            .collect();
        if procedural > 0.0 {
            parts.push(format!(
                "{:.0} % of procedural ones (--procedural)",
                percent(procedural)
            ));
        }
        parts.join(", ")
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
