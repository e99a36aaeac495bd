//! Recipes: reading, properties, writing.

use std::path::PathBuf;
use std::sync::Arc;

use glimpse_core::numeric::Rows;
use glimpse_core::recipe::Recipe;
use glimpse_fitting::bundled;
use glimpse_fitting::linear::{Posterior, Proposal};
use glimpse_fitting::measurement::{LossScale, NamedRecipe, Readings};
use glimpse_fitting::recipe::RecipeFile;
use glimpse_fitting::route::{PlanArgs, SpeedArgs, arms_in_degrees};
use glimpse_materials::basis::BasisTable;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::arrays::{Array, Pairs, result, to_python};
use crate::choices::choose;
use crate::error::{Result, reject};
use crate::files::write;
use crate::fit::PyFittedMaterial;
use crate::integer;
use crate::interruptible::run_detached;
use crate::machine::PyMachine;
use crate::plan;
use crate::readings::ReadingArgs;

/// A recipe: the directions to measure, and the method that fits the readings. `train` returns a recipe.
///
/// Recipe(data, basis=None) takes the bytes of a recipe's file. The model linear also needs the bytes of its basis.
/// Recipes are equal if their bytes are. They can be copied and pickled. len() is the number of samples.
#[pyclass(frozen, name = "Recipe", module = "glimpse_brdf")]
pub(crate) struct PyRecipe(pub(crate) NamedRecipe);

impl PyRecipe {
    /// The recipe, which borrows its bytes.
    pub(crate) fn recipe(&self) -> Recipe<'_> {
        self.0.file.recipe()
    }

    /// Combines a recipe with the bytes of its basis, if it needs one.
    pub(crate) fn new_with_basis(file: RecipeFile, basis: Option<&[u8]>) -> Result<Self> {
        let basis = match (file.recipe().basis_checksum(), basis) {
            (None, None) => None,
            (Some(checksum), Some(bytes)) => match BasisTable::parse_for(bytes, checksum) {
                Ok(basis) => Some(Arc::new(basis)),
                Err(error) => return reject(format!("basis is not this recipe's basis: {error}")),
            },
            (None, Some(_)) => {
                return reject(
                    "basis has no effect, because the recipe does not need one: omit it",
                );
            }
            (Some(_), None) => {
                return reject(
                    "basis is missing: pass the bytes of the file NAME.basis next to the recipe, or use Recipe.load",
                );
            }
        };
        let name = "recipe".to_owned();
        Ok(Self(NamedRecipe::new(name, Arc::new(file), basis)))
    }
}

#[pymethods]
impl PyRecipe {
    #[new]
    #[pyo3(signature = (data, basis = None))]
    fn new(data: &[u8], basis: Option<&[u8]>) -> Result<Self> {
        Self::new_with_basis(RecipeFile::new(data.to_vec())?, basis)
    }

