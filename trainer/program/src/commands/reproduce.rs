//! `trainer reproduce`

use anyhow::{bail, ensure};
use clap::Args;
use clap::builder::PossibleValuesParser;
use glimpse_evaluation::evaluation::TrainingOverlap;
use glimpse_fitting::recipe::options::Effort;
use glimpse_materials::{Identity, Source};

use super::lock::Lock;
use super::{load, numbers, print, training_overlap};
use crate::experiment::{self, Experiment, Settings, Store, TestSet};
use crate::progress::catch_interrupts;
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
    /// Test materials, none of them a training material
    #[arg(long, value_name = "SOURCE", default_value = "procedural:20:1")]
    test: Source,
    /// Additional test materials of the experiment `additional`; can be given several times
    #[arg(long, value_name = "SOURCE")]
    additional: Vec<Source>,
    #[command(flatten)]
    settings: Settings,
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
        catch_interrupts();
        let _lock = Lock::of_folder(&self.settings.out)?;
        let max_samples = match (self.max_samples, self.settings.effort) {
            (Some(max), _) => max,
            (None, Effort::Brief | Effort::Quick) => 64,
            (None, _) => MAX_SAMPLES,
        };
        let training = load(&self.settings.data)?;
        let test = load(&self.test)?;
        let trained_on = Identity::list(&training);
        for material in &test {
            let overlap = TrainingOverlap::of(&**material, &trained_on);
            if overlap != Some(TrainingOverlap::Unseen) {
                bail!(
                    "{} is in both --data and --test: remove it from one of them",
                    material.name()
                );
            }
        }
        let additional = self.additional.iter().map(load);
        let additional = additional.collect::<anyhow::Result<Vec<_>>>()?;
        for materials in &additional {
            training_overlap::warn(&trained_on, materials);
        }
        let test = TestSet::new("test".into(), &self.test, &test);
        let additional = self.additional.iter().zip(&additional).zip(1..);
        let additional = additional.map(|((source, materials), number)| {
            let name = format!("{number}-{}", source.label().replace([':', '/'], "-"));
            TestSet::new(name, source, materials)
        });
        let sets: Vec<TestSet<'_>> = [test].into_iter().chain(additional).collect();
        let settings = Settings {
            seed,
            ..self.settings.clone()
        };
        let store = Store::open(settings, &training, &sets)?;
        drop(training);
        for (number, experiment) in (1..).zip(&experiments) {
            eprintln!("[{number}/{}] {}", experiments.len(), experiment.name);
            let folder = self.settings.out.join(experiment.name);
            let tables = experiment.write(&store, max_samples, &folder)?;
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
