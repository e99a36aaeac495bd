//! `trainer reproduce`

use std::path::{Path, PathBuf};

use anyhow::{bail, ensure};
use clap::Args;
use clap::builder::PossibleValuesParser;
use glimpse_evaluation::evaluation::{TrainingMaterials, TrainingOverlap};
use glimpse_fitting::recipe::options::Effort;
use glimpse_materials::{Identity, Source};

use super::lock::Lock;
use super::output::create_out_folder;
use super::progress::{catch_interrupts, interrupted};
use super::train::train_to_file;
use super::{load, numbers, print, training_overlap};
use crate::experiment::{self, Experiment, Scope, Settings, Store, TestSet};
use crate::report::Table;

/// Reproduce the paper's tables and figures on your materials.
///
/// Each experiment trains and evaluates methods, and prints its tables, with the paper's numbers
/// where there are any. It writes them into OUT/EXPERIMENT as CSV and SVG, and all of them as the page
/// index.html; evaluations.csv has a row for each evaluation. Recipes and evaluations are saved in OUT. Experiments share them, and the
/// same command continues after Ctrl-C or kill -9.
///
/// Example: trainer reproduce same-samples --data MERL-train/ --test MERL-test/ --out paper/
///          trainer reproduce all --effort quick --data MERL-train/ --test MERL-test/ --out paper/
///          trainer reproduce losses --paper-effort long --data MERL-train/ --test MERL-test/
///          trainer reproduce additional --data MERL/ --test MERL-test/ --additional RGL/ --out paper/
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Reproduce {
    /// Name of the experiment
    #[arg(value_parser = PossibleValuesParser::new(experiment::names()))]
    experiment: String,
    /// Training materials
    #[arg(long, value_name = "SOURCE", default_value = "procedural:100")]
    data: Source,
    /// Test materials, none of them a training material
    #[arg(long, value_name = "SOURCE", default_value = "procedural:20:1")]
    test: Source,
    /// Additional test materials of the experiment `additional`; can be given several times
    #[arg(long, value_name = "SOURCE")]
    additional: Vec<Source>,
    /// Output folder
    #[arg(long, short, default_value = "paper")]
    out: PathBuf,
    /// Length of each training with the schedule `prior`
    #[arg(long, value_enum, default_value_t = Effort::Quick)]
    effort: Effort,
    /// Length of each training with the schedule `paper` [default: that of --effort]
    #[arg(long, value_name = "EFFORT", value_enum)]
    paper_effort: Option<Effort>,
    /// Number of repetitions of random methods, 1 to 10000
    #[arg(long, default_value_t = 5, value_parser = numbers::seeds)]
    seeds: u64,
    /// Largest n of experiments with several n, 1 to 4096 [default: 64 for --effort brief and quick,
    /// else 512]
    #[arg(long = "most-samples", value_parser = numbers::number(1..=4_096_usize))]
    max_samples: Option<usize>,
    /// Name of the only table to print, with its caption, as Markdown. It is the name of the table's
    /// file in OUT/EXPERIMENT without its extension
    #[arg(long, value_name = "NAME")]
    table: Option<String>,
}

/// The largest n in the paper's plots.
const MAX_SAMPLES: usize = 512;

impl Reproduce {
    /// Refuses options that no experiment uses.
    fn refuse_unused_options(&self, experiments: &[&Experiment]) -> anyhow::Result<()> {
        let name = &self.experiment;
        ensure!(
            self.additional.is_empty() || experiments.iter().any(|one| one.evaluates_additional()),
            "--additional has no effect: {name} evaluates on --test only; remove it"
        );
        ensure!(
            self.max_samples.is_none() || experiments.iter().any(|one| one.varies_samples()),
            "--most-samples has no effect: {name} has a fixed n; remove it"
        );
        Ok(())
    }

    /// Runs the experiments.
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        let experiments = experiment::named(&self.experiment, !self.additional.is_empty());
        self.refuse_unused_options(&experiments)?;
        catch_interrupts()?;
        create_out_folder(&self.out)?;
        let _lock = Lock::of_folder(&self.out)?;
        let max_samples = match (self.max_samples, self.effort) {
            (Some(max), _) => max,
            (None, Effort::Brief | Effort::Quick) => 64,
            (None, _) => MAX_SAMPLES,
        };
        let training = load(&self.data)?;
        let test = load(&self.test)?;
        let identities = training.iter().map(|material| Identity::new(&**material));
        let trained_on: TrainingMaterials = identities.collect();
        for material in &test {
            if trained_on.overlap(&**material) != TrainingOverlap::Unseen {
                bail!(
                    "{} is in both --data and --test: remove it from one of them",
                    material.name()
                );
            }
        }
        let additional = self.additional.iter().map(load);
        let additional = additional.collect::<anyhow::Result<Vec<_>>>()?;
        for materials in &additional {
            training_overlap::warn(Some(&trained_on), materials);
        }
        let test = TestSet::new("test".into(), &self.test, &test);
        let additional = self.additional.iter().zip(&additional).zip(1..);
        let additional = additional.map(|((source, materials), number)| {
            let name = format!("{number}-{}", source.label().replace([':', '/'], "-"));
            TestSet::new(name, source, materials)
        });
        let sets: Vec<TestSet<'_>> = [test].into_iter().chain(additional).collect();
        let settings = Settings {
            out: self.out.clone(),
            data: self.data.clone(),
            effort: self.effort,
            paper_effort: self.paper_effort.unwrap_or(self.effort),
            seed,
            seeds: self.seeds,
            interrupted,
        };
        let train = |options: &_, materials, checkpoints: &_, data: &str, out: &Path| {
            let outcome = train_to_file(options, materials, checkpoints, data, out);
            // After Ctrl-C, training has saved its state and ends with an error.
            ensure!(!interrupted(), "stopped: repeat the command to continue");
            outcome.map(drop)
        };
        let scope = Scope {
            max_samples,
            training_count: training.len(),
        };
        let store = Store::open(settings, &training, &sets, &train)?;
        drop(training);
        for (number, experiment) in (1..).zip(&experiments) {
            eprintln!("[{number}/{}] {}", experiments.len(), experiment.name);
            let folder = self.out.join(experiment.name);
            let tables = experiment.write(&store, &scope, &folder)?;
            eprintln!("wrote {}", folder.join("index.html").display());
            self.print(&tables)?;
        }
        Ok(())
    }

    /// Prints all tables of an experiment, or that of --table.
    fn print(&self, tables: &[(String, Table)]) -> anyhow::Result<()> {
        let shown = tables
            .iter()
            .filter(|(name, _)| self.table.as_ref().is_none_or(|table| name == table));
        let texts = shown.map(|(_, table)| format!("{}\n{}\n", table.to_markdown(), table.caption));
        let texts: Vec<String> = texts.collect();
        if let (true, Some(table)) = (texts.is_empty(), &self.table) {
            let names: Vec<&str> = tables.iter().map(|(name, _)| &name[..]).collect();
            bail!(
                "--table {table}: unknown table; give one of {}",
                names.join(", ")
            );
        }
        print(&texts.join("\n"))
    }
}
