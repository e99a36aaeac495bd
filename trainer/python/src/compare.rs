//! Comparison of materials with a reference.

use std::sync::Arc;

use glimpse_evaluation::evaluation::compare as compare_brdf;
use glimpse_evaluation::metrics::Metrics;
use glimpse_materials::Material;
use pyo3::prelude::*;
use rayon::prelude::*;
use serde::Serialize;

use crate::arrays::to_python;
use crate::error::Result;
use crate::interruptible::run_detached;
use crate::material::PyMaterial;
use crate::sources::MaterialArgs;

#[derive(Serialize)]
struct Comparison {
    name: String,
    #[serde(flatten)]
    metrics: Metrics,
}

/// Compares materials with a reference, as `trainer compare` does. `materials` is a source, a Material, or a list of both.
///
/// Returns a list with a dict for each material, which `pandas.DataFrame` takes: name; loss (see `loss`); and dssim, l2, psnr
/// and delta_e (mean CIEDE2000 over the sphere's disc) of a rendered sphere of 128 x 128 pixels.
#[pyfunction]
pub(crate) fn compare<'py>(
    py: Python<'py>,
    reference: &Bound<'py, PyMaterial>,
    materials: &Bound<'py, PyAny>,
) -> Result<Bound<'py, PyAny>> {
    let reference: Arc<dyn Material> = reference.get().complete()?;
    let materials = MaterialArgs::parse(materials, &[])?;
    let compared = run_detached(py, || {
        let (materials, _) = materials.load()?;
        let rows = materials.par_iter().map(|material| {
            let metrics = compare_brdf(&**material, &*reference);
            let name = material.name().to_owned();
            Comparison { name, metrics }
        });
        Result::Ok(rows.collect::<Vec<Comparison>>())
    })?;
    to_python(py, compared?)
}
