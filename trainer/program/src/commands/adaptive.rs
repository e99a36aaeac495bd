//! Options of scans that choose each direction by the readings so far.

use std::path::PathBuf;

use anyhow::{Context, ensure};
use clap::Args;
use clap::builder::RangedI64ValueParser;
use glimpse_core::geometry::Angles;
use glimpse_evaluation::evaluation::Adaptive;
use glimpse_fitting::linear::Candidates;
use glimpse_fitting::measurement::NamedRecipe;
use glimpse_fitting::route::{Machine, MachineArgs, Position, stops};

use super::read_recipe;

/// Options of an evaluation of adaptive scans.
#[derive(Args)]
pub(crate) struct AdaptiveArgs {
    /// Choose each of N directions by the readings so far, as `trainer next` does, 1 to 256. A recipe with
    /// fewer samples begins with its own, and the bundled MODEL-any continues
    #[arg(
        long,
        value_name = "N",
        conflicts_with_all = ["geometry", "first", "lose"],
        value_parser = RangedI64ValueParser::<usize>::new().range(1..=256)
    )]
    adaptive: Option<usize>,
    /// With --adaptive: recipe whose pattern is read first
    #[arg(long, value_name = "RECIPE", requires = "adaptive")]
    begin: Option<PathBuf>,
    #[command(flatten)]
    machine: MachineArgs,
}

/// The scans of one recipe.
pub(crate) struct Request {
    any: NamedRecipe,
    begin: Vec<Angles<f32>>,
    samples: usize,
    machine: Machine,
    position: Option<Position>,
}

impl AdaptiveArgs {
    /// The number of directions.
    pub(crate) fn samples(&self) -> Option<usize> {
        self.adaptive
    }

    /// Returns the scans with a recipe. None without --adaptive.
    pub(crate) fn request(&self, given: &NamedRecipe) -> anyhow::Result<Option<Request>> {
        let args = &self.machine;
        let Some(samples) = self.adaptive else {
            ensure!(
                !args.is_given(),
                "limits, --in-plane, --speed and --settle have no effect without --adaptive: remove them"
            );
            return Ok(None);
        };
        let any = given.continuing();
        let machine = given.machine(args)?;
        let begin = match &self.begin {
            None => given.clone(),
            Some(path) => {
                ensure!(
                    given.is_any(),
                    "--begin: {} begins with its own samples; remove --begin, or give a recipe of `train --samples any`",
                    given.name
                );
                let named = read_recipe(path)?;
                stops(&named.file.recipe(), &machine.limits).context("--begin")?;
                named
            }
        };
        let begin: Vec<_> = begin.file.recipe().pattern().collect();
        ensure!(
            begin.len() < samples,
            "--adaptive {samples}: the scan begins with {} samples; give a larger number",
            begin.len()
        );
        Ok(Some(Request {
            any,
            begin,
            samples,
            machine,
            position: args.position(machine),
        }))
    }
}

impl Request {
    /// Prepares the scans.
    pub(crate) fn scans(&self) -> anyhow::Result<Adaptive<'_>> {
        let basis = self.any.basis.as_deref();
        let basis = basis.with_context(|| format!("{} has no basis", self.any.name))?;
        Ok(Adaptive {
            file: &self.any.file,
            basis,
            prior: self.any.prior.clone(),
            candidates: Candidates::new(basis, &self.machine.limits),
            begin: self.begin.clone(),
            samples: self.samples,
            position: self.position.clone(),
        })
    }
}
