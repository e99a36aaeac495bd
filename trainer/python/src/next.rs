//! The directions to read next.

use glimpse_fitting::linear::{Posterior, Proposal};
use glimpse_fitting::measurement::NamedRecipe;
use glimpse_fitting::route::MachineArgs;
use pyo3::prelude::*;

use crate::arrays::Array;
use crate::error::{Result, reject};
use crate::fit::PyFittedMaterial;
use crate::interruptible::run_detached;
use crate::readings::ReadingArgs;

/// Directions to read next, in order, and the losses to expect after each of them.
#[pyclass(frozen, name = "Proposals", module = "glimpse_brdf")]
pub(crate) struct PyProposals {
    proposals: Vec<Proposal>,
    has_seconds: bool,
    so_far: f32,
}

impl PyProposals {
    pub(crate) fn new(
        recipe: &Bound<'_, PyAny>,
        given: &NamedRecipe,
        (directions, readings): (Option<&Bound<'_, PyAny>>, Option<&Bound<'_, PyAny>>),
        count: usize,
        machine: &MachineArgs,
        accept_implausible: bool,
    ) -> Result<Self> {
        let py = recipe.py();
        if !(1..=256).contains(&count) {
            return reject(format!("count is {count}: give 1 to 256"));
        }
        given.machine(machine)?;
        let any = given.continuing();
        let mut measured = Vec::new();
        let posterior = match (directions, readings) {
            (None, None) => Posterior::new(&any.prior, &[]),
            (Some(directions), Some(readings)) => {
                let readings = ReadingArgs::default().readings(&any, readings, Some(directions))?;
                measured = readings.pattern();
                // Also with readings that are unlike the others, which reduce the loss most.
                let mut fitted = PyFittedMaterial::new(recipe, readings, "readings", true)?;
                if !accept_implausible {
                    fitted = PyFittedMaterial::require_plausible(fitted)?;
                }
                Some(fitted.get().fit().selection.posterior.clone())
            }
            _ => return reject("directions and readings belong together: give both, or neither"),
        };
        let Some(posterior) = posterior else {
            return reject("the recipe's prior is not finite");
        };
        let next = || given.next(machine, (&posterior, &measured), count);
        let proposals = run_detached(py, next)??;
        if proposals.is_empty() {
            return reject("no direction is within the limits: widen them");
        }
        Ok(Self {
            proposals,
            has_seconds: machine.speeds.is_given(),
            so_far: posterior.expected_loss().loss,
        })
    }
}

#[pymethods]
impl PyProposals {
    /// The pairs of directions, incoming then outgoing, unit vectors: float64 of shape (k, 2, 3).
    #[getter]
    fn directions(&self) -> Array<f64> {
        Array::directions(self.proposals.iter().map(|proposal| proposal.angles))
    }

    /// The expected loss after each proposed reading and the earlier ones, shape (k,).
    #[getter]
    fn expected_losses(&self) -> Array<f64> {
        let proposals = self.proposals.iter();
        Array::list(proposals.map(|proposal| f64::from(proposal.expected_loss)))
    }

    /// The upper bounds of these losses, which hold for 90 % of materials, shape (k,).
    #[getter]
    fn loss_bounds(&self) -> Array<f64> {
        let proposals = self.proposals.iter();
        Array::list(proposals.map(|proposal| f64::from(proposal.bound)))
    }

    /// The expected loss of a fit of the readings so far.
    #[getter]
    fn expected_loss_so_far(&self) -> f32 {
        self.so_far
    }

    /// The time to move to each direction and to read there, in seconds, shape (k,). None without a speed.
    #[getter]
    fn seconds(&self) -> Option<Array<f64>> {
        let seconds = self.proposals.iter().map(|proposal| proposal.seconds);
        self.has_seconds.then(|| Array::list(seconds))
    }

    fn __len__(&self) -> usize {
        self.proposals.len()
    }

    fn __repr__(&self) -> String {
        format!(
            "<glimpse_brdf.Proposals of {} directions>",
            self.proposals.len()
        )
    }
}
