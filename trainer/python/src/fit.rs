//! Fitted materials and the outliers among their readings.

use std::path::PathBuf;
use std::sync::Arc;

use glimpse_core::gonio::Repeated;
use glimpse_materials::basis::Basis;
use glimpse_materials::{BasisFile, FittedBrdf, FittedMaterial, Material};
use glimpse_trainer::measurement::{Fit, Measurements, ReadingStatus, fit};
use glimpse_training::recipe::RecipeFile;
use numpy::PyArrayDyn;
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyType};
use serde_json::json;

use crate::arrays::array;
use crate::error::{GlimpseError, reject, to_exception};
use crate::files::write;
use crate::interruptible::run_detached;
use crate::material::{Origin, PyMaterial};

pub(crate) use crate::readings::ReadingArgs;

/// A reading that is improbable given the other readings.
///
/// `sample` is its row in the recipe's directions. `z` is its distance from the prediction from the other readings, in
/// standard deviations (positive: too large). `measured` and `predicted` are BRDFs, linear RGB, sr^-1. `excluded` is
/// True if the fit did not use it.
#[pyclass(frozen, get_all, name = "Outlier", module = "glimpse_brdf")]
pub(crate) struct PyOutlier {
    sample: usize,
    z: f64,
    measured: [f32; 3],
    predicted: [f32; 3],
    excluded: bool,
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
    material: Arc<FittedMaterial>,
    fit: Fit,
    /// Reading of each sample, a BRDF in sr^-1; None if it is missing.
    readings: Vec<Option<[f32; 3]>>,
    /// True for each sample with a saturated reading.
    saturated: Vec<bool>,
    keep_all: bool,
    file: Arc<RecipeFile>,
    basis: Option<Arc<Basis>>,
}

impl PyFittedMaterial {
    pub(crate) fn from_arrays<'py>(
        py: Python<'py>,
        file: &Arc<RecipeFile>,
        basis: Option<&Arc<Basis>>,
        args: &ReadingArgs<'_, '_>,
        name: &str,
        keep_all: bool,
    ) -> PyResult<Bound<'py, Self>> {
        if name.is_empty() || name.contains(|c: char| c.is_control() || "/\\".contains(c)) {
            return reject(format!(
                "name is {name:?}: choose a name that is not empty and has no slashes or control characters"
            ));
        }
        let recipe = file.recipe();
        let pattern: Vec<_> = recipe.pattern().collect();
        let measurements = args.measurements(&pattern)?;
        Self::from_measurements(py, file, basis, &measurements, name, keep_all)
    }

    fn from_measurements<'py>(
        py: Python<'py>,
        file: &Arc<RecipeFile>,
        basis: Option<&Arc<Basis>>,
        measurements: &Measurements,
        name: &str,
        keep_all: bool,
    ) -> PyResult<Bound<'py, Self>> {
        let recipe = file.recipe();
        let (fit, material) = run_detached(py, || {
            let fit = fit(&recipe, measurements, keep_all)?;
            let values = fit.values.clone();
            let fitted = FittedBrdf::new(recipe.model(), values, basis.map(|basis| &**basis));
            let material = fitted.and_then(|fitted| FittedMaterial::new(name.to_owned(), fitted));
            Ok((fit, material))
        })?
        .map_err(|error: glimpse_trainer::measurement::FitFailure| to_exception(error))?;
        let Some(material) = material.map(Arc::new) else {
            return reject(format!(
                "the fit has {} values, which does not match the recipe's model {}: use another recipe",
                fit.values.len(),
                recipe.model().name()
            ));
        };
        let base = PyMaterial {
            material: material.clone(),
            in_batches: true,
            origin: Origin::Readings,
        };
        let fitted = Self {
            material,
            fit,
            readings: measurements
                .samples
                .iter()
                .map(|sample| sample.mean())
                .collect(),
            saturated: measurements
                .samples
                .iter()
                .map(|sample| sample.saturated())
                .collect(),
            keep_all,
            file: file.clone(),
            basis: basis.cloned(),
        };
        Bound::new(py, PyClassInitializer::from(base).add_subclass(fitted))
    }
}

