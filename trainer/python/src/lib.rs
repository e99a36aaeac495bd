//! The Python module `glimpse_brdf`: the trainer's functions, with NumPy arrays as input and output.
//!
//! This is a thin layer. Each class wraps the library's type of the same name, and each function calls the library's.
//! Three things are specific to Python. Arrays of any layout are accepted (`arrays`). Errors become exceptions with
//! the same messages (`error`). Long computations release the GIL and react to Ctrl-C (`interruptible`).
//!
//! Doc comments of exported items become Python docstrings. The types are in `python/glimpse_brdf/__init__.pyi`.

mod arrays;
mod choices;
mod compare;
mod error;
mod evaluate;
mod files;
mod fit;
mod integer;
mod interruptible;
mod loss;
mod machine;
mod material;
mod photo;
mod plan;
mod readings;
mod recipe;
mod sources;
mod train;

use pyo3::prelude::*;

#[pymodule]
mod _glimpse_brdf {
    #[pymodule_export]
    use crate::{
        compare::compare,
        error::{GlimpseError, ImplausibleError},
        evaluate::evaluate,
        fit::PyFittedMaterial,
        loss::{directions, loss},
        machine::PyMachine,
        material::{PyMaterial, load_material, load_materials, table_directions},
        photo::photo,
        recipe::{PyRecipe, bundled_recipes},
        train::train,
    };

    use super::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
