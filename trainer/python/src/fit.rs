//! Fits of readings: a material, and what is known of it.

use std::path::PathBuf;
use std::sync::Arc;

use glimpse_core::gonio::Repeated;
use glimpse_materials::basis::Basis;
use glimpse_materials::{BasisFile, Fitted, FittedMaterial, Material};
use glimpse_trainer::measurement::{Fit, Measured, ReadingStatus, fit};
use glimpse_training::recipe::RecipeFile;
use numpy::PyArrayDyn;
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyType};
use serde_json::json;

use crate::arrays::array;
use crate::error::{GlimpseError, raised, refused};
use crate::files::write;
use crate::material::{Origin, PyMaterial};
use crate::waiting::detached;

pub(crate) use crate::readings::ReadingArgs;

/// A reading that the others make improbable: `sample` is its row in the recipe's directions, `z` how many standard
/// deviations it is from what the others say (positive: too large), `read` and `expected` are BRDFs, linear RGB, sr^-1,
/// and `left_out` is True if the fit went without it.
#[pyclass(frozen, get_all, name = "Outlier", module = "glimpse_brdf")]
pub(crate) struct PyOutlier {
    sample: usize,
    z: f64,
    read: [f32; 3],
    expected: [f32; 3],
    left_out: bool,
}

#[pymethods]
impl PyOutlier {
    fn __repr__(&self) -> String {
        let rgb = |brdf: [f32; 3]| brdf.map(|f| format!("{f:.3}")).join(" ");
        format!(
            "<glimpse_brdf.Outlier sample {}: read {}, expected about {} (z {:+.1})>",
            self.sample,
            rgb(self.read),
            rgb(self.expected),
            self.z
        )
    }
}

/// A material that was fitted to readings by `Recipe.fit`, and what is known of the fit.
#[pyclass(extends = PyMaterial, frozen, name = "FittedMaterial", module = "glimpse_brdf")]
pub(crate) struct PyFittedMaterial {
    material: Arc<FittedMaterial>,
    fit: Fit,
    /// What was read of each sample, BRDFs in sr^-1.
    read: Vec<Option<[f32; 3]>>,
    /// True for each sample with a saturated reading.
    saturated: Vec<bool>,
    keep_all: bool,
    file: Arc<RecipeFile>,
    basis: Option<Arc<Basis>>,
}

