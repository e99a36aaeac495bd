//! Plans of scans: the order in which a machine's arms visit a recipe's samples.

use glimpse_fitting::choice::Choice;
use glimpse_fitting::recipe::RecipeFile;
use glimpse_fitting::route::{PlanArgs, Route, blank_sheet};
use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::arrays::array;
use crate::error::to_exception;
use crate::interruptible::run_detached;

/// A planned scan: the positions and times of all visits to samples.
#[pyclass(frozen, name = "Plan", module = "glimpse_brdf")]
pub(crate) struct PyPlan {
    route: Route,
    /// Incoming and outgoing unit vectors of each visit.
    directions: Vec<f64>,
}

impl PyPlan {
    pub(crate) fn new(
        py: Python<'_>,
        file: &RecipeFile,
        request: &PlanArgs,
        seed: u64,
    ) -> PyResult<Self> {
        let stated = file.metadata().machine();
        let planned = run_detached(py, || request.plan(&file.recipe(), &stated, seed))?;
        let (_, route) = planned.map_err(to_exception)?;
        let arms = route.visits.iter().flat_map(|visit| {
            let [theta_i, phi_i, theta_o, phi_o] = visit.arms.to_array().map(f64::to_radians);
            [(theta_i, phi_i), (theta_o, phi_o)]
        });
        let vectors = arms.flat_map(|(theta, phi)| {
            let (sin, cos) = theta.sin_cos();
            [sin * phi.cos(), sin * phi.sin(), cos]
        });
        Ok(Self {
            directions: vectors.collect(),
            route,
        })
    }
}

#[pymethods]
impl PyPlan {
    /// The order of visits: "travel" or "progressive".
    #[getter]
    fn order(&self) -> String {
        self.route.order.name()
    }

    /// The sample of each visit, its row in the recipe's directions: int64 of shape (n,).
    #[getter]
    fn indices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<i64>>> {
        let indices = self.route.visits.iter().map(|visit| visit.index as i64);
        array(py, &[self.route.visits.len()], indices.collect())
    }

    /// The positions of the axes theta_i, phi_i, theta_o, phi_o at each visit, degrees, float64 of shape (n, 4).
    #[getter]
    fn angles_degrees<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let angles = self
            .route
            .visits
            .iter()
            .flat_map(|visit| visit.arms.to_array());
        array(py, &[self.route.visits.len(), 4], angles.collect())
    }

    /// The positions as unit vectors, incoming and outgoing, float64 of shape (n, 2, 3).
    #[getter]
    fn directions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        array(
            py,
            &[self.route.visits.len(), 2, 3],
            self.directions.clone(),
        )
    }

    /// The time at which each sample is measured, seconds after the start, float64 of shape (n,).
    #[getter]
    fn seconds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let seconds = self.route.visits.iter().map(|visit| visit.seconds);
        array(py, &[self.route.visits.len()], seconds.collect())
    }

    /// The time until the last sample is measured, seconds.
    #[getter]
    fn total_seconds(&self) -> f64 {
        self.route.total()
    }

    /// The total time during which arms move, seconds.
    #[getter]
    fn moving_seconds(&self) -> f64 {
        self.route.travel
    }

    /// Returns the plan in the CSV format of `trainer plan --out`.
    fn to_csv(&self) -> String {
        self.route.to_csv()
    }

    /// Returns a blank table of measurements, in the CSV format of `trainer plan --blank`.
    fn to_blank_csv(&self) -> String {
        blank_sheet(&self.route.visits)
    }

    fn __len__(&self) -> usize {
        self.route.visits.len()
    }

    fn __repr__(&self) -> String {
        format!(
            "<glimpse_brdf.Plan of {} samples in {:.1} seconds, order {}>",
            self.route.visits.len(),
            self.route.total(),
            self.route.order.name()
        )
    }
}
