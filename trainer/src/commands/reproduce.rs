//! `trainer reproduce`

use std::path::PathBuf;

use anyhow::{anyhow, bail};
use clap::Args;
use glimpse_materials::Source;
use glimpse_materials::files::try_write;
use glimpse_trainer::evaluation::TrainedOn;
use glimpse_training::meta::plan::Effort;

use super::cells::{self, Given, for_a_shell, paths_of, text_of, texts_of};
use super::known::{known, lines};
use super::lock::Lock;
use super::output::make_out;
use super::progress::{catch_interrupts, interrupted, train_with_progress};
use super::{environment, load, numbers, print};
use crate::experiment::{
    Experiment, Findings, Needed, Notes, Purpose, Settings, Store, TestSet, Wanted, write_index,
};

/// Make the paper's tables and figures again, on your materials.
///
/// Each experiment trains what it needs, judges it, prints its tables (the paper's figures beside
/// ours where the paper gives some) and writes them into OUT/EXPERIMENT as CSV, JSON and SVG.
/// OUT/index.html shows all that was made. Recipes and judgments are kept in OUT: experiments share
/// them, and the same command goes on after Ctrl-C or kill -9.
///
/// With --list each of them is printed as a command of its own, for a cluster, in an order in which they
/// can be done; what they leave is what this command would, which finds them done then and prints the
/// tables.
///
/// Example: trainer reproduce same-samples --data MERL-train/ --test MERL-test/ --out paper/
///          trainer reproduce all --effort quick --data MERL-train/ --test MERL-test/ --out paper/
///          trainer reproduce losses --effort standard --paper-effort long --data MERL-train/ --test MERL-test/
///          trainer reproduce additional --data MERL/ --test MERL-test/ --additional RGL/ --out paper/
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Reproduce {
    /// The experiment
    #[arg(value_enum)]
    experiment: Experiment,
    /// Materials to train on
    #[arg(long, default_value = "procedural:100")]
    data: Source,
    /// Materials to judge on, none of which is trained on
    #[arg(long, default_value = "procedural:20:1")]
    test: Source,
    /// Further materials to judge on, for the experiment `additional`; may be given several times
    #[arg(long)]
    additional: Vec<Source>,
    /// The folder to write to
    #[arg(long, short, default_value = "paper")]
    out: PathBuf,
    /// Length of each training
    #[arg(long, value_enum, default_value_t = Effort::Quick)]
    effort: Effort,
    /// Length of trainings by schedule paper, in `losses` and `again` [default: that of --effort]
    #[arg(long, value_name = "EFFORT", value_enum)]
    paper_effort: Option<Effort>,
    /// Repetitions of random methods
    #[arg(long, default_value_t = 5, value_parser = numbers::seeds)]
    seeds: u64,
    /// Light of the spheres: a panorama (*.hdr or *.exr) [default: the built-in studio]
    #[arg(long, value_name = "FILE")]
    environment: Option<PathBuf>,
    /// The most samples, where n grows, 1 to 4096 [default: 64 for --effort quick, else 512]
    #[arg(long, value_parser = numbers::samples)]
    most_samples: Option<usize>,
    /// Print only this table with its caption, as Markdown; tables are called as their files in OUT/EXPERIMENT are
    #[arg(long, value_name = "NAME")]
    table: Option<String>,
    /// Make nothing, and print each training and each judgment that is needed as a command of its own, one
    /// line of JSON each: its words, what it reads and writes, and whether it is done
    #[arg(long, conflicts_with = "table")]
    pub(crate) list: bool,
    /// Make only this training or judgment, called as --list names it, and print nothing
    #[arg(long, value_name = "CELL", conflicts_with_all = ["table", "list"])]
    only: Option<String>,
}

/// The largest n of the paper's curves.
const MOST_SAMPLES: usize = 512;