#[pymethods]
impl PyFittedMaterial {
    /// The fitted model: "phong", "cook-torrance", "linear" or "neural".
    #[getter]
    fn model(&self) -> &'static str {
        self.material.fitted().model().name()
    }

    /// The parameters of the model in its order, float32 of shape (p,). The model linear has m coefficients for red,
    /// then m for green, then m for blue.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let values = self.material.fitted().values().to_vec();
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

    /// The status of each sample's reading: "used", "missing", "saturated" or "excluded" (an outlier).
    #[getter]
    fn statuses(&self) -> Vec<&'static str> {
        let names = self.fit.statuses.iter().map(|status| match status {
            ReadingStatus::Used => "used",
            ReadingStatus::Missing => "missing",
            ReadingStatus::Saturated => "saturated",
            ReadingStatus::Excluded => "excluded",
        });
        names.collect()
    }

    /// The loss of the fit at the used readings: a dict of mean, worst and worst_sample, or None if it is unknown.
    #[getter]
    fn residual<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(residual) = self.fit.residual else {
            return Ok(None);
        };
        let dict = PyDict::new(py);
        dict.set_item("mean", residual.mean)?;
        dict.set_item("worst", residual.worst)?;
        dict.set_item("worst_sample", residual.worst_index)?;
        Ok(Some(dict))
    }

    /// Readings that are improbable given the others, the worst first. A correct reading of a material unlike the
    /// training materials may be among them.
    #[getter]
    fn outliers(&self) -> Vec<PyOutlier> {
        let outliers = self.fit.outlier_report.outliers.iter();
        let outliers = outliers.map(|outlier| PyOutlier {
            sample: outlier.sample,
            z: outlier.prediction.z,
            measured: self.readings[outlier.sample].unwrap_or_default(),
            predicted: outlier.prediction.expected,
            excluded: self.fit.statuses[outlier.sample] == ReadingStatus::Excluded,
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
        let mut files = Vec::new();
        let mut basis_file = None;
        if let Some(basis) = &this.basis {
            let (basis_path, bytes) = (path.with_extension("basis"), basis.to_bytes());
            let name = basis_path
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned();
            basis_file = Some(BasisFile::new(name, basis.whole_checksum()));
            files.push((basis_path, bytes));
        }
        let metadata = json!({ "trainer": concat!("glimpse_brdf ", env!("CARGO_PKG_VERSION")) });
        let text = this.material.to_json(basis_file.as_ref(), metadata);
        let text = text.map_err(|error| GlimpseError::new_err(error.to_string()))?;
        files.push((path, text.into_bytes()));
        write(&files, overwrite)
    }

    /// Supports pickle, which stores the recipe and the readings. Unpickling repeats the fit.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let class = py.get_type::<Self>();
        let basis = self.basis.as_ref().map(|basis| basis.to_bytes());
        let arguments = (
            PyBytes::new(py, self.file.bytes()),
            basis.map(|bytes| PyBytes::new(py, &bytes)),
            self.material.name(),
            self.readings.clone(),
            self.saturated.clone(),
            self.keep_all,
        );
        (class.getattr("_from_readings")?, arguments).into_bound_py_any(py)
    }

    /// Restores a pickled fit.
    #[classmethod]
    #[expect(clippy::too_many_arguments, reason = "only pickle calls it")]
    fn _from_readings<'py>(
        _class: &Bound<'py, PyType>,
        py: Python<'py>,
        recipe: &[u8],
        basis: Option<&[u8]>,
        name: &str,
        readings: Vec<Option<[f32; 3]>>,
        saturated: Vec<bool>,
        keep_all: bool,
    ) -> PyResult<Bound<'py, Self>> {
        let file = Arc::new(RecipeFile::new(recipe.to_vec()).map_err(to_exception)?);
        let checksum = file.recipe().basis_checksum();
        let basis = basis.zip(checksum);
        let basis = basis.map(|(bytes, checksum)| Basis::parse_for_recipe(bytes, checksum));
        let basis = basis.transpose();
        let basis = basis
            .map_err(|error| GlimpseError::new_err(format!("basis of the pickled fit: {error}")))?;
        let mut measurements = Measurements {
            samples: vec![Repeated::new(); readings.len()],
            rows: 0,
            max_distance: None,
        };
        let samples = measurements.samples.iter_mut().zip(readings).zip(saturated);
        for ((sample, reading), saturated) in samples {
            if let Some(brdf) = reading {
                sample.add(brdf, saturated).map_err(to_exception)?;
                measurements.rows += 1;
            }
        }
        let basis = basis.map(Arc::new);
        Self::from_measurements(py, &file, basis.as_ref(), &measurements, name, keep_all)
    }

    fn __repr__(&self) -> String {
        let statuses = self.fit.statuses.iter();
        let used = statuses.filter(|status| **status == ReadingStatus::Used);
        let used = used.count();
        format!(
            "<glimpse_brdf.FittedMaterial of the model {} from {used} readings>",
            self.model()
        )
    }
}
