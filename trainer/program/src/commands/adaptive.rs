//! Options of scans that choose each direction by the readings so far.

use std::path::PathBuf;

use anyhow::{Context, ensure};
use clap::Args;
use glimpse_evaluation::evaluation::Adaptive;
use glimpse_fitting::linear::Candidates;
use glimpse_fitting::measurement::NamedRecipe;
use glimpse_fitting::route::{MachineArgs, stops};

use super::numbers::number;
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
        value_parser = number(1..=256_usize)
    )]
    pub(crate) adaptive: Option<usize>,
    /// With --adaptive: recipe whose pattern is read first
    #[arg(long, value_name = "RECIPE", requires = "adaptive")]
    begin: Option<PathBuf>,
    #[command(flatten)]
    machine: MachineArgs,
}

impl AdaptiveArgs {
    /// Returns the scans with a recipe, continued by one for readings at any directions. None without --adaptive.
    pub(crate) fn scans<'a>(
        &self,
        given: &NamedRecipe,
        any: &'a NamedRecipe,
    ) -> anyhow::Result<Option<Adaptive<'a>>> {
        let args = &self.machine;
        let Some(samples) = self.adaptive else {
            ensure!(
                *args == MachineArgs::default(),
                "limits, --in-plane, --speed and --settle have no effect without --adaptive: remove them"
            );
            return Ok(None);
        };
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
        let basis = any.basis.as_deref();
        let basis = basis.with_context(|| format!("{} has no basis", any.name))?;
        Ok(Some(Adaptive {
            file: &any.file,
            basis,
            prior: any.prior.clone(),
            candidates: Candidates::new(basis, &machine.limits),
            begin,
            samples,
            position: args.position(machine),
        }))
    }
}