impl Reproduce {
    /// Refuses, by name, what the experiment makes no use of.
    fn refuse_what_has_no_effect(&self) -> anyhow::Result<()> {
        let name = self.experiment.name();
        if !self.additional.is_empty() && !self.experiment.evaluates_additional() {
            bail!("--additional has no effect: {name} judges on --test only");
        }
        if self.most_samples.is_some() && !self.experiment.grows() {
            bail!("--most-samples has no effect: in {name} n does not grow");
        }
        if self.paper_effort.is_some() && !self.experiment.trains_as_the_paper() {
            bail!("--paper-effort has no effect: {name} trains nothing by schedule paper");
        }
        Ok(())
    }

    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        let purpose = match &self.only {
            None => Purpose::Everything,
            Some(name) => Purpose::Only(Wanted::new(name.clone())),
        };
        self.perform(seed, purpose).map(|_| ())
    }

    /// Prints what is needed, each as a command of its own.
    pub(crate) fn list(&self, seed: u64, given: &Given) -> anyhow::Result<()> {
        let needed = self.perform(seed, Purpose::Listing(Notes::default()))?;
        let sources = [&self.data, &self.test].into_iter().chain(&self.additional);
        let mut paths = paths_of(sources);
        if let Some(path) = &self.environment {
            paths.push(text_of(path)?);
        }
        let cell = |needed: Needed| -> anyhow::Result<cells::Cell> {
            let command = given.but(&["list"], &[format!("--only={}", needed.name)]);
            let mut inputs = paths.clone();
            inputs.extend(texts_of(&needed.inputs)?);
            Ok(cells::Cell {
                shell: for_a_shell(&command)?,
                command,
                inputs,
                checkpoint: needed.checkpoint.as_deref().map(text_of).transpose()?,
                done: needed.is_done,
                outputs: texts_of(&needed.outputs)?,
                name: needed.name,
                in_the_way: None,
            })
        };
        let cells = needed.into_iter().map(cell);
        cells::print_all(&cells.collect::<anyhow::Result<Vec<_>>>()?)
    }

    /// Runs the experiments; returns what was taken note of.
    fn perform(&self, seed: u64, purpose: Purpose) -> anyhow::Result<Vec<Needed>> {
        catch_interrupts()?;
        let most_samples = match (self.most_samples, self.effort) {
            (Some(most), _) => most,
            (None, Effort::Brief | Effort::Quick) => 64,
            (None, _) => MOST_SAMPLES,
        };
        self.refuse_what_has_no_effect()?;
        make_out(&self.out)?;
        let index = self.out.join("index.html");
        let _lock = self.lock(&purpose)?;
        if matches!(purpose, Purpose::Everything) {
            try_write(&index, 1 << 16)
                .map_err(|error| anyhow!("cannot write {}: {error}", index.display()))?;
        }
        let environment = environment(self.environment.as_deref())?;
        let training = load(&self.data)?;
        let test = load(&self.test)?;
        let trained_on = TrainedOn::of_materials(&training);
        for material in &test {
            if trained_on.knows(&**material).is_some() {
                bail!(
                    "{} is in --data and in --test: what is judged must not be trained on",
                    material.name()
                );
            }
        }
        let additional = self.additional.iter().map(load);
        let additional = additional.collect::<anyhow::Result<Vec<_>>>()?;
        for materials in &additional {
            let names: Vec<&str> = materials.iter().map(|material| material.name()).collect();
            let known = known(Some(&trained_on), materials);
            for line in lines(known.as_deref(), &names) {
                eprintln!("{line}");
            }
        }
        let test = TestSet::new("test".into(), &self.test, &test, &environment);
        let additional: Vec<TestSet<'_>> = self
            .additional
            .iter()
            .zip(&additional)
            .zip(1..)
            .map(|((source, materials), number)| {
                let name = format!("{number}-{}", source.label().replace([':', '/'], "-"));
                TestSet::new(name, source, materials, &environment)
            })
            .collect();
        let settings = Settings {
            out: self.out.clone(),
            data: self.data.clone(),
            effort: self.effort,
            paper_effort: self.paper_effort.unwrap_or(self.effort),
            seed,
            seeds: self.seeds,
            light: match &self.environment {
                Some(path) => path.display().to_string(),
                None => "the built-in studio".into(),
            },
        };
        let store = Store::open(
            settings,
            purpose,
            &training,
            &test,
            &additional,
            &train_with_progress,
        )?;
        drop(training);
        let experiments = self.experiment.each(!additional.is_empty());
        for (index, experiment) in experiments.iter().enumerate() {
            let number = index + 1;
            if matches!(store.purpose, Purpose::Everything) {
                eprintln!("[{number}/{}] {}", experiments.len(), experiment.name());
            }
            let outcome = experiment.run(&store, most_samples);
            if interrupted() {
                bail!("stopped; repeat the command to go on");
            }
            let findings = outcome?;
            match &store.purpose {
                Purpose::Everything => {
                    write_index(&store.settings)?;
                    print(&self.shown(&findings)?)?;
                }
                Purpose::Only(wanted) if wanted.was_found() => return Ok(Vec::new()),
                Purpose::Only(_) | Purpose::Listing(_) => {}
            }
        }
        match store.purpose {
            Purpose::Everything => {
                eprintln!("look at {}", index.display());
                Ok(Vec::new())
            }
            Purpose::Listing(notes) => Ok(notes.all()),
            Purpose::Only(_) => bail!(
                "{} needs nothing that is called {}: --list tells what it needs",
                self.experiment.name(),
                self.only.as_deref().unwrap_or_default()
            ),
        }
    }

    /// Keeps other runs from writing the same.
    fn lock(&self, purpose: &Purpose) -> anyhow::Result<Option<Lock>> {
        Ok(match (purpose, &self.only) {
            (Purpose::Everything, _) => Some(Lock::within(&self.out)?),
            (Purpose::Only(_), Some(name)) => {
                // Any name but that of something in there is told below to be none.
                let file = name.replace('/', "-");
                Some(Lock::beside(&self.out.join(file))?)
            }
            _ => None,
        })
    }

    /// What is printed of an experiment.
    fn shown(&self, findings: &Findings) -> anyhow::Result<String> {
        match &self.table {
            None => Ok(findings.to_text() + "\n"),
            Some(name) => findings
                .named(name)
                .map(|table| format!("{}\n{}\n", table.to_markdown(), table.caption))
                .map_err(|names| {
                    anyhow!("there is no table {name}; there are {}", names.join(", "))
                }),
        }
    }
}
