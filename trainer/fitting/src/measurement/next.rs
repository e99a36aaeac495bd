//! The directions to read next.

use glimpse_core::geometry::Angles;
use glimpse_training::linear::{Candidates, Posterior, Proposal};
use glimpse_training::route::{LimitArgs, Machine, PlanError, Position, SpeedArgs, stops};

use super::NamedRecipe;

/// Options for a machine whose directions are chosen one by one.
#[derive(clap::Args, Clone, Copy, Debug, Default)]
pub struct MachineArgs {
    /// The limits of the arms.
    #[command(flatten)]
    pub limits: LimitArgs,
    /// The speeds of the axes.
    #[command(flatten)]
    pub speeds: SpeedArgs,
}

impl MachineArgs {
    /// Returns true if an option was given.
    #[must_use]
    pub fn is_given(&self) -> bool {
        self.limits.is_given() || self.speeds.is_given()
    }

    /// Returns the machine, with defaults of the machine that a recipe was trained for.
    ///
    /// # Errors
    /// If a value is out of range, or the machine does not reach the recipe's samples.
    pub fn machine(&self, given: &NamedRecipe) -> Result<Machine, PlanError> {
        let stated = given.file.metadata().machine();
        let machine = Machine {
            speeds: self.speeds.speed.unwrap_or(stated.speeds),
            settle: self.speeds.settle.unwrap_or(stated.settle),
            limits: self.limits.or(stated.limits)?,
            ..stated
        };
        machine.validate()?;
        self.check_reach(given, &machine)?;
        Ok(machine)
    }

    /// Checks that a machine reaches a recipe's samples.
    ///
    /// # Errors
    /// All samples that it does not reach.
    pub fn check_reach(&self, given: &NamedRecipe, machine: &Machine) -> Result<(), PlanError> {
        let recipe = given.file.recipe();
        match stops(&recipe, &machine.limits) {
            Ok(_) => Ok(()),
            Err(missed) => Err(PlanError::OutOfReach {
                missed,
                samples: recipe.samples(),
            }),
        }
    }

    /// Returns the arms at the start of a scan, if a speed or a time was given.
    #[must_use]
    pub fn position(&self, machine: Machine) -> Option<Position> {
        self.speeds.is_given().then(|| Position::new(machine))
    }

    /// Proposes up to `count` directions after the measured ones, first those of the recipe's own pattern. Empty if no
    /// direction is within the limits.
    ///
    /// # Errors
    /// As [`machine`](Self::machine).
    pub fn next(
        &self,
        given: &NamedRecipe,
        (posterior, measured): (&Posterior, &[Angles<f32>]),
        count: usize,
    ) -> Result<Vec<Proposal>, PlanError> {
        let machine = self.machine(given)?;
        let begin: Vec<Angles<f32>> = given.file.recipe().pattern().collect();
        let candidates = Candidates::new(posterior.basis(), &machine.limits);
        let mut position = self.position(machine);
        if let (Some(position), Some(last)) = (&mut position, measured.last()) {
            position.move_to(*last);
        }
        Ok(posterior.next(&candidates, [measured, &begin], count, &mut position))
    }
}
