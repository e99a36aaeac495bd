//! Options of scans that choose each direction by the readings so far.

use anyhow::ensure;
use clap::Args;
use glimpse_evaluation::evaluation::Adaptive;
use glimpse_fitting::linear::Candidates;
use glimpse_fitting::measurement::NamedRecipe;
use glimpse_fitting::route::MachineArgs;

use super::numbers::number;

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
        let begin: Vec<_> = given.file.recipe().pattern().collect();
        ensure!(
            begin.len() < samples,
            "--adaptive {samples}: the scan begins with {} samples; give a larger number",
            begin.len()
        );
        Ok(Some(Adaptive {
            recipe: any,
            candidates: Candidates::new(&machine.limits),
            begin,
            samples,
            position: args.position(machine),
        }))
    }
}
