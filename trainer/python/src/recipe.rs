//! Recipes: read, looked at, written.

use std::path::PathBuf;
use std::sync::Arc;

use glimpse_core::recipe::Recipe;
use glimpse_materials::basis::Basis;
use glimpse_trainer::route::arms_of;
use glimpse_training::recipe::RecipeFile;
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyType};

use crate::arrays::array;
use crate::error::{GlimpseError, raised, refused};
use crate::files::write;
use crate::fit::{PyFittedMaterial, ReadingArgs};
use crate::material::directions_of;
use crate::plan::{MachineArgs, PyPlan};
use crate::waiting::detached;

/// Bytes of a recipe, and of its basis.
type Parts<'py> = (Bound<'py, PyBytes>, Option<Bound<'py, PyBytes>>);

/// A recipe: where to measure, and how to fit what was read. `train` makes one.
///
/// Recipe(data, basis=None) is of the bytes of a file, and of the model linear of those of its basis. Recipes are
/// compared by their bytes, can be copied and sent to other processes; len() is the number of samples.
#[pyclass(frozen, name = "Recipe", module = "glimpse_brdf")]
pub(crate) struct PyRecipe {
    pub(crate) file: Arc<RecipeFile>,
    /// The basis, of the model Linear.
    pub(crate) basis: Option<Arc<Basis>>,
}

impl PyRecipe {
    /// The recipe, which borrows its bytes.
    pub(crate) fn recipe(&self) -> Recipe<'_> {
        self.file.recipe()
    }

    /// From bytes, and those of its basis if it needs one.
    pub(crate) fn of_bytes(file: RecipeFile, basis: Option<&[u8]>) -> PyResult<Self> {
        let checksum = file.recipe().method().basis_checksum();
        let basis = match (checksum, basis) {
            (None, None) => None,
            (None, Some(_)) => {
                return refused("basis has no effect: it is for recipes of the model linear");
            }
            (Some(_), None) => {
                return refused(
                    "a recipe of the model linear needs the basis that was written beside it: give it as basis, \
                     or use Recipe.load",
                );
            }
            (Some(checksum), Some(bytes)) => {
                let basis = Basis::of_recipe(bytes, checksum);
                let basis = basis.map_err(|what| {
                    GlimpseError::new_err(format!(
                        "the basis is not the one of this recipe: {what}"
                    ))
                })?;
                Some(Arc::new(basis))
            }
        };
        Ok(Self {
            file: Arc::new(file),
            basis,
        })
    }
}

#[pymethods]
impl PyRecipe {
    #[new]
    #[pyo3(signature = (data, basis = None))]
    fn new(data: &[u8], basis: Option<&[u8]>) -> PyResult<Self> {
        Self::of_bytes(RecipeFile::new(data.to_vec()).map_err(raised)?, basis)
    }

    /// Reads a recipe's file, and of the model linear the basis that was written beside it.
    #[classmethod]
    fn load(_class: &Bound<'_, PyType>, py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let read = detached(py, || RecipeFile::read_with_basis(&path))?;
        let (file, basis) = read.map_err(raised)?;
        Ok(Self {
            file: Arc::new(file),
            basis: basis.map(Arc::new),
        })
    }

    /// Writes it, and of the model linear its basis beside it, NAME.basis. A file that is there and not the same stays,
    /// and FileExistsError is raised, unless `overwrite`.
    #[pyo3(signature = (path, *, overwrite = false))]
    fn save(&self, py: Python<'_>, path: PathBuf, overwrite: bool) -> PyResult<()> {
        let mut files = Vec::new();
        if let Some(basis) = &self.basis {
            // First: a recipe without its basis would be of no use.
            files.push((Basis::beside(&path), basis.to_bytes()));
        }
        files.push((path, self.file.bytes().to_vec()));
        detached(py, || write(&files, overwrite))?
    }

