//! Fitted materials.

use std::path::PathBuf;
use std::sync::Arc;

use glimpse_core::geometry::HalfDifference;
use glimpse_fitting::measurement::{FitReport, MaterialFit, Readings};
use glimpse_materials::{FittedMaterial, Material, Viewing};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::arrays::{Array, Pairs, to_python};
use crate::error::{ImplausibleError, Result, reject, warn};
use crate::files::write;
use crate::integer;
use crate::interruptible::run_detached;
use crate::material::{Origin, PyMaterial};

/// A material that `Recipe.fit` fitted to readings, with diagnostics of the fit.
#[pyclass(extends = PyMaterial, frozen, name = "FittedMaterial", module = "glimpse_brdf")]
pub(crate) struct PyFittedMaterial {
    /// The fit, with its readings and the posterior.
    pub(crate) fit: MaterialFit,
    keep_all: bool,
    /// The Recipe of the call.
    recipe: Py<PyAny>,
}

impl PyFittedMaterial {
    pub(crate) fn new<'py>(
        recipe: &Bound<'py, PyAny>,
        readings: Readings,
        name: &str,
        keep_all: bool,
    ) -> Result<Bound<'py, Self>> {
        if name.is_empty() || name.contains(|c: char| c.is_control() || "/\\".contains(c)) {
            return reject(format!(
                "name is {name:?}: choose a name that is not empty and has no slashes or control characters"
            ));
        }
        let fit = || MaterialFit::new(readings, name.to_owned(), keep_all);
        let fit = run_detached(recipe.py(), fit)??;
        let base = PyMaterial {
            material: Arc::new(fit.material.clone()),
            origin: Origin::Readings,
        };
        let fitted = Self {
            fit,
            keep_all,
            recipe: recipe.clone().unbind(),
        };
        let fitted = PyClassInitializer::from(base).add_subclass(fitted);
        Ok(Bound::new(recipe.py(), fitted)?)
    }

    fn material(&self) -> &FittedMaterial {
        &self.fit.material
    }

    fn to_report(&self) -> FitReport {
        FitReport::new(&self.fit, Viewing::default())
    }

    /// Returns the fit, or raises `ImplausibleError` if its readings are implausible.
    pub(crate) fn require_plausible(fitted: Bound<'_, Self>) -> Result<Bound<'_, Self>> {
        let fit = &fitted.get().fit;
        let Err(failure) = fit.check_plausible() else {
            if let Some(doubt) = fit.doubt {
                warn(fitted.py(), doubt.to_string())?;
            }
            return Ok(fitted);
        };
        let error =
            ImplausibleError::new_err(format!("{failure} (the exception's `fit` has the fit)"));
        error.value(fitted.py()).setattr("fit", fitted)?;
        Err(error.into())
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
    /// then m for green, then m for blue. At any directions, each list ends with the weights of kernels, one at each direction of the readings.
    #[getter]
    fn parameters(&self) -> Array<f32> {
        Array::list(self.material().fitted().values().iter().copied())
    }

    /// The report on the fit: a dict with the keys of the trainer's material.json. `expected_loss` is a dict of the
    /// predicted `loss`, its upper `bound`, which holds for 90 % of materials, and `unlike_training`, or None if it is
    /// unknown. `loss_scale` has losses to compare it with. `readings` has the `outliers`, readings that are improbable
    /// given the others, worst first. `gaps` has what the readings leave open: gloss, large angles, color, and the
    /// `next` reading, which would help most.
    #[getter]
    fn report<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        to_python(py, run_detached(py, || self.to_report())?)
    }

    /// The directions of the fitted readings: unit vectors, incoming and outgoing, float64 of shape (n, 2, 3).
    #[getter]
    fn directions(&self) -> Array<f64> {
        let samples = self.fit.selection.readings.samples.iter();
        Array::directions(samples.map(|sample| sample.angles))
    }

    /// The readings at `directions`, float32 of shape (n, 3): the BRDF in linear RGB, sr^-1, not times the cosine. NaN for a
    /// missing reading; `report["readings"]["unused"]` lists others that the fit did not use.
    #[getter]
    fn readings(&self) -> Array<f32> {
        let samples = self.fit.selection.readings.samples.iter();
        Array::rows(samples.map(|sample| sample.brdf.mean().unwrap_or([f32::NAN; 3])))
    }

    /// Returns the standard deviation of the BRDF (linear RGB, sr^-1, not times the cosine), given the readings.
    ///
    /// Directions are those of a call of the material; the result has the shape (..., 3).
    #[pyo3(signature = (incoming, outgoing = None))]
    fn deviation(
        &self,
        py: Python<'_>,
        incoming: &Bound<'_, PyAny>,
        outgoing: Option<&Bound<'_, PyAny>>,
    ) -> Result<Array<f32>> {
        let pairs = Pairs::from_arrays(incoming, outgoing, &[])?;
        let angles = pairs.angles()?;
        let posterior = &self.fit.selection.posterior;
        let fitted = self.material().fitted();
        let deviations = run_detached(py, || posterior.deviations(fitted, angles))?;
        Ok(Array::new(&pairs.shape, 3, deviations.concat()))
    }

    /// The wavelengths of the bands in nm, float32 of shape (b,), or None if the readings were in RGB.
    #[getter]
    fn wavelengths(&self) -> Option<Array<f32>> {
        let bands = self.material().spectrum();
        bands.map(|bands| Array::list(bands.wavelengths().iter().copied()))
    }

    /// Returns the BRDF (sr^-1, not times the cosine) of each band.
    ///
    /// Directions are those of a call of the material; the result has the shape (..., b).
    #[pyo3(signature = (incoming, outgoing = None))]
    fn spectrum(
        &self,
        py: Python<'_>,
        incoming: &Bound<'_, PyAny>,
        outgoing: Option<&Bound<'_, PyAny>>,
    ) -> Result<Array<f32>> {
        let Some(bands) = self.material().spectrum() else {
            return reject("the readings were in RGB: pass wavelengths to fit");
        };
        let pairs = Pairs::from_arrays(incoming, outgoing, &[])?;
        let at = pairs.angles()?.into_iter();
        let at: Vec<_> = at.map(HalfDifference::from_angles).collect();
        let spectra = run_detached(py, || bands.evaluate(&at))?;
        let bands = bands.wavelengths().len();
        Ok(Array::new(&pairs.shape, bands, spectra.concat()))
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
        #[pyo3(from_py_with = integer::seed)] seed: u64,
        overwrite: bool,
        as_fitted: bool,
    ) -> Result<()> {
        if path.extension().is_none_or(|extension| extension != "json") || format.is_some() {
            let base = slf.as_super().get();
            return base.save(py, path, format, seed, overwrite, as_fitted);
        }
        if as_fitted {
            return reject(
                "as_fitted has no effect on material.json, which holds parameters: omit it",
            );
        }
        let fitted = slf.get();
        let files = || fitted.fit.files(&path, &fitted.to_report());
        write(&run_detached(py, files)??, overwrite)
    }

    /// Supports pickle, which stores the recipe and the readings. Unpickling repeats the fit.
    fn __reduce__<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        let readings = &self.fit.selection.readings;
        let data = postcard::to_stdvec(&(&readings.rows, &readings.quantity));
        let data = PyBytes::new(py, &data?);
        let arguments = (self.material().name(), data, self.keep_all);
        let restore = self.recipe.bind(py).getattr("_fit_rows")?;
        Ok((restore, arguments).into_bound_py_any(py)?)
    }

    fn __repr__(&self) -> String {
        let readings = &self.fit.selection.readings;
        let used = readings.indices(|sample| sample.used().is_some()).len();
        format!(
            "<glimpse_brdf.FittedMaterial of the model {} from {used} readings>",
            self.model()
        )
    }
}
