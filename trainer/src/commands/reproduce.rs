//! `trainer reproduce`

use std::path::PathBuf;

use anyhow::{anyhow, bail};
use clap::Args;
use glimpse_trainer::evaluation::TrainedOn;
use glimpse_trainer::files::try_write;
use glimpse_trainer::material::Source;
use glimpse_trainer::meta::plan::Effort;
use glimpse_trainer::report::Table;

use super::known::{known, lines};
use super::lock::Lock;
use super::output::make_out;
use super::progress::{catch_interrupts, interrupted, train_with_progress};
use super::{environment, load, numbers, print};
use crate::experiment::{Experiment, Findings, Settings, Store, TestSet, write_index};

/// Make the paper's tables and figures again, on your materials.
///
/// Each experiment trains what it needs, judges it, prints its tables (the paper's figures beside
/// ours where the paper gives some) and writes them into OUT/EXPERIMENT as CSV, JSON, SVG and PNG.
/// OUT/index.html shows all that was made. Recipes and judgements are kept in OUT: experiments share
/// them, and the same command goes on after Ctrl-C or kill -9.
///
/// Example: trainer reproduce same-samples --data MERL-train/ --test MERL-test/ --out paper/
///          trainer reproduce all --effort quick --data MERL-train/ --test MERL-test/ --out paper/
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
    /// How long to train each recipe
    #[arg(long, value_enum, default_value_t = Effort::Quick)]
    effort: Effort,
    /// Repetitions of random methods
    #[arg(long, default_value_t = 5, allow_negative_numbers = true, value_parser = numbers::seeds)]
    seeds: u64,
    /// Light of the spheres: a panorama (*.hdr or *.exr) [default: the built-in studio]
    #[arg(long, value_name = "FILE")]
    environment: Option<PathBuf>,
    /// The most samples, where n grows, 1 to 4096 [default: 64 for --effort quick, else 512]
    #[arg(long, allow_negative_numbers = true, value_parser = numbers::samples)]
    most_samples: Option<usize>,
    /// Print only this table, as Markdown; tables are called as their files in OUT/EXPERIMENT are
    #[arg(long, value_name = "NAME")]
    table: Option<String>,
}

/// The largest n of the paper's curves.
const MOST_SAMPLES: usize = 512;

impl Reproduce {
    /// Refuses, by name, what the experiment makes no use of.
    fn refuse_what_has_no_effect(&self) -> anyhow::Result<()> {
        let name = self.experiment.name();
        if !self.additional.is_empty() && !self.experiment.judges_additional() {
            bail!("--additional has no effect: {name} judges on --test only");
        }
        if self.most_samples.is_some() && !self.experiment.grows() {
            bail!("--most-samples has no effect: in {name} n does not grow");
        }
        Ok(())
    }

    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        catch_interrupts()?;
        let most_samples = match (self.most_samples, self.effort) {
            (Some(most), _) => most,
            (None, Effort::Brief | Effort::Quick) => 64,
            (None, _) => MOST_SAMPLES,
        };
        self.refuse_what_has_no_effect()?;
        make_out(&self.out)?;
        let _lock = Lock::within(&self.out)?;
        let index = self.out.join("index.html");
        try_write(&index, 1 << 16)
            .map_err(|error| anyhow::anyhow!("cannot write {}: {error}", index.display()))?;
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
        let sources = format!(
            "trained on {} ({} materials), judged on {} ({})",
            self.data.label(),
            training.len(),
            self.test.label(),
            test.len()
        );
        let test = TestSet::new("test".into(), &test, &environment);
        let additional: Vec<TestSet<'_>> = self
            .additional
            .iter()
            .zip(&additional)
            .zip(1..)
            .map(|((source, materials), number)| {
                let name = format!("{number}-{}", source.label().replace([':', '/'], "-"));
                TestSet::new(name, materials, &environment)
            })
            .collect();
        let settings = Settings {
            out: self.out.clone(),
            data: self.data.clone(),
            effort: self.effort,
            seed,
            seeds: self.seeds,
            light: match &self.environment {
                Some(path) => path.display().to_string(),
                None => "the built-in studio".into(),
            },
        };
        let store = Store::open(
            settings,
            &training,
            &test,
            &additional,
            &train_with_progress,
        )?;
        drop(training);
        let experiments = self.experiment.each(!additional.is_empty());
        for (index, experiment) in experiments.iter().enumerate() {
            eprintln!(
                "[{}/{}] {}",
                index + 1,
                experiments.len(),
                experiment.name()
            );
            let outcome = experiment.run(&store, most_samples, &sources);
            if interrupted() {
                bail!("stopped; repeat the command to go on");
            }
            let findings = outcome?;
            write_index(&store.settings)?;
            print(&self.shown(&findings)?)?;
        }
        eprintln!("look at {}", index.display());
        Ok(())
    }

    /// What is printed of an experiment.
    fn shown(&self, findings: &Findings) -> anyhow::Result<String> {
        match &self.table {
            None => Ok(findings.to_text() + "\n"),
            Some(name) => findings
                .named(name)
                .map(Table::to_markdown)
                .map_err(|names| {
                    anyhow!("there is no table {name}; there are {}", names.join(", "))
                }),
        }
    }
}
