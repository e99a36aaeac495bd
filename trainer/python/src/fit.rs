//! Fitted materials and the outliers among their readings.

use std::path::PathBuf;
use std::sync::Arc;

use glimpse_core::recipe::Recipe;
use glimpse_materials::basis::Basis;
use glimpse_materials::{FittedMaterial, Material};
use glimpse_trainer::measurement::{
    Fit, Measurements, ReadingStatus, Selection, fit, material_files,
};
use numpy::PyArrayDyn;
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use serde_json::json;

use crate::arrays::{array, to_python};
use crate::error::{GlimpseError, reject, to_exception};
use crate::files::write;
use crate::interruptible::run_detached;
use crate::material::{Origin, PyMaterial};

/// A reading that is improbable given the other readings.
///
/// `sample` is its row in the recipe's directions. `z` is its distance from the prediction from the other readings, in
/// standard deviations (positive: too large). `measured` and `predicted` are BRDFs, linear RGB, sr^-1. `status` is
/// "used", or "outlier" if the fit did not use it.
#[pyclass(frozen, get_all, name = "Outlier", module = "glimpse_brdf")]
pub(crate) struct PyOutlier {
    sample: usize,
    z: f64,
    measured: [f32; 3],
    predicted: [f32; 3],
    status: &'static str,
}

#[pymethods]
impl PyOutlier {
    fn __repr__(&self) -> String {
        let rgb = |brdf: [f32; 3]| brdf.map(|f| format!("{f:.3}")).join(" ");
        format!(
            "<glimpse_brdf.Outlier sample {}: measured {}, predicted {} (z {:+.1})>",
            self.sample,
            rgb(self.measured),
            rgb(self.predicted),
            self.z
        )
    }
}

/// A material that `Recipe.fit` fitted to readings, with diagnostics of the fit.
#[pyclass(extends = PyMaterial, frozen, name = "FittedMaterial", module = "glimpse_brdf")]
pub(crate) struct PyFittedMaterial {
    fit: Fit,
    keep_all: bool,
    basis: Option<Arc<Basis>>,
    /// The Recipe.
    recipe: Py<PyAny>,
}

impl PyFittedMaterial {
    pub(crate) fn new<'py>(
        recipe: &Bound<'py, PyAny>,
        parsed: &Recipe<'_>,
        basis: Option<Arc<Basis>>,
        name: &str,
        measurements: Measurements,
        keep_all: bool,
    ) -> PyResult<Bound<'py, Self>> {
        if name.is_empty() || name.contains(|c: char| c.is_control() || "/\\".contains(c)) {
            return reject(format!(
                "name is {name:?}: choose a name that is not empty and has no slashes or control characters"
            ));
        }
        let py = recipe.py();
        let fit = run_detached(py, || {
            let selection = Selection::new(parsed, measurements, keep_all)?;
            fit(parsed, basis.as_deref(), name.to_owned(), selection)
        })?
        .map_err(to_exception)?;
        let base = PyMaterial {
            material: Arc::new(fit.material.clone()),
            in_batches: true,
            origin: Origin::Readings,
        };
        let fitted = Self {
            fit,
            keep_all,
            basis,
            recipe: recipe.clone().unbind(),
        };
        Bound::new(py, PyClassInitializer::from(base).add_subclass(fitted))
    }

    fn material(&self) -> &FittedMaterial {
        &self.fit.material
    }
}

