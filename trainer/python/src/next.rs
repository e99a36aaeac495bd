//! The directions to read next.

use glimpse_fitting::linear::Proposal;
use glimpse_fitting::measurement::LossScale;
use pyo3::prelude::*;

use crate::arrays::{Array, to_python};
use crate::error::Result;

/// Directions to read next, in order, and the losses to expect after each of them.
#[pyclass(frozen, name = "Proposals", module = "glimpse_brdf")]
pub(crate) struct PyProposals {
    pub(crate) proposals: Vec<Proposal>,
    pub(crate) has_seconds: bool,
    pub(crate) so_far: f32,
    pub(crate) scale: LossScale,
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

    /// Losses to compare with: a dict of that of the material in `black`, of a `good` fit, and of one that is
    /// `just_visible`.
    #[getter]
    fn loss_scale<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        to_python(py, self.scale)
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
