//! In which order a machine's arms go to a recipe's samples.

use glimpse_core::gonio::Limits;
use glimpse_core::recipe::Recipe;
use glimpse_trainer::route::{Axes, Machine, Route, blank, stops};
use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::arrays::{array, numbers};
use crate::choices::{ORDERS, choose, limits};
use crate::error::{GlimpseError, raised, refused};
use crate::waiting::detached;

/// What is said of a machine.
pub(crate) struct MachineArgs<'a, 'py> {
    pub(crate) speeds: Option<&'a Bound<'py, PyAny>>,
    pub(crate) settle: f64,
    pub(crate) start: [f64; 4],
    pub(crate) isotropic: bool,
    pub(crate) full_turns: bool,
    /// `max_theta_i`, `max_theta_o` and `min_separation`, degrees.
    pub(crate) limits: [Option<f64>; 3],
}

impl MachineArgs<'_, '_> {
    fn machine(&self, stated: Limits) -> PyResult<Machine> {
        let default = Machine::default();
        let speeds = match self.speeds {
            None => default.speeds,
            Some(given) => {
                let given = numbers(given, "speed_degrees_per_second")?;
                match given.iter().copied().collect::<Vec<f64>>()[..] {
                    [all] => Axes::of([all; 4]),
                    [theta_i, phi_i, theta_o, phi_o] => Axes::of([theta_i, phi_i, theta_o, phi_o]),
                    _ => {
                        return refused(
                            "speed_degrees_per_second should be one number for all axes, or four, as (20, 10, 20, 10)",
                        );
                    }
                }
            }
        };
        let [max_theta_i, max_theta_o, min_separation] = self.limits;
        let machine = Machine {
            speeds,
            settle: self.settle,
            start: Axes::of(self.start),
            limits: limits(stated, max_theta_i, max_theta_o, min_separation),
            isotropic: self.isotropic,
            full_turns: self.full_turns,
        };
        machine.validate().map_err(raised)?;
        Ok(machine)
    }
}

/// Where the arms go, visit by visit.
#[pyclass(frozen, name = "Plan", module = "glimpse_brdf")]
pub(crate) struct PyPlan {
    route: Route,
    /// Incoming and outgoing unit vectors of each visit.
    directions: Vec<f64>,
}

impl PyPlan {
    pub(crate) fn of(
        py: Python<'_>,
        recipe: &Recipe<'_>,
        order: &str,
        machine: &MachineArgs<'_, '_>,
        swap: bool,
        seed: u64,
    ) -> PyResult<Self> {
        let order = choose("order", order, &ORDERS)?;
        let stated = recipe.metadata().map_err(raised)?.limits;
        let machine = machine.machine(stated.unwrap_or(Limits::NONE))?;
        let stops = stops(recipe, &machine.limits, swap).map_err(|missed| {
            let lines: Vec<String> = missed.iter().map(|each| format!("\n  {each}")).collect();
            GlimpseError::new_err(format!(
                "the machine does not reach {} of {} samples:{}\ntrain a recipe for these limits{}",
                missed.len(),
                recipe.samples(),
                lines.concat(),
                if swap {
                    ""
                } else {
                    ", or try whether swap=True helps"
                }
            ))
        })?;
        let route = detached(py, || Route::new(&machine, &stops, order, seed))?;
        let arms = route.visits.iter().flat_map(|visit| {
            let [theta_i, phi_i, theta_o, phi_o] = visit.arms.values().map(f64::to_radians);
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
    /// What was asked for: "travel" or "progressive".
    #[getter]
    fn order(&self) -> &'static str {
        self.route.order.name()
    }

    /// True if no other order takes less time (of "progressive": no other choice of azimuths).
    #[getter]
    fn is_best(&self) -> bool {
        self.route.is_best
    }

    /// The sample of each visit, its row in the recipe's directions: int64 of shape (n,).
    #[getter]
    fn indices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<i64>>> {
        let indices = self.route.visits.iter().map(|visit| visit.index as i64);
        array(py, &[self.route.visits.len()], indices.collect())
    }

    /// Where the axes theta_i, phi_i, theta_o, phi_o stand at each visit, degrees, float64 of shape (n, 4).
    #[getter]
    fn angles_degrees<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let angles = self
            .route
            .visits
            .iter()
            .flat_map(|visit| visit.arms.values());
        array(py, &[self.route.visits.len(), 4], angles.collect())
    }

    /// The same as unit vectors, incoming and outgoing, float64 of shape (n, 2, 3).
    #[getter]
    fn directions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        array(
            py,
            &[self.route.visits.len(), 2, 3],
            self.directions.clone(),
        )
    }

    /// Where light and sensor are exchanged: bool of shape (n,).
    #[getter]
    fn swapped<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<bool>>> {
        let swapped = self.route.visits.iter().map(|visit| visit.swapped);
        array(py, &[self.route.visits.len()], swapped.collect())
    }

    /// When each sample is read, seconds after the start, float64 of shape (n,).
    #[getter]
    fn seconds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let seconds = self.route.visits.iter().map(|visit| visit.seconds);
        array(py, &[self.route.visits.len()], seconds.collect())
    }

    /// Seconds until the last sample is read.
    #[getter]
    fn total_seconds(&self) -> f64 {
        self.route.total()
    }

    /// Seconds of those in which arms move.
    #[getter]
    fn moving_seconds(&self) -> f64 {
        self.route.travel
    }

    /// Seconds that the recipe's own order takes if none of the machine's freedom is used.
    #[getter]
    fn naive_seconds(&self) -> f64 {
        self.route.naive_total()
    }

    /// As `trainer plan --out` writes it.
    fn to_csv(&self) -> String {
        self.route.to_csv()
    }

    /// As `trainer plan --blank` writes it.
    fn to_blank_csv(&self) -> String {
        blank(&self.route.visits)
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