impl PyFittedMaterial {
    pub(crate) fn of<'py>(
        py: Python<'py>,
        file: &Arc<RecipeFile>,
        basis: Option<&Arc<Basis>>,
        args: &ReadingArgs<'_, '_>,
        name: &str,
        keep_all: bool,
    ) -> PyResult<Bound<'py, Self>> {
        if name.is_empty() || name.contains(|c: char| c.is_control() || "/\\".contains(c)) {
            return refused("name should be the name of a material, without slashes");
        }
        let recipe = file.recipe();
        let pattern: Vec<_> = recipe.pattern().collect();
        let measured = args.measured(&pattern)?;
        Self::of_measured(py, file, basis, &measured, name, keep_all)
    }

    fn of_measured<'py>(
        py: Python<'py>,
        file: &Arc<RecipeFile>,
        basis: Option<&Arc<Basis>>,
        measured: &Measured,
        name: &str,
        keep_all: bool,
    ) -> PyResult<Bound<'py, Self>> {
        let recipe = file.recipe();
        let (fit, material) = detached(py, || {
            let fit = fit(&recipe, measured, keep_all)?;
            let values = fit.values.clone();
            let fitted = Fitted::new(recipe.model(), values, basis.map(|basis| &**basis));
            let material = fitted.and_then(|fitted| FittedMaterial::new(name.to_owned(), fitted));
            Ok((fit, material))
        })?
        .map_err(|error: glimpse_trainer::measurement::FitFailure| raised(error))?;
        let Some(material) = material.map(Arc::new) else {
            return refused(format!(
                "{} values are not what the recipe's model has",
                fit.values.len()
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
            read: measured
                .samples
                .iter()
                .map(|sample| sample.mean())
                .collect(),
            saturated: measured
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
    /// The model that was fitted: "phong", "cook-torrance", "linear" or "neural".
    #[getter]
    fn model(&self) -> &'static str {
        self.material.fitted().model().name()
    }

    /// A model's parameters in its order, or linear's coefficients, m for red, m for green, m for blue: float32 of
    /// shape (p,).
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let values = self.material.fitted().values().to_vec();
        array(py, &[values.len()], values)
    }

    /// The loss that the fit is likely to have, by its readings, or None where the recipe predicts none.
    #[getter]
    fn predicted_loss(&self) -> Option<f32> {
        self.fit.predicted_loss
    }

    /// What became of each sample's reading: "used", "missing", "saturated" or "left out".
    #[getter]
    fn fates(&self) -> Vec<&'static str> {
        self.fit.fates.iter().map(|fate| fate.name()).collect()
    }

    /// How well it explains the readings that were used: a dict of mean, worst and worst_sample, of the losses at the
    /// samples; or None.
    #[getter]
    fn residual<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(residual) = self.fit.residual else {
            return Ok(None);
        };
        let found = PyDict::new(py);
        found.set_item("mean", residual.mean)?;
        found.set_item("worst", residual.worst)?;
        found.set_item("worst_sample", residual.worst_index)?;
        Ok(Some(found))
    }

    /// Readings that the others make improbable, the worst first. Of a material unlike those of the training a right
    /// one may be among them.
    #[getter]
    fn suspects(&self) -> Vec<PyOutlier> {
        let suspects = self.fit.examined.suspects.iter();
        let each = suspects.map(|suspect| PyOutlier {
            sample: suspect.sample,
            z: suspect.opinion.z,
            read: self.read[suspect.sample].unwrap_or_default(),
            expected: suspect.opinion.expected,
            left_out: self.fit.fates[suspect.sample] == ReadingStatus::Excluded,
        });
        each.collect()
    }

    /// Writes it as any material, or, if `path` ends in .json, as the trainer's own file (of the model linear with a
    /// basis beside it), which `load_material` and every command of the trainer read.
    #[pyo3(signature = (path, format = None, *, seed = 0, overwrite = false))]
    fn save(
        slf: &Bound<'_, Self>,
        py: Python<'_>,
        path: PathBuf,
        format: Option<&str>,
        seed: u64,
        overwrite: bool,
    ) -> PyResult<()> {
        if path.extension().is_none_or(|ending| ending != "json") || format.is_some() {
            let base = slf.as_super().get();
            return base.save(py, path, format, seed, overwrite);
        }
        let this = slf.get();
        let mut files = Vec::new();
        let mut named = None;
        if let Some(basis) = &this.basis {
            let (beside, bytes) = (path.with_extension("basis"), basis.to_bytes());
            let name = beside
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned();
            named = Some(BasisFile::new(name, basis.named_by()));
            files.push((beside, bytes));
        }
        let about = json!({ "trainer": concat!("glimpse_brdf ", env!("CARGO_PKG_VERSION")) });
        let text = this.material.to_json(named.as_ref(), about);
        let text = text.map_err(|error| GlimpseError::new_err(error.to_string()))?;
        files.push((path, text.into_bytes()));
        write(&files, overwrite)
    }

    /// For other processes: the recipe and the readings, which are fitted again.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let class = py.get_type::<Self>();
        let basis = self.basis.as_ref().map(|basis| basis.to_bytes());
        let arguments = (
            PyBytes::new(py, self.file.bytes()),
            basis.map(|bytes| PyBytes::new(py, &bytes)),
            self.material.name(),
            self.read.clone(),
            self.saturated.clone(),
            self.keep_all,
        );
        (class.getattr("_from_readings")?, arguments).into_bound_py_any(py)
    }

    /// A fit that was pickled.
    #[classmethod]
    #[expect(clippy::too_many_arguments, reason = "only pickle calls it")]
    fn _from_readings<'py>(
        _class: &Bound<'py, PyType>,
        py: Python<'py>,
        recipe: &[u8],
        basis: Option<&[u8]>,
        name: &str,
        read: Vec<Option<[f32; 3]>>,
        saturated: Vec<bool>,
        keep_all: bool,
    ) -> PyResult<Bound<'py, Self>> {
        let file = Arc::new(RecipeFile::new(recipe.to_vec()).map_err(raised)?);
        let checksum = file.recipe().method().basis_checksum();
        let basis = basis.zip(checksum);
        let basis = basis.map(|(bytes, checksum)| Basis::of_recipe(bytes, checksum));
        let basis = basis.transpose();
        let basis = basis.map_err(|what| GlimpseError::new_err(format!("the basis: {what}")))?;
        let mut measured = Measured {
            samples: vec![Repeated::new(); read.len()],
            rows: 0,
            furthest: None,
        };
        let samples = measured.samples.iter_mut().zip(read).zip(saturated);
        for ((sample, read), saturated) in samples {
            if let Some(brdf) = read {
                sample.add(brdf, saturated).map_err(raised)?;
                measured.rows += 1;
            }
        }
        let basis = basis.map(Arc::new);
        Self::of_measured(py, &file, basis.as_ref(), &measured, name, keep_all)
    }

    fn __repr__(&self) -> String {
        let fates = self.fit.fates.iter();
        let used = fates.filter(|fate| **fate == ReadingStatus::Used).count();
        format!(
            "<glimpse_brdf.FittedMaterial of the model {} by {used} readings>",
            self.model()
        )
    }
}