    /// Its bytes, as a device takes them.
    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, self.file.bytes())
    }

    /// The bytes of its whole basis, of the model linear.
    fn basis_bytes<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyBytes>> {
        let bytes = self.basis.as_ref().map(|basis| basis.to_bytes());
        bytes.map(|bytes| PyBytes::new(py, &bytes))
    }

    /// The model that is fitted: "phong", "cook-torrance", "linear" or "neural".
    #[getter]
    fn model(&self) -> &'static str {
        self.recipe().model().name()
    }

    /// n, how many samples it measures.
    #[getter]
    fn samples(&self) -> usize {
        self.recipe().samples()
    }

    /// Its CRC-32, eight digits of hex, by which devices name it.
    #[getter]
    fn checksum(&self) -> String {
        format!("{:08x}", self.recipe().checksum())
    }

    /// True if it fits whatever was read; otherwise it needs all of its readings.
    #[getter]
    fn takes_missing(&self) -> bool {
        self.recipe().tolerates_missing()
    }

    /// Where it measures: unit vectors, incoming and outgoing, float64 of shape (n, 2, 3).
    #[getter]
    fn directions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let recipe = self.recipe();
        let flat = recipe
            .pattern()
            .flat_map(|angles| directions_of(&angles).concat());
        array(py, &[recipe.samples(), 2, 3], flat.collect())
    }

    /// The same as theta_i, phi_i, theta_o, phi_o in degrees, float64 of shape (n, 4).
    #[getter]
    fn angles_degrees<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let recipe = self.recipe();
        let flat = recipe.pattern().flat_map(|angles| arms_of(angles).values());
        array(py, &[recipe.samples(), 4], flat.collect())
    }

    /// The same as Rusinkiewicz angles theta_h, theta_d, phi_d in radians, float64 of shape (n, 3).
    #[getter]
    fn half_difference_radians<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let recipe = self.recipe();
        let flat = recipe
            .pattern()
            .flat_map(|angles| [angles.theta_h, angles.theta_d, angles.phi_d].map(f64::from));
        array(py, &[recipe.samples(), 3], flat.collect())
    }

    /// The loss to expect of an unseen material (see `loss`), or None if it is not stated.
    #[getter]
    fn expected_loss(&self) -> Option<f32> {
        let expectation = self.file.metadata().expectation;
        expectation.map(|expectation| expectation.loss)
    }

    /// The same with what it was found on: a dict of loss, standard_error (or None), materials (how many) and on
    /// (which, in words); or None.
    #[getter]
    fn expectation<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let statements = self.file.metadata();
        let Some(expectation) = statements.expectation else {
            return Ok(None);
        };
        let found = PyDict::new(py);
        found.set_item("loss", expectation.loss)?;
        found.set_item("standard_error", expectation.standard_error)?;
        found.set_item("materials", expectation.materials)?;
        found.set_item("on", expectation.on)?;
        Ok(Some(found))
    }

    /// The machine that it was trained for: a dict of max_theta_i_degrees, max_theta_o_degrees, min_separation_degrees
    /// and in_plane; or None if for any.
    #[getter]
    fn limits<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(limits) = self.file.metadata().limits else {
            return Ok(None);
        };
        let found = PyDict::new(py);
        let degrees = |radians: f32| f64::from(radians).to_degrees();
        found.set_item("max_theta_i_degrees", degrees(limits.max_theta_i))?;
        found.set_item("max_theta_o_degrees", degrees(limits.max_theta_o))?;
        found.set_item("min_separation_degrees", degrees(limits.min_separation))?;
        found.set_item("in_plane", limits.in_plane)?;
        Ok(Some(found))
    }

    /// The noise that it was trained for: a dict of relative (standard deviation), additive_per_steradian (the same
    /// besides, of the BRDF) and levels (of the sensor; 0: any number); or None.
    #[getter]
    fn noise<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(noise) = self.file.metadata().noise else {
            return Ok(None);
        };
        let found = PyDict::new(py);
        found.set_item("relative", noise.multiplicative)?;
        found.set_item("additive_per_steradian", noise.additive)?;
        found.set_item("levels", noise.levels)?;
        Ok(Some(found))
    }

    /// Where it came from: a dict of trainer, data, materials (how many), schedule, seed and options; or None.
    #[getter]
    fn provenance<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(provenance) = self.file.metadata().provenance else {
            return Ok(None);
        };
        let found = PyDict::new(py);
        found.set_item("trainer", provenance.trainer)?;
        found.set_item("data", provenance.data)?;
        found.set_item("materials", provenance.materials)?;
        found.set_item("schedule", provenance.schedule)?;
        found.set_item("seed", provenance.seed)?;
        found.set_item("options", provenance.options)?;
        Ok(Some(found))
    }

    /// The training in types: a dict of schedule, effort, parts, split (the materials that the expected loss was found
    /// on), digest (of all options, hexadecimal) and sources, a list of dicts of label, origin, materials (their number)
    /// and share (of training tasks); or None.
    #[getter]
    fn training<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(training) = self.file.metadata().training else {
            return Ok(None);
        };
        let sources = training.sources.map(|source| {
            let found = PyDict::new(py);
            found.set_item("label", source.label)?;
            found.set_item("origin", source.origin.name())?;
            found.set_item("materials", source.materials)?;
            found.set_item("share", source.share)?;
            Ok(found)
        });
        let found = PyDict::new(py);
        found.set_item("schedule", training.schedule.name())?;
        found.set_item("effort", training.effort.name())?;
        found.set_item("parts", training.parts.name())?;
        found.set_item("split", training.split.name())?;
        found.set_item("digest", format!("{:016x}", training.digest))?;
        found.set_item("sources", sources.collect::<PyResult<Vec<_>>>()?)?;
        Ok(Some(found))
    }

    /// The names of the materials that it was trained on; empty if it does not say.
    #[getter]
    fn trained_on(&self) -> PyResult<Vec<String>> {
        let statements = self.file.metadata();
        Ok(statements
            .materials
            .map(|(name, _)| name.to_owned())
            .collect())
    }

    /// Plans a scan: in which order a machine's arms go to the samples, where they stand, and when; as `trainer plan`.
    ///
    /// `order` is "travel", the least time, or "progressive", the recipe's own, in which samples of one that takes
    /// missing readings come most telling first. `speed_degrees_per_second` is one number, or four, of the axes theta_i,
    /// phi_i, theta_o, phi_o (10 unless given; an azimuth of speed 0 is an axis that is not there); `settle_seconds` is
    /// spent at each sample; `start_degrees` is where the axes stand at first. With `swap` light and sensor may be
    /// exchanged, for materials that are reciprocal. `isotropic` samples do not notice if both arms turn together, so that
    /// only the difference of azimuths is kept. Without `full_turns` azimuths stay within 180 degrees either way.
    /// Limits of the machine are the recipe's unless given. Beyond 16 samples the search goes by `seed`.
    ///
    /// Raises GlimpseError that names every sample out of reach.
    #[pyo3(signature = (
        order = "travel", *, speed_degrees_per_second = None, settle_seconds = 0.5,
        start_degrees = [0.0; 4], swap = false, isotropic = true, full_turns = true,
        max_theta_i_degrees = None, max_theta_o_degrees = None, min_separation_degrees = None, seed = 0,
    ))]
    #[expect(clippy::too_many_arguments, reason = "they have names in Python")]
    fn plan(
        &self,
        py: Python<'_>,
        order: &str,
        speed_degrees_per_second: Option<&Bound<'_, PyAny>>,
        settle_seconds: f64,
        start_degrees: [f64; 4],
        swap: bool,
        isotropic: bool,
        full_turns: bool,
        max_theta_i_degrees: Option<f64>,
        max_theta_o_degrees: Option<f64>,
        min_separation_degrees: Option<f64>,
        seed: u64,
    ) -> PyResult<PyPlan> {
        let machine = MachineArgs {
            speeds: speed_degrees_per_second,
            settle: settle_seconds,
            start: start_degrees,
            isotropic,
            full_turns,
            limits: [
                max_theta_i_degrees,
                max_theta_o_degrees,
                min_separation_degrees,
            ],
        };
        PyPlan::of(py, &self.recipe(), order, &machine, swap, seed)
    }

    /// Fits readings as a device does, by the same code, and looks for those that look wrong; as `trainer fit`.
    ///
    /// `readings` is an array (n, 3), a row for each of the recipe's samples in its order, NaN where nothing was read (if
    /// the recipe `takes_missing`). Or it has any number of rows (m, 3), in any order, samples repeated or missing, and
    /// `directions` (m, 2, 3) says where each was read: it belongs to the nearest sample, no further away in any angle
    /// than `tolerance_degrees` (0.5). Of repeated readings the mean counts.
    ///
    /// `quantity` is what the numbers are: "brdf" (the default; sr^-1, linear RGB), "brdf-cos-i" or "brdf-cos-o" (times a
    /// cosine), "reflectance-factor" (times pi). Or they are counts, beside those of a `white` tile: an array (n, 3) at
    /// the recipe's samples; or three numbers read once at `white_directions` (2, 3), and `footprint`, "light" or
    /// "sensor", whose spot is the larger. Then `dark` is counts without light (0), `white_reflectance` the tile's
    /// (0.99), `saturation` the count from which on a reading says too little. `saturated` marks such rows, booleans (n,).
    ///
    /// A recipe that takes missing readings leaves out those that are saturated or look wrong, unless `keep_all`.
    #[pyo3(signature = (
        readings, directions = None, *, quantity = None, name = "fitted", tolerance_degrees = None,
        saturated = None, white = None, white_directions = None, footprint = None, dark = None,
        white_reflectance = None, saturation = None, keep_all = false,
    ))]
    #[expect(clippy::too_many_arguments, reason = "they have names in Python")]
    fn fit<'py>(
        &self,
        py: Python<'py>,
        readings: &Bound<'py, PyAny>,
        directions: Option<&Bound<'py, PyAny>>,
        quantity: Option<&str>,
        name: &str,
        tolerance_degrees: Option<f64>,
        saturated: Option<&Bound<'py, PyAny>>,
        white: Option<&Bound<'py, PyAny>>,
        white_directions: Option<&Bound<'py, PyAny>>,
        footprint: Option<&str>,
        dark: Option<&Bound<'py, PyAny>>,
        white_reflectance: Option<&Bound<'py, PyAny>>,
        saturation: Option<f32>,
        keep_all: bool,
    ) -> PyResult<Bound<'py, PyFittedMaterial>> {
        let args = ReadingArgs {
            readings,
            directions,
            quantity,
            tolerance: tolerance_degrees,
            saturated,
            white,
            white_directions,
            footprint,
            dark,
            white_reflectance,
            saturation,
        };
        PyFittedMaterial::of(py, &self.file, self.basis.as_ref(), &args, name, keep_all)
    }

    fn __repr__(&self) -> PyResult<String> {
        let recipe = self.recipe();
        Ok(format!(
            "<glimpse_brdf.Recipe of the model {}, {} samples, {:08x}>",
            recipe.model().name(),
            recipe.samples(),
            recipe.checksum()
        ))
    }

    fn __len__(&self) -> usize {
        self.samples()
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        let other = other.cast::<Self>();
        other.is_ok_and(|other| other.get().file.bytes() == self.file.bytes())
    }

    fn __hash__(&self) -> u32 {
        self.recipe().checksum()
    }

    /// For copies and other processes.
    fn __reduce__<'py>(&self, py: Python<'py>) -> (Bound<'py, PyType>, Parts<'py>) {
        let class = py.get_type::<Self>();
        (class, (self.to_bytes(py), self.basis_bytes(py)))
    }
}
