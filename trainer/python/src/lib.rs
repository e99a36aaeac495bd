//! The Python module `glimpse_brdf`: what the trainer does, with NumPy's arrays in and out.
//!
//! A thin layer: each class holds what the library has under the same name, each function calls the
//! library's. What is of Python alone is that arrays of any layout are taken (`arrays`), that errors become
//! exceptions with the same sentences (`error`), and that long work leaves Python's lock to others and hears
//! Ctrl-C (`waiting`). Doc comments of what
//! Python sees are its docstrings; types are in `python/glimpse_brdf/__init__.pyi`.

mod arrays;
mod choices;
mod error;
mod evaluate;
mod files;
mod fit;
mod loss;
mod material;
mod plan;
mod readings;
mod recipe;
mod sources;
mod train;
mod waiting;

use pyo3::prelude::*;

#[pymodule]
mod _glimpse_brdf {
    #[pymodule_export]
    use crate::error::GlimpseError;
    #[pymodule_export]
    use crate::evaluate::evaluate;
    #[pymodule_export]
    use crate::fit::{PyFittedMaterial, PyOutlier};
    #[pymodule_export]
    use crate::loss::{directions, loss};
    #[pymodule_export]
    use crate::material::{
        PyMaterial, directions_from_degrees, load_material, load_materials, table_directions,
    };
    #[pymodule_export]
    use crate::plan::PyPlan;
    #[pymodule_export]
    use crate::recipe::PyRecipe;
    #[pymodule_export]
    use crate::train::{PyProgress, train};

    use super::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
