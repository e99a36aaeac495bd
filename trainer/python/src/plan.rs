//! Plans of scans: the order in which a machine's arms visit a recipe's samples.

use glimpse_fitting::choice::Choice;
use glimpse_fitting::route::{Route, blank_sheet};
use pyo3::prelude::*;

use crate::arrays::Array;

/// A planned scan: the positions and times of all visits to samples.
#[pyclass(frozen, name = "Plan", module = "glimpse_brdf")]
pub(crate) struct PyPlan(pub(crate) Route);

#[pymethods]
impl PyPlan {
    /// The order of visits: "travel" or "progressive".
    #[getter]
    fn order(&self) -> String {
        self.0.order.name()
    }

    /// The sample of each visit, its row in the recipe's directions: int64 of shape (n,).
    #[getter]
    fn indices(&self) -> Array<i64> {
        Array::list(self.0.visits.iter().map(|visit| visit.index as i64))
    }

    /// The positions of the axes theta_i, phi_i, theta_o, phi_o at each visit, degrees, float64 of shape (n, 4).
    #[getter]
    fn angles_degrees(&self) -> Array<f64> {
        Array::rows(self.0.visits.iter().map(|visit| visit.arms.to_array()))
    }

    /// The positions as unit vectors, incoming and outgoing, float64 of shape (n, 2, 3).
    #[getter]
    fn directions(&self) -> Array<f64> {
        Array::pairs(self.0.visits.iter().map(|visit| {
            let [theta_i, phi_i, theta_o, phi_o] = visit.arms.to_array().map(f64::to_radians);
            [(theta_i, phi_i), (theta_o, phi_o)].map(|(theta, phi)| {
                let (sin, cos) = theta.sin_cos();
                [sin * phi.cos(), sin * phi.sin(), cos]
            })
        }))
    }

    /// The time at which each sample is measured, seconds after the start, float64 of shape (n,).
    #[getter]
    fn seconds(&self) -> Array<f64> {
        Array::list(self.0.visits.iter().map(|visit| visit.seconds))
    }

    /// The time until the last sample is measured, seconds.
    #[getter]
    fn total_seconds(&self) -> f64 {
        self.0.total()
    }

    /// The total time during which arms move, seconds.
    #[getter]
    fn moving_seconds(&self) -> f64 {
        self.0.travel
    }

    /// Returns the plan in the CSV format of `trainer plan --out`.
    fn to_csv(&self) -> String {
        self.0.to_csv()
    }

    /// Returns a blank table of measurements, in the CSV format of `trainer plan --blank`.
    fn to_blank_csv(&self) -> String {
        blank_sheet(&self.0.visits)
    }

    fn __len__(&self) -> usize {
        self.0.visits.len()
    }

    fn __repr__(&self) -> String {
        format!(
            "<glimpse_brdf.Plan of {} samples in {:.1} seconds, order {}>",
            self.0.visits.len(),
            self.0.total(),
            self.0.order.name()
        )
    }
}