    /// Reads a recipe's file. For the model linear, also reads the basis next to it. `path` may also be the name of a bundled
    /// recipe: a model and the number of samples, such as "linear-n8", or "linear-any" for readings at any directions.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> Result<Self> {
        Ok(Self(run_detached(py, || NamedRecipe::read(&path))??))
    }

    /// Writes the recipe. For the model linear, also writes its basis next to it, NAME.basis. Raises FileExistsError if
    /// a file exists with other contents, unless `overwrite` is True.
    #[pyo3(signature = (path, *, overwrite = false))]
    fn save(&self, py: Python<'_>, path: PathBuf, overwrite: bool) -> Result<()> {
        let mut files = Vec::new();
        if let Some(basis) = &self.0.basis {
            // The basis comes first: a recipe without its basis is useless.
            files.push((BasisTable::path_for(&path), basis.file().to_vec()));
        }
        files.push((path, self.0.file.bytes().to_vec()));
        run_detached(py, || write(&files, overwrite))?
    }

    /// Returns the recipe's bytes, as a device receives them.
    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, self.0.file.bytes())
    }

    /// Returns the bytes of the basis, or None if the model is not linear.
    fn basis_bytes<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyBytes>> {
        let basis = self.0.basis.as_ref();
        basis.map(|basis| PyBytes::new(py, basis.file()))
    }

    /// The fitted model: "phong", "cook-torrance", "linear" or "neural".
    #[getter]
    fn model(&self) -> &'static str {
        self.recipe().model().name()
    }

    /// The number of samples n.
    #[getter]
    fn samples(&self) -> usize {
        self.recipe().samples()
    }

    /// The CRC-32 of the recipe, eight hexadecimal digits. Devices report it as the recipe's name.
    #[getter]
    fn checksum(&self) -> String {
        format!("{:08x}", self.recipe().checksum())
    }

    /// True if the recipe tolerates missing readings. Otherwise it needs all of them.
    #[getter]
    fn tolerates_missing(&self) -> bool {
        self.recipe().tolerates_missing()
    }

    /// The directions of the samples: unit vectors, incoming and outgoing, float64 of shape (n, 2, 3).
    #[getter]
    fn directions(&self) -> Array<f64> {
        Array::directions(self.recipe().pattern())
    }

    /// The directions as theta_i, phi_i, theta_o, phi_o in degrees, float64 of shape (n, 4).
    #[getter]
    fn angles_degrees(&self) -> Array<f64> {
        let recipe = self.recipe();
        Array::rows(
            recipe
                .pattern()
                .map(|angles| arms_in_degrees(angles).to_array()),
        )
    }

    /// The directions as Rusinkiewicz angles theta_h, theta_d, phi_d in radians, float64 of shape (n, 3).
    #[getter]
    fn half_difference_radians(&self) -> Array<f64> {
        let recipe = self.recipe();
        let pattern = recipe.pattern();
        Array::rows(pattern.map(|angles| angles.to_array().map(f64::from)))
    }

    /// The expected loss of an unseen material (see `loss`), or None if the recipe does not state it.
    #[getter]
    fn expected_loss(&self) -> Option<f32> {
        self.recipe().expected_loss()
    }

    /// The metadata as `trainer inspect --json` prints them: a dict of expected_loss (the loss, its standard error, and the
    /// materials that it was measured on), training (trainer, data, materials and options, by the names of the parameters
    /// of `train`) and materials (names and digests of their BRDFs).
    #[getter]
    fn metadata<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        to_python(py, serde_json::to_value(self.0.file.metadata())?)
    }

    /// Plans a scan as `trainer plan` does: the order of the samples, and the positions and times of a machine's arms.
    ///
    /// `order` is "travel" (the least time) or "progressive" (the recipe's order, in which a scan may end early). It is
    /// progressive by default for recipes trained with `scan_seconds`, and travel for others. `machine` is a `Machine`.
    ///
    /// Only the difference of the azimuths is kept, because rotating both arms together does not change the readings of an
    /// isotropic sample. Without `full_turns`, azimuths stay within -180 to 180 degrees. The search is random and depends
    /// on `seed` (default 0).
    ///
    /// Raises GlimpseError if samples are out of reach. The message lists them.
    #[pyo3(signature = (order = None, machine = None, *, full_turns = true, seed = 0))]
    fn plan<'py>(
        &self,
        py: Python<'py>,
        order: Option<&str>,
        machine: Option<&Bound<'_, PyMachine>>,
        full_turns: bool,
        #[pyo3(from_py_with = integer::seed)] seed: u64,
    ) -> Result<Bound<'py, PyAny>> {
        let request = PlanArgs {
            order: choose("order", order)?,
            machine: PyMachine::args(machine),
            no_full_turns: !full_turns,
        };
        let (recipe, stated) = (self.recipe(), self.0.file.metadata().machine());
        let (_, route) = run_detached(py, || request.plan(&recipe, &stated, seed))??;
        plan::plan(py, &route)
    }

    /// Fits readings with the code that a device runs, and finds outliers, as `trainer fit` does.
    ///
    /// `readings` is an array (n, 3): one row for each sample in the recipe's order, with NaN for a missing reading (if
    /// the recipe `tolerates_missing`). With `directions` (m, 2, 3), it is an array (m, 3) of readings in any order;
    /// samples may be repeated or missing. Each reading is assigned to the nearest sample, at most 0.5 degrees away in
    /// every angle. If a reading is further away, all are fitted with the bundled recipe of the model for readings at any
    /// directions, and the `report` says so. With a recipe that was trained with `samples="any"`,
    /// directions are arbitrary. Repeated readings are averaged. `saturated` has one boolean for each reading, True if the
    /// sensor was saturated. At any directions, `noise` is the standard deviation of the readings, relative to them: one
    /// number, or one for each reading. By default it is estimated from repeated readings, or else 0.02.
    ///
    /// `quantity` is "brdf" (default; sr^-1, linear RGB), "brdf-cos-i" or "brdf-cos-o" (the BRDF times the cosine of
    /// theta_i or theta_o), or "reflectance-factor" (the BRDF times pi), relative to a tile of `white_reflectance` (default
    /// 1), also as "reflectance-percent".
    ///
    /// With `wavelengths` of b bands in nm, `readings` is an array (n, b), and the fit has a `spectrum`. `readings` may also
    /// be the path of a CSV file, as of `trainer fit`, with lists `convention` of its angles and `ignore` of columns on which
    /// readings do not depend, and with `unit` and `azimuth_unit`. A warning asks if another reading explains it better.
    ///
    /// `instrument` is a list with the name of each reading's instrument, such as "gloss-60" or "sci", or None. Readings then are
    /// percent unless `quantity` is given, and those of gloss are gloss units in all channels. Instruments other than
    /// "multi-angle" have directions of their own, and NaN in `directions`.
    ///
    /// With `white`, the readings are counts of the sensor, and `white` holds the counts of a white reference. If they
    /// were read where the readings were, `white` is an array (n, 3). If they were read once, `white` is three numbers,
    /// `white_directions` (2, 3) is the pair of directions, and `footprint` is the larger spot, "light" or "sensor".
    /// `dark` is the number of counts without light (default 0). `white_reflectance` is the reflectance of the
    /// reference (default 0.99). `saturation` is the count at which the sensor saturates.
    ///
    /// A recipe that tolerates missing readings excludes saturated readings from the fit. It also excludes the worst
    /// outlier, if the other readings agree better without it, unless `keep_all` is True.
    #[pyo3(
        signature = (readings, directions = None, *, name = "fitted", keep_all = false, **options),
        text_signature = "($self, readings, directions=None, *, quantity=None, name='fitted', saturated=None, noise=None, \
            wavelengths=None, instrument=None, white=None, white_directions=None, footprint=None, dark=None, \
            white_reflectance=None, saturation=None, convention=None, unit=None, azimuth_unit=None, ignore=None, keep_all=False)"
    )]
    fn fit<'py>(
        slf: &Bound<'py, Self>,
        readings: &Bound<'py, PyAny>,
        directions: Option<&Bound<'py, PyAny>>,
        name: &str,
        keep_all: bool,
        options: Option<Bound<'py, PyDict>>,
    ) -> Result<Bound<'py, PyFittedMaterial>> {
        let args = ReadingArgs(options.unwrap_or_else(|| PyDict::new(slf.py())));
        let readings = args.readings(&slf.get().0, readings, directions)?;
        let fitted = PyFittedMaterial::new(slf.as_any(), readings, name, keep_all)?;
        PyFittedMaterial::require_plausible(fitted)
    }

    /// Proposes the directions to read next, as `trainer next` does: those that reduce the expected loss most.
    ///
    /// `directions` (m, 2, 3) are the pairs that were read so far, and `readings` (m, 3) their BRDFs, sr^-1, linear RGB.
    /// Without both, the first directions are proposed. `count` is the number of proposals. A recipe with a pattern
    /// begins with its own directions. If `machine`, a `Machine`, has a speed or a time to settle, a direction is chosen by
    /// the reduction per second, and the arms are at the last reading. Implausible readings raise `ImplausibleError`, as
    /// in `fit`, unless `accept_implausible` is True.
    #[pyo3(signature = (
        directions = None, readings = None, count = 1, machine = None, *, accept_implausible = false,
    ))]
    fn next<'py>(
        slf: &Bound<'py, Self>,
        directions: Option<&Bound<'py, PyAny>>,
        readings: Option<&Bound<'py, PyAny>>,
        #[pyo3(from_py_with = integer::count)] count: usize,
        machine: Option<&Bound<'_, PyMachine>>,
        accept_implausible: bool,
    ) -> Result<Bound<'py, PyAny>> {
        let (py, given, machine) = (slf.py(), &slf.get().0, PyMachine::args(machine));
        given.machine(&machine)?;
        let any = given.continuing();
        let unread = || Posterior::new(&any.prior, &[]);
        let (posterior, measured) = match (directions, readings) {
            (None, None) => (run_detached(py, unread)?, Vec::new()),
            (Some(directions), Some(readings)) => {
                let args = ReadingArgs(PyDict::new(py));
                let readings = args.readings(&any, readings, Some(directions))?;
                let measured = readings.pattern();
                // Also with readings that are unlike the others, which reduce the loss most.
                let mut fitted = PyFittedMaterial::new(slf.as_any(), readings, "readings", true)?;
                if !accept_implausible {
                    fitted = PyFittedMaterial::require_plausible(fitted)?;
                }
                (Some(fitted.get().fit.selection.posterior.clone()), measured)
            }
            _ => return reject("directions and readings belong together: give both, or neither"),
        };
        let Some(posterior) = posterior else {
            return reject("the recipe's prior is not finite");
        };
        let next = || given.next(&machine, (&posterior, &measured), count);
        let proposals = run_detached(py, next)??;
        if proposals.is_empty() {
            return reject("no direction is within the limits: widen them");
        }
        let now = || (posterior.expected_loss().loss, LossScale::of(&posterior));
        let (loss, scale) = run_detached(py, now)?;
        let list = |number: fn(&Proposal) -> f64| Array::list(proposals.iter().map(number));
        let has_seconds = machine.speeds != SpeedArgs::default();
        let arguments = (
            Array::directions(proposals.iter().map(|proposal| proposal.angles)),
            list(|proposal| proposal.expected_loss.into()),
            list(|proposal| proposal.bound.into()),
            loss,
            to_python(py, scale)?,
            has_seconds.then(|| list(|proposal| proposal.seconds)),
        );
        result(py, "Proposals", arguments)
    }

    /// Returns the recipe of readings at directions, an array (n, 2, 3), that a recipe without a pattern fits.
    fn at(&self, directions: &Bound<'_, PyAny>) -> Result<Self> {
        let angles = Pairs::from_arrays(directions, None, &[])?.angles()?;
        Ok(Self(run_detached(directions.py(), || self.0.at(&angles))??))
    }

    /// Returns [mean, components]: the mapped mean, float32 (n,), and the components, float32 (n, k), at directions (n, 2, 3).
    ///
    /// With coefficients z of a channel, the BRDF is 0.001 (exp(mean + components @ z) - 1) / (cos theta_i cos theta_o), and
    /// not below 0. A fit of the model linear has z as its `parameters`: k of red, k of green, k of blue.
    fn components(&self, directions: &Bound<'_, PyAny>) -> Result<[Array<f32>; 2]> {
        let chosen = self.at(directions)?;
        let recipe = chosen.recipe();
        let Some(coefficients) = recipe.estimator().coefficients() else {
            return reject("the recipe has no components: give one of readings at any directions");
        };
        let (count, rows) = (recipe.samples(), coefficients.rows());
        let components = coefficients.components();
        let mut entries = vec![0.0; count * components];
        for (index, row) in entries.chunks_mut(components).enumerate() {
            rows.add(index, 1.0, row);
        }
        let mean = Array::list(coefficients.ridge.center.iter());
        Ok([mean, Array::new(&[count], components, entries)])
    }

    /// Returns the bundled recipe of a checksum, for pickles.
    #[staticmethod]
    fn _bundled(checksum: &str) -> Option<Self> {
        let checksum = u32::from_str_radix(checksum, 16).ok()?;
        let bundled = bundled::find_by_checksum(checksum)?;
        Some(Self(NamedRecipe::bundled(bundled)))
    }

    /// Repeats a fit of readings, for pickles.
    fn _fit_rows<'py>(
        slf: &Bound<'py, Self>,
        name: &str,
        data: &[u8],
        keep_all: bool,
    ) -> Result<Bound<'py, PyFittedMaterial>> {
        let (rows, quantity) = postcard::from_bytes(data)
            .or_else(|error| reject(format!("the pickle is damaged: {error}")))?;
        let given = &slf.get().0;
        let readings = run_detached(slf.py(), || Readings::new(given, rows, quantity))??;
        PyFittedMaterial::new(slf.as_any(), readings, name, keep_all)
    }

    fn __repr__(&self) -> String {
        let recipe = self.recipe();
        format!(
            "<glimpse_brdf.Recipe of the model {}, {} samples, {:08x}>",
            recipe.model().name(),
            recipe.samples(),
            recipe.checksum()
        )
    }

    fn __len__(&self) -> usize {
        self.samples()
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        let other = other.cast::<Self>();
        other.is_ok_and(|other| other.get().0.file.bytes() == self.0.file.bytes())
    }

    fn __hash__(&self) -> u32 {
        self.recipe().checksum()
    }

    /// Returns itself: a recipe is immutable.
    fn __copy__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    /// Returns itself: a recipe is immutable.
    fn __deepcopy__<'py>(slf: Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf
    }

    /// Supports pickle, which stores the name and checksum of a bundled recipe, and else the bytes, with a compressed basis.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Result<Bound<'py, PyAny>> {
        let (module, given) = (slf.py().import("glimpse_brdf._pickles")?, &slf.get().0);
        let basis = given.basis.as_ref().map(|basis| basis.file());
        let bundled = bundled::find_by_checksum(given.file.recipe().checksum());
        let bundled = bundled.filter(|bundled| bundled.basis() == basis);
        Ok(module.call_method1("reduce", (slf, bundled.map(|bundled| bundled.name)))?)
    }
}

/// Lists the bundled recipes, which `Recipe.load` takes by name, as `trainer recipes list --json` does: a list of dicts, which
/// `pandas.DataFrame` takes. `seconds` is the time of a scan; `loss` has the mean losses on unseen materials.
#[pyfunction]
pub(crate) fn bundled_recipes(py: Python<'_>) -> Result<Bound<'_, PyAny>> {
    to_python(py, bundled::entries()?)
}