#[pymethods]
impl PyFittedMaterial {
    /// The fitted model: "phong", "cook-torrance", "linear" or "neural".
    #[getter]
    fn model(&self) -> &'static str {
        self.material().fitted().model().name()
    }

    /// The parameters of the model in its order, float32 of shape (p,). The model linear has m coefficients for red,
    /// then m for green, then m for blue.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let values = self.material().fitted().values().to_vec();
        array(py, &[values.len()], values)
    }

    /// The loss of the fit, predicted from its readings, or None if the recipe cannot predict it.
    #[getter]
    fn predicted_loss(&self) -> Option<f32> {
        self.fit.prediction.map(|prediction| prediction.loss)
    }

    /// The upper bound of the loss, which holds for 90 % of materials, or None if the recipe has none.
    #[getter]
    fn loss_bound(&self) -> Option<f32> {
        self.fit.prediction?.bound
    }

    /// True if the readings are unlike those of all training materials, so that the loss may be larger than predicted. None
    /// if the recipe cannot tell.
    #[getter]
    fn unlike_training(&self) -> Option<bool> {
        self.fit.prediction?.unlike_training
    }

    /// The upper bounds of the loss after 1, 2, ... used readings in the recipe's order, each for 90 % of materials. Empty
    /// if the recipe has no bounds for scans that end early.
    #[getter]
    fn loss_bounds(&self) -> Vec<f32> {
        self.fit
            .partial_scans
            .iter()
            .map(|scan| scan.bound)
            .collect()
    }

    /// The status of each sample's reading: "used", "missing", "saturated" or "outlier".
    #[getter]
    fn statuses(&self) -> Vec<&'static str> {
        let statuses = self.fit.selection.statuses.iter();
        statuses.map(|status| status.name()).collect()
    }

    /// The loss of the fit at the used readings: a dict of mean, worst and worst_sample.
    #[getter]
    fn residual<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let residual = self.fit.residual;
        to_python(
            py,
            json!({
                "mean": residual.mean,
                "worst": residual.worst,
                "worst_sample": residual.worst_index,
            }),
        )
    }

    /// Readings that are improbable given the others, the worst first. A correct reading of a material unlike the
    /// training materials may be among them.
    #[getter]
    fn outliers(&self) -> Vec<PyOutlier> {
        let selection = &self.fit.selection;
        let outliers = selection.outlier_report.outliers.iter();
        let outliers = outliers.map(|outlier| PyOutlier {
            sample: outlier.sample,
            z: outlier.prediction.z,
            measured: selection.measurements.samples[outlier.sample]
                .mean()
                .unwrap_or_default(),
            predicted: outlier.prediction.expected,
            status: selection.statuses[outlier.sample].name(),
        });
        outliers.collect()
    }

    /// Writes the material in a format of `Material.save`. If `path` ends in .json and `format` is None, writes the
    /// trainer's format, which `load_material` and every command of the trainer read. For the model linear, it also
    /// writes NAME.basis next to that file.
    #[pyo3(signature = (path, format = None, *, seed = 0, overwrite = false))]
    fn save(
        slf: &Bound<'_, Self>,
        py: Python<'_>,
        path: PathBuf,
        format: Option<&str>,
        seed: u64,
        overwrite: bool,
    ) -> PyResult<()> {
        if path.extension().is_none_or(|extension| extension != "json") || format.is_some() {
            let base = slf.as_super().get();
            return base.save(py, path, format, seed, overwrite);
        }
        let this = slf.get();
        let metadata = json!({ "trainer": concat!("glimpse_brdf ", env!("CARGO_PKG_VERSION")) });
        let files = material_files(this.material(), &path, this.basis.as_deref(), metadata);
        let files = files.map_err(|error| GlimpseError::new_err(error.to_string()))?;
        write(&files, overwrite)
    }

    /// Supports pickle, which stores the recipe and the readings. Unpickling repeats the fit.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let samples = &self.fit.selection.measurements.samples;
        let readings = samples
            .iter()
            .map(|sample| Some((sample.mean()?, sample.saturated())));
        let arguments = (
            self.material().name(),
            readings.collect::<Vec<_>>(),
            self.keep_all,
        );
        let restore = self.recipe.bind(py).getattr("_fit_samples")?;
        (restore, arguments).into_bound_py_any(py)
    }

    fn __repr__(&self) -> String {
        let used = self.fit.selection.with_status(ReadingStatus::Used).len();
        format!(
            "<glimpse_brdf.FittedMaterial of the model {} from {used} readings>",
            self.model()
        )
    }
}
