//! Fitted materials and the outliers among their readings.

use std::path::PathBuf;
use std::sync::Arc;

use glimpse_core::geometry::HalfDifference;
use glimpse_fitting::measurement::{
    ChosenRecipe, Fit, Measurements, NamedRecipe, ReadingStatus, Selection, fit, material_files,
};
use glimpse_materials::{FittedMaterial, Material};
use glimpse_training::linear::Posterior;
use numpy::PyArrayDyn;
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use serde_json::json;

use crate::arrays::{Pairs, array, to_python};
use crate::error::{GlimpseError, ImplausibleError, reject, to_exception};
use crate::files::write;
use crate::interruptible::run_detached;
use crate::material::{Origin, PyMaterial, directions_of};

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
    /// The recipe that fits the readings.
    chosen: ChosenRecipe,
    /// The Recipe of the call.
    recipe: Py<PyAny>,
}

impl PyFittedMaterial {
    pub(crate) fn new<'py>(
        recipe: &Bound<'py, PyAny>,
        chosen: ChosenRecipe,
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
        let NamedRecipe { file, basis, .. } = &chosen.recipe;
        let fit = run_detached(py, || {
            let parsed = file.recipe();
            let selection = Selection::new(&parsed, &chosen.prior, measurements, keep_all)?;
            fit(&parsed, basis.as_deref(), name.to_owned(), selection)
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
            chosen,
            recipe: recipe.clone().unbind(),
        };
        Bound::new(py, PyClassInitializer::from(base).add_subclass(fitted))
    }

    fn material(&self) -> &FittedMaterial {
        &self.fit.material
    }

    /// The distribution of the material, given the readings.
    pub(crate) fn posterior(&self) -> &Posterior {
        &self.fit.selection.posterior
    }

    /// Returns the fit, or raises `ImplausibleError` if its readings are implausible.
    pub(crate) fn require_plausible(fitted: Bound<'_, Self>) -> PyResult<Bound<'_, Self>> {
        let Err(failure) = fitted.get().fit.check_plausible() else {
            return Ok(fitted);
        };
        let error =
            ImplausibleError::new_err(format!("{failure} (the exception's `fit` has the fit)"));
        error.value(fitted.py()).setattr("fit", fitted)?;
        Err(error)
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

    /// The loss of the fit, predicted from its readings.
    #[getter]
    fn predicted_loss(&self) -> f32 {
        self.fit.prediction.loss
    }

    /// The upper bound of the loss, which holds for 90 % of materials, or None if the recipe has none.
    #[getter]
    fn loss_bound(&self) -> Option<f32> {
        self.fit.prediction.bound
    }

    /// True if the readings are unlike those of all training materials, so that the loss may be larger than predicted. None
    /// if the recipe cannot tell.
    #[getter]
    fn unlike_training(&self) -> Option<bool> {
        self.fit.prediction.unlike_training
    }

    /// True if readings were not at the recipe's directions, so that the bundled recipe for any directions fitted them.
    #[getter]
    fn off_pattern(&self) -> bool {
        self.chosen.off_pattern.is_some()
    }

    /// The directions of the fitted readings: unit vectors, incoming and outgoing, float64 of shape (n, 2, 3).
    #[getter]
    fn directions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let recipe = self.chosen.recipe.file.recipe();
        let flat = recipe
            .pattern()
            .flat_map(|angles| directions_of(&angles).concat());
        array(py, &[recipe.samples(), 2, 3], flat.collect())
    }

    /// Returns the standard deviation of the BRDF (linear RGB, sr^-1, not times the cosine), given the readings.
    ///
    /// Directions are those of a call of the material; the result has the shape (..., 3).
    #[pyo3(signature = (incoming, outgoing = None))]
    fn deviation<'py>(
        &self,
        py: Python<'py>,
        incoming: &Bound<'py, PyAny>,
        outgoing: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let pairs = Pairs::from_arrays(incoming, outgoing)?;
        let angles = pairs.angles()?;
        let posterior = &self.fit.selection.posterior;
        let deviations = posterior.deviations(self.material().fitted(), angles);
        array(py, &[&pairs.shape[..], &[3]].concat(), deviations.concat())
    }

