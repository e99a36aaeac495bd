//! The directions to read next.

use glimpse_fitting::linear::{Posterior, Proposal};
use glimpse_fitting::measurement::NamedRecipe;
use glimpse_fitting::route::MachineArgs;
use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::arrays::array;
use crate::error::{GlimpseError, reject, to_exception};
use crate::fit::PyFittedMaterial;
use crate::interruptible::run_detached;
use crate::material::directions_of;
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
    ) -> PyResult<Self> {
        let py = recipe.py();
        if !(1..=256).contains(&count) {
            return reject(format!("count is {count}: give 1 to 256"));
        }
        given.machine(machine).map_err(to_exception)?;
        let any = given.continuing();
        let mut measured = Vec::new();
        let posterior = match (directions, readings) {
            (None, None) => Posterior::new(&any.prior, &[])
                .ok_or_else(|| GlimpseError::new_err("the recipe's prior is not finite"))?,
            (Some(directions), Some(readings)) => {
                let readings = ReadingArgs::new(readings, directions).readings(&any)?;
                measured = readings.pattern();
                // Also with readings that are unlike the others, which reduce the loss most.
                let mut fitted = PyFittedMaterial::new(recipe, readings, "readings", true)?;
                if !accept_implausible {
                    fitted = PyFittedMaterial::require_plausible(fitted)?;
                }
                fitted.get().fit().selection.posterior.clone()
            }
            _ => return reject("directions and readings belong together: give both, or neither"),
        };
        let proposals = run_detached(py, || given.next(machine, (&posterior, &measured), count))?;
        let proposals = proposals.map_err(to_exception)?;
        if proposals.is_empty() {
            return reject("no direction is within the limits: widen them");
        }
        Ok(Self {
            proposals,
            has_seconds: machine.speeds.is_given(),
            so_far: posterior.expected_loss().loss,
        })
    }

    fn list<'py>(
        &self,
        py: Python<'py>,
        value: impl Fn(&Proposal) -> f64,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let values: Vec<f64> = self.proposals.iter().map(value).collect();
        array(py, &[values.len()], values)
    }
}

#[pymethods]
impl PyProposals {
    /// The pairs of directions, incoming then outgoing, unit vectors: float64 of shape (k, 2, 3).
    #[getter]
    fn directions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let pairs = self.proposals.iter();
        let pairs = pairs.flat_map(|each| directions_of(&each.angles).into_iter().flatten());
        array(
            py,
            &[self.proposals.len(), 2, 3],
            pairs.collect::<Vec<f64>>(),
        )
    }

    /// The expected loss after each proposed reading and the earlier ones, shape (k,).
    #[getter]
    fn expected_losses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        self.list(py, |each| f64::from(each.expected_loss))
    }

    /// The upper bounds of these losses, which hold for 90 % of materials, shape (k,).
    #[getter]
    fn loss_bounds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        self.list(py, |each| f64::from(each.bound))
    }

    /// The expected loss of a fit of the readings so far.
    #[getter]
    fn expected_loss_so_far(&self) -> f32 {
        self.so_far
    }

    /// The time to move to each direction and to read there, in seconds, shape (k,). None without a speed.
    #[getter]
    fn seconds<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArrayDyn<f64>>>> {
        let seconds = self.has_seconds.then(|| self.list(py, |each| each.seconds));
        seconds.transpose()
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
