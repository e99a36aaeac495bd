//! The subcommands, one file each; results go to stdout or --out, talk goes to stderr.

pub(crate) mod bench;
pub(crate) mod cells;
pub(crate) mod completion;
mod completion_args;
pub(crate) mod convert;
pub(crate) mod evaluate;
mod evaluation_report;
mod existing;
mod expected_loss;
pub(crate) mod export;
mod export_basis;
pub(crate) mod fit;
mod formats;
pub(crate) mod grid;
pub(crate) mod inspect;
mod known;
mod limits;
mod lock;
pub(crate) mod message;
pub(crate) mod numbers;
mod output;
pub(crate) mod plan;
pub(crate) mod progress;
pub(crate) mod query;
pub(crate) mod quickstart;
pub(crate) mod recipes;
pub(crate) mod render;
pub(crate) mod reproduce;
pub(crate) mod train;
pub(crate) mod virtual_scanner;

use std::io::{self, Write};
use std::path::Path;

use anyhow::{Context, bail};
use clap::Args;
use glimpse_core::model::ModelKind;
use glimpse_materials::basis::Basis;
use glimpse_materials::{Joined, Material, Source, Sources};
use glimpse_trainer::render::Environment;
use glimpse_training::linear::Prior;
use glimpse_training::recipe::RecipeFile;
pub(crate) use output::write_file;
use serde::Serialize;

/// The models, as named on the command line.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub(crate) enum ModelName {
    /// 7 parameters: diffuse and specular color, glossiness.
    Phong,
    /// 8 parameters: diffuse and specular color, roughness, reflectance.
    CookTorrance,
    /// Principal components of the training materials.
    Linear,
    /// 675 parameters: a small network.
    Neural,
}

/// The prior of the model linear.
#[derive(Args, Clone, Copy, Debug)]
pub(crate) struct PriorArgs {
    /// Model linear: principal components that a material is made of, 1 to 1024 [default: 60; 5 for
    /// --schedule paper and for methods that learn no precisions]
    #[arg(long, value_name = "COUNT", value_parser = numbers::whole(1..=1024_usize))]
    bases: Option<usize>,
    /// Model linear: the precision of every coefficient, above 0 [default: learned for each; 40 where
    /// --bases has the default 5]
    #[arg(long, value_parser = numbers::positive)]
    eta: Option<f64>,
}

impl PriorArgs {
    /// Refuses what is for the model linear only, by name.
    pub(crate) fn refuse_for_others(self, models: &[ModelName]) -> anyhow::Result<()> {
        if models.is_empty()
            || models
                .iter()
                .any(|model| matches!(model, ModelName::Linear))
        {
            return Ok(());
        }
        let given = [
            ("--bases", self.bases.is_some()),
            ("--eta", self.eta.is_some()),
        ];
        match given.iter().find(|(_, given)| *given) {
            Some((name, _)) => bail!("{name} has no effect: it is for --model linear"),
            None => Ok(()),
        }
    }

    /// Refuses all of it for a schedule that has no use for it, by name.
    pub(crate) fn refuse_for_schedule(self, schedule: &str) -> anyhow::Result<()> {
        match (self.bases, self.eta) {
            (None, None) => Ok(()),
            (Some(_), _) => {
                bail!("--bases has no effect with --schedule {schedule}: it is for joint and paper")
            }
            (None, Some(_)) => {
                bail!("--eta has no effect with --schedule {schedule}: it is for joint and paper")
            }
        }
    }

    /// What was asked for, and `default` where nothing was.
    pub(crate) fn or(self, default: Prior) -> anyhow::Result<Prior> {
        Ok(Prior {
            components: self.bases.unwrap_or(default.components),
            eta: self.eta.or(default.eta),
        })
    }
}

/// Reads a recipe and, for the model linear, the basis that was written beside it.
pub(crate) fn read_recipe(path: &Path) -> anyhow::Result<(RecipeFile, Option<Basis>)> {
    Ok(RecipeFile::read_with_basis(path)?)
}

impl From<ModelName> for ModelKind {
    fn from(name: ModelName) -> Self {
        match name {
            ModelName::Phong => Self::Phong,
            ModelName::CookTorrance => Self::CookTorrance,
            ModelName::Neural => Self::Neural,
            ModelName::Linear => Self::Linear,
        }
    }
}

/// Loads materials and says so, and what of a directory is left out.
pub(crate) fn load(source: &Source) -> anyhow::Result<Vec<Box<dyn Material>>> {
    // First: there may be nothing else in it.
    if let Some(left_out) = source
        .skipped_entries()
        .ok()
        .filter(|left_out| !left_out.is_empty())
    {
        eprintln!("left out of {source}: {left_out}");
    }
    let materials = source.load()?;
    match &materials[..] {
        [one] => eprintln!("1 material from {source}: {}", one.name()),
        more => eprintln!("{} materials from {source}", more.len()),
    }
    Ok(materials)
}

/// Loads the materials of several sources, and says so.
pub(crate) fn load_all(sources: &Sources) -> anyhow::Result<Joined> {
    let lists = sources.each().iter().map(load);
    Ok(sources.join(lists.collect::<Result<_, _>>()?)?)
}

/// The light of spheres: a panorama, or the studio.
pub(crate) fn environment(panorama: Option<&Path>) -> anyhow::Result<Environment> {
    Ok(match panorama {
        Some(path) => Environment::read(path)?,
        None => Environment::studio(),
    })
}

/// Prints JSON to stdout.
pub(crate) fn print_json(value: &impl Serialize) -> anyhow::Result<()> {
    print(&(serde_json::to_string_pretty(value)? + "\n"))
}

/// Prints to stdout; a reader that has gone away, as `head` does, is no error.
pub(crate) fn print(text: &str) -> anyhow::Result<()> {
    match io::stdout().write_all(text.as_bytes()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(error).context("cannot write to standard output")
        }
        _ => Ok(()),
    }
}
