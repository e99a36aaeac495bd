//! Comparison of materials with a reference.

use std::sync::Arc;

use glimpse_evaluation::evaluation::compare as compare_brdf;
use glimpse_evaluation::metrics::Metrics;
use glimpse_materials::Material;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;

use crate::error::Failure;
use crate::interruptible::run_detached;
use crate::material::PyMaterial;
use crate::sources::MaterialArgs;

/// Compares materials with a reference, as `trainer compare` does. `materials` is a source, a Material, or a list of both.
///
/// Returns a list with a dict for each material, which `pandas.DataFrame` takes: name; loss (see `loss`); and dssim, l2, psnr
/// and delta_e (mean CIEDE2000 over the sphere's disc) of a rendered sphere of 128 x 128 pixels.
#[pyfunction]
pub(crate) fn compare<'py>(
    py: Python<'py>,
    reference: &Bound<'py, PyMaterial>,
    materials: &Bound<'py, PyAny>,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let reference: Arc<dyn Material> = reference.get().complete()?;
    let materials = MaterialArgs::parse(materials)?;
    let sources = materials.sources(&[])?;
    let compared = run_detached(py, || {
        let (materials, _) = materials.load(&sources)?;
        let rows = materials.par_iter().map(|material| {
            let metrics = compare_brdf(&**material, &*reference).map_err(Failure::new)?;
            Ok((material.name().to_owned(), metrics))
        });
        rows.collect::<Result<Vec<(String, Metrics)>, Failure>>()
    })?;
    let rows = compared?.into_iter().map(|(name, metrics)| {
        let row = PyDict::new(py);
        row.set_item("name", name)?;
        for (key, value) in [
            ("loss", metrics.loss),
            ("dssim", metrics.dssim),
            ("l2", metrics.l2),
            ("psnr", metrics.psnr),
            ("delta_e", metrics.delta_e),
        ] {
            row.set_item(key, value)?;
        }
        Ok(row)
    });
    rows.collect()
}
