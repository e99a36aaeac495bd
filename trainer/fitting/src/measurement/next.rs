//! The directions to read next.

use super::instrument::{Geometry, Instrument};
use super::reading_set::PlannedReading;
use crate::linear::{Candidates, Posterior, PosteriorReading, Proposal};
use crate::route::{MachineArgs, PlanError, TimedMachine, axes_of, stops};
use glimpse_core::geometry::{Angles, Arms};
use serde::Serialize;

use super::NamedRecipe;

/// A proposed reading.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct NextReading {
    /// The instrument; None for a goniometer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub instrument: Option<Instrument>,
    /// The direction, in degrees, without azimuths in one plane; None for an instrument that determines it.
    #[serde(flatten)]
    pub arms: Option<Arms<Option<f64>>>,
    /// The angle between lamp and camera of a photograph, in degrees; None for a single reading.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lamp: Option<f32>,
    /// The time to move there and to read; None without a speed.
    pub seconds: Option<f64>,
    /// The expected loss after this reading and the earlier ones.
    pub expected_loss: f32,
    /// Its upper bound, which holds for 90 % of materials.
    pub bound: f32,
}

impl NextReading {
    /// Describes a proposal. Its time is known with a speed.
    #[must_use]
    pub fn new(proposal: &Proposal, in_plane: bool, has_seconds: bool) -> Self {
        Self {
            arms: Some(axes_of(proposal.angles, in_plane)),
            seconds: has_seconds.then_some(proposal.seconds),
            expected_loss: proposal.expected_loss,
            bound: proposal.bound,
            ..Self::default()
        }
    }
}

impl PlannedReading {
    /// Proposes up to `count` of planned readings, which no instrument of a list has taken, and at no measured direction.
    pub fn next(
        planned: &[Self],
        (posterior, measured): (&Posterior, &[Angles<f32>]),
        taken: &[Option<Instrument>],
        count: usize,
    ) -> Vec<(Self, NextReading)> {
        let is_open = |one: &&Self| one.degrees.is_some() || !taken.contains(&one.instrument);
        let open = planned.iter().filter(is_open).filter_map(|one| {
            let Geometry { angles, aperture } = one.geometry(0.0)?;
            let candidate = PosteriorReading::new(angles, [0.0; 3]);
            Some((
                *one,
                PosteriorReading {
                    aperture,
                    ..candidate
                },
            ))
        });
        let (open, candidates): (Vec<Self>, Vec<PosteriorReading>) = open.unzip();
        let candidates = Candidates(candidates);
        let proposals = posterior.next(&candidates, [measured, &[]], count, &mut None);
        let proposals = proposals.iter().filter_map(|proposal| {
            let one = open[proposal.candidate?];
            let next = NextReading::new(proposal, true, false);
            Some((
                one,
                NextReading {
                    instrument: one.instrument,
                    arms: next.arms.filter(|_| one.degrees.is_some()),
                    ..next
                },
            ))
        });
        proposals.collect()
    }
}

impl NamedRecipe {
    /// Returns the machine of some options, with defaults of the machine that the recipe was trained for.
    ///
    /// # Errors
    /// If a value is out of range, or the machine does not reach the recipe's samples.
    pub fn machine(&self, args: &MachineArgs) -> Result<TimedMachine, PlanError> {
        let machine = args.machine(&self.file.metadata().machine())?;
        stops(&self.file.recipe(), &machine.limits)?;
        Ok(machine)
    }

    /// Proposes up to `count` directions after the measured ones, first those of the recipe's own pattern. Empty if no
    /// direction is within the limits.
    ///
    /// # Errors
    /// As [`machine`](Self::machine).
    pub fn next(
        &self,
        args: &MachineArgs,
        (posterior, measured): (&Posterior, &[Angles<f32>]),
        count: usize,
    ) -> Result<Vec<Proposal>, PlanError> {
        let machine = self.machine(args)?;
        let begin: Vec<Angles<f32>> = self.file.recipe().pattern().collect();
        let candidates = Candidates::new(&machine.limits);
        let mut position = args.position(machine);
        if let (Some(position), Some(last)) = (&mut position, measured.last()) {
            position.move_to(*last);
        }
        Ok(posterior.next(&candidates, [measured, &begin], count, &mut position))
    }
}