    /// The wavelengths of the bands in nm, float32 of shape (b,), or None if the readings were in RGB.
    #[getter]
    fn wavelengths<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArrayDyn<f32>>>> {
        let bands = self.material().spectrum();
        let wavelengths = bands.map(|bands| bands.wavelengths().to_vec());
        let array = wavelengths.map(|each| array(py, &[each.len()], each));
        array.transpose()
    }

    /// Returns the BRDF (sr^-1, not times the cosine) of each band.
    ///
    /// Directions are those of a call of the material; the result has the shape (..., b).
    #[pyo3(signature = (incoming, outgoing = None))]
    fn spectrum<'py>(
        &self,
        py: Python<'py>,
        incoming: &Bound<'py, PyAny>,
        outgoing: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let Some(bands) = self.material().spectrum() else {
            return reject("the readings were in RGB: pass wavelengths to fit");
        };
        let pairs = Pairs::from_arrays(incoming, outgoing)?;
        let at = pairs.angles()?.into_iter();
        let at: Vec<_> = at.map(HalfDifference::from_angles).collect();
        let spectra = bands.evaluate(&at);
        let shape = [&pairs.shape[..], &[bands.wavelengths().len()]].concat();
        array(py, &shape, spectra.concat())
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
        let report = &selection.outlier_report;
        let outliers = report.outliers.iter().filter_map(|sample| {
            let prediction = report.predictions[*sample]?;
            Some(PyOutlier {
                sample: *sample,
                z: prediction.z,
                measured: selection.measurements.samples[*sample].mean()?,
                predicted: prediction.expected,
                status: selection.statuses[*sample].name(),
            })
        });
        outliers.collect()
    }

    /// Writes the material in a format of `Material.save`. If `path` ends in .json and `format` is None, writes the
    /// trainer's format, which `load_material` and every command of the trainer read. For the model linear, it also
    /// writes NAME.basis next to that file.
    #[pyo3(signature = (path, format = None, *, seed = 0, overwrite = false, as_fitted = false))]
    fn save(
        slf: &Bound<'_, Self>,
        py: Python<'_>,
        path: PathBuf,
        format: Option<&str>,
        seed: u64,
        overwrite: bool,
        as_fitted: bool,
    ) -> PyResult<()> {
        if path.extension().is_none_or(|extension| extension != "json") || format.is_some() {
            let base = slf.as_super().get();
            return base.save(py, path, format, seed, overwrite, as_fitted);
        }
        if as_fitted {
            return reject(
                "as_fitted has no effect on material.json, which holds parameters: omit it",
            );
        }
        let this = slf.get();
        let metadata = json!({ "trainer": concat!("glimpse_brdf ", env!("CARGO_PKG_VERSION")) });
        let basis = this.chosen.recipe.basis.as_deref();
        let files = material_files(this.material(), &path, basis, metadata);
        let files = files.map_err(|error| GlimpseError::new_err(error.to_string()))?;
        write(&files, overwrite)
    }

    /// Supports pickle, which stores the recipe and the readings. Unpickling repeats the fit.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let measurements = &self.fit.selection.measurements;
        let recipe = self.chosen.recipe.file.recipe();
        let samples = measurements.samples.iter().zip(&measurements.spectra);
        let readings = recipe
            .pattern()
            .zip(samples)
            .map(|(angles, (sample, spectrum))| {
                let reading = sample.mean().map(|mean| (mean, sample.saturated()));
                let angles = [angles.theta_h, angles.theta_d, angles.phi_d];
                (angles, reading, spectrum.clone())
            });
        let arguments = (
            self.material().name(),
            readings.collect::<Vec<_>>(),
            measurements.wavelengths.clone(),
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
