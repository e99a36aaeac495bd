//! Materials: evaluation, construction from functions and arrays, and writing.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::Arc;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_evaluation::conversion::{OutputFormat, encode, file_name, output_paths};
use glimpse_evaluation::render::render_sphere;
use glimpse_fitting::measurement::angles_from_vectors;
use glimpse_materials::{
    self, Brdf, BrdfWithDerivative, Format, Material, MerlTable, PhysicalErrors, Source, digest,
    directional_albedo, table_nodes,
};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::arrays::{Array, Pairs, colors, directions_of, numbers};
use crate::choices::choose;
use crate::error::{Result, reject, warn};
use crate::files::write;
use crate::integer;
use crate::interruptible::run_detached;

/// Directions in one call of a Python function.
const CHUNK: usize = 1 << 16;
/// Directions that a thread evaluates at a time.
pub(crate) const BATCH: usize = 1024;

/// A material: a BRDF that can be evaluated at any directions.
///
/// material(incoming, outgoing) takes two arrays of shape (..., 3) that are broadcast: vectors from the surface to the
/// light, and to the sensor. The normal of the surface is z. material(directions) takes both in one array (..., 2, 3).
/// Vectors are normalized. The result is float32 of shape (..., 3): linear RGB, sr^-1, not times the cosine. It is 0 if
/// a direction is not above the horizon, and NaN if the material was not measured near the directions.
#[pyclass(subclass, frozen, name = "Material", module = "glimpse_brdf")]
pub(crate) struct PyMaterial {
    pub(crate) material: Arc<dyn Material>,
    pub(crate) origin: Origin,
}

/// The origin of a material, which determines its pickle.
pub(crate) enum Origin {
    /// A source with an absolute path, and the index of the material in it. None if the path is not UTF-8.
    Source(Option<(String, usize)>),
    /// A table of values, stored in the pickle.
    Table(Arc<MerlTable>),
    /// Readings: `PyFittedMaterial` has its own pickle.
    Readings,
}

impl PyMaterial {
    /// Reads the materials of a source, and warns of unmeasured directions and unread parts of files.
    fn read_all(py: Python<'_>, source: &Source) -> Result<Vec<Self>> {
        let read = || -> Result<_> { Ok((source.load_measured()?, source.paths()?)) };
        let (materials, paths) = run_detached(py, read)??;
        for material in &materials {
            warn_of_gaps(py, &**material)?;
        }
        let origin = |index: usize| match paths.get(index) {
            None => Some((source.0.clone(), index)),
            Some(path) => Some((std::path::absolute(path).ok()?.to_str()?.to_owned(), 0)),
        };
        let materials = materials.into_iter().enumerate();
        let materials = materials.map(|(index, material)| Self {
            material: material.into(),
            origin: Origin::Source(origin(index)),
        });
        Ok(materials.collect())
    }

    /// Returns the material.
    ///
    /// # Errors
    /// If its BRDF is unknown at some directions.
    pub(crate) fn complete(&self) -> Result<Arc<dyn Material>> {
        self.material.require_complete()?;
        Ok(self.material.clone())
    }

    /// Returns the BRDF at pairs of directions, and 0 if one of them is not above the horizon.
    fn evaluate(&self, pairs: &[[[f64; 3]; 2]]) -> Vec<[f32; 3]> {
        let mut values = vec![[0.0_f32; 3]; pairs.len()];
        let angles = |(index, [incoming, outgoing]): (usize, &[_; 2])| {
            Some((index, angles_from_vectors(*incoming, *outgoing)?))
        };
        let angles = pairs.iter().enumerate().filter_map(angles);
        let (above, angles): (Vec<usize>, Vec<Angles<f32>>) = angles.unzip();
        // Batches of a fit are faster and have the same values.
        let brdf = if matches!(self.origin, Origin::Readings) {
            let directions = angles.into_iter().map(HalfDifference::from_angles);
            self.material.values_at(&directions.collect::<Vec<_>>())
        } else {
            let at = |angles| self.material.at_angles(angles);
            angles.into_iter().map(at).collect()
        };
        for (index, brdf) in above.into_iter().zip(brdf) {
            values[index] = brdf;
        }
        values
    }
}

#[pymethods]
impl PyMaterial {
    /// Tabulates a function(incoming, outgoing) -> (n, 3). The function gets two arrays (n, 3) of unit vectors. It
    /// returns the BRDF, linear RGB, sr^-1, not times the cosine, with NaN for unknown values.
    ///
    /// Infinite and negative values are rejected, even tiny ones: set the noise of a dark measurement to 0.
    /// (`Recipe.fit` accepts readings down to -1 sr^-1, because noise around a dark reading has to average out.)
    ///
    /// Only this call evaluates the function, at `table_directions()`, up to 65,536 directions at a time. Afterwards
    /// the material interpolates the table; see `table_directions` for the limits of its resolution. The table takes
    /// 35 MB of memory.
    #[staticmethod]
    #[pyo3(signature = (function, name))]
    fn from_function(py: Python<'_>, function: &Bound<'_, PyAny>, name: String) -> Result<Self> {
        let nodes = run_detached(py, table_nodes)?;
        let mut brdf = Vec::with_capacity(nodes.len());
        for nodes in nodes.chunks(CHUNK) {
            let pairs: Vec<_> = nodes.iter().map(|angles| directions_of(*angles)).collect();
            let incoming = Array::rows(pairs.iter().map(|[incoming, _]| *incoming));
            let outgoing = Array::rows(pairs.iter().map(|[_, outgoing]| *outgoing));
            let values = function.call1((incoming, outgoing))?;
            brdf.extend(colors(&values, "the function's result", Some(nodes.len()))?);
            py.check_signals()?;
        }
        material_of_nodes(py, name, brdf)
    }

    /// Creates a material from its BRDF at `table_directions()`, an array (n, 3) in their order: linear RGB, sr^-1, not
    /// times the cosine, with NaN for unknown values. Infinite and negative values are rejected.
    #[staticmethod]
    #[pyo3(signature = (brdf, name))]
    fn from_table(py: Python<'_>, brdf: &Bound<'_, PyAny>, name: String) -> Result<Self> {
        material_of_nodes(py, name, colors(brdf, "brdf", None)?)
    }

    /// The name of the material. For a file, it is the stem of the file name.
    #[getter]
    fn name(&self) -> &str {
        self.material.name()
    }

    /// The BRDF, float32 of shape (..., 3): linear RGB, sr^-1, not times the cosine.
    #[pyo3(signature = (incoming, outgoing = None))]
    fn __call__(
        &self,
        py: Python<'_>,
        incoming: &Bound<'_, PyAny>,
        outgoing: Option<&Bound<'_, PyAny>>,
    ) -> Result<Array<f32>> {
        let Pairs { pairs, shape } = Pairs::from_arrays(incoming, outgoing, &[])?;
        let values = if pairs.len() > BATCH {
            let batches = pairs.par_chunks(BATCH);
            let values = batches.flat_map_iter(|pairs| self.evaluate(pairs));
            run_detached(py, || values.collect())?
        } else {
            py.detach(|| self.evaluate(&pairs))
        };
        Ok(Array::new(&shape, 3, values.into_flattened()))
    }

    /// Writes the material in another program's format: "merl" (NAME.binary), "rgl" (NAME.bsdf, for Mitsuba 3's
    /// `measured`), "rgl-spectral" (NAME_spec.bsdf, for pbrt-v4), "nbrdf" (NAME_fc1.npy and five more), "pab" (NAME_in00.txt and
    /// more, for Radiance), "openmaterial" (NAME_brdf.xompt) or "ssdd" (NAME.ssdd, for libbsdf). Or writes the parameters of a
    /// shading model that approximates it: "principled" (a dictionary for Mitsuba 3), "gltf" (NAME.gltf) or "openpbr" (NAME.mtlx).
    ///
    /// The ending of the file's name determines the format, unless `format` is given. For "nbrdf", a network is fitted
    /// to a material that is not a network, which takes some seconds, as does the fit of a shading model; `seed` is the seed
    /// of the network's fit (default 0).
    /// Raises FileExistsError if a file exists with other contents, unless `overwrite` is True.
    ///
    /// Tables (all but "nbrdf" and the shading models) are changed to be reciprocal and to have an albedo of at most 1, and
    /// a warning states the change, unless `as_fitted` is True.
    #[pyo3(signature = (path, format = None, *, seed = 0, overwrite = false, as_fitted = false))]
    pub(crate) fn save(
        &self,
        py: Python<'_>,
        path: PathBuf,
        format: Option<&str>,
        #[pyo3(from_py_with = integer::seed)] seed: u64,
        overwrite: bool,
        as_fitted: bool,
    ) -> Result<()> {
        let format = OutputFormat::choose(choose("format", format)?, &path)?;
        let material = self.complete()?;
        let paths = output_paths(format, &path)?;
        let name = match format {
            OutputFormat::Brdf(Format::Pab) => file_name(&path)?,
            _ => material.name(),
        };
        let files = run_detached(py, || encode(&*material, format, name, seed, as_fitted))??;
        let bytes = files.files.into_iter().map(|(_, bytes)| bytes);
        write(&paths.into_iter().zip(bytes).collect::<Vec<_>>(), overwrite)?;
        if files.is_changed {
            let before = run_detached(py, || PhysicalErrors::of(&*material))?;
            let text = format!(
                "{}: the table is changed to be reciprocal and to have an albedo of at most 1 (reciprocity error {:.3}, \
                 largest albedo {:.3} before); as_fitted=True keeps the BRDF",
                path.display(),
                before.reciprocity,
                before.albedo,
            );
            warn(py, text)?;
        }
        Ok(())
    }

    /// Returns the directional albedo: the share of light from a polar angle (0 to 90 degrees, any shape) that is reflected, in
    /// linear RGB; the result has the shape (..., 3).
    fn albedo(&self, py: Python<'_>, theta_i_degrees: &Bound<'_, PyAny>) -> Result<Array<f32>> {
        let theta_i = numbers(theta_i_degrees, "theta_i_degrees")?;
        let is_invalid = |theta: &&f64| !(0.0..=90.0).contains(*theta);
        if let Some(theta) = theta_i.iter().find(is_invalid) {
            return reject(format!("theta_i_degrees holds {theta}: give 0 to 90"));
        }
        let albedo = |theta: &f64| directional_albedo(&*self.material, *theta as f32);
        let albedos = run_detached(py, || theta_i.iter().flat_map(albedo).collect())?;
        Ok(Array::new(theta_i.shape(), 3, albedos))
    }

    /// Renders a sphere as `trainer render sphere` does: sRGB, uint8 of shape (size, size, 3).
    #[pyo3(signature = (size = 256))]
    fn render(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = integer::size)] size: usize,
    ) -> Result<Array<u8>> {
        let picture = run_detached(py, || render_sphere(&*self.material, size).tone_map())?;
        Ok(Array::new(&[size, size], 3, picture.pixels.concat()))
    }

    /// Returns itself: a material is immutable.
    fn __copy__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    /// Returns itself: a material is immutable.
    fn __deepcopy__<'py>(slf: Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf
    }

    /// Supports pickle. A material from a function or an array stores its table. A material from a file stores its
    /// source and is read again from the same path; unpickling fails if the file holds another material.
    fn __reduce__<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        let class = py.get_type::<Self>();
        let name = self.material.name();
        match &self.origin {
            Origin::Table(table) => {
                let nodes = Array::rows(run_detached(py, || table.to_nodes())?);
                Ok((class.getattr("from_table")?, (nodes, name)).into_bound_py_any(py)?)
            }
            Origin::Source(Some((source, index))) => {
                let digest = digest(&*self.material);
                let arguments = (source, index, digest);
                Ok((class.getattr("_from_source")?, arguments).into_bound_py_any(py)?)
            }
            Origin::Source(None) | Origin::Readings => {
                let message = format!(
                    "the material {name} cannot be pickled: the path of its file is not UTF-8; rename the file"
                );
                Err(PyTypeError::new_err(message).into())
            }
        }
    }

    /// Restores a material from its source, its index there, and its digest.
    #[staticmethod]
    fn _from_source(py: Python<'_>, source: String, index: usize, digest: u32) -> Result<Self> {
        let source: Source = source.parse()?;
        let materials = Self::read_all(py, &source)?;
        let material = materials.into_iter().nth(index);
        let is_same = |material: &Self| glimpse_materials::digest(&*material.material) == digest;
        match material.filter(is_same) {
            Some(material) => Ok(material),
            None => reject(format!(
                "{source} does not hold the pickled material: restore the file, or pickle the material again"
            )),
        }
    }

    fn __repr__(&self) -> String {
        format!("<glimpse_brdf.Material {:?}>", self.material.name())
    }
}

/// Reads the only material of a source: a file of MERL (*.binary), RGL (*.bsdf), NBRDF (NAME_fc1.npy), PAB-Opto, SSDD or OpenMATERIAL,
/// a material.json, or "procedural:1:SEED" for a procedural material.
#[pyfunction]
pub(crate) fn load_material(py: Python<'_>, source: &Bound<'_, PyAny>) -> Result<PyMaterial> {
    let source = parse_source(source)?;
    let mut materials = PyMaterial::read_all(py, &source)?;
    match (materials.pop(), materials.len()) {
        (Some(material), 0) => Ok(material),
        (_, others) => reject(format!(
            "{source} holds {} materials, not one: pass the path of one file, or use load_materials",
            others + 1
        )),
    }
}

/// Reads all materials of a source, sorted by name: a folder of such files, or "procedural:COUNT:SEED".
/// `load_material` lists the formats.
#[pyfunction]
pub(crate) fn load_materials(py: Python<'_>, source: &Bound<'_, PyAny>) -> Result<Vec<PyMaterial>> {
    let source = parse_source(source)?;
    PyMaterial::read_all(py, &source)
}

/// Parses a source from a string or a path.
pub(crate) fn parse_source(argument: &Bound<'_, PyAny>) -> Result<Source> {
    let path: OsString = argument.extract::<PathBuf>()?.into_os_string();
    match path.into_string() {
        Ok(text) => Ok(text.parse()?),
        Err(path) => reject(format!("{} is not UTF-8: rename it", path.display())),
    }
}

/// Returns the directions at which `Material.from_function` and `Material.from_table` take a BRDF: unit vectors,
/// incoming and outgoing, float64 of shape (n, 2, 3).
///
/// They are the nodes of MERL's table that are above the horizon: theta_h at pi/2 (k/90)^2, theta_d and phi_d at whole
/// degrees, phi_d over half a turn. A table therefore represents only isotropic, reciprocal materials. It smooths
/// highlights narrower than a tenth of a degree, and details within a degree of theta_d or phi_d. Within two degrees of
/// the horizon, it uses the nearest nodes.
#[pyfunction]
pub(crate) fn table_directions(py: Python<'_>) -> Result<Array<f64>> {
    run_detached(py, || Array::directions(table_nodes()))
}

/// Returns a material with the given BRDF at the nodes of a table.
fn material_of_nodes(py: Python<'_>, name: String, brdf: Vec<[f32; 3]>) -> Result<PyMaterial> {
    let table = run_detached(py, || MerlTable::from_nodes(name, &brdf))??;
    warn_of_gaps(py, &table)?;
    let table = Arc::new(table);
    Ok(PyMaterial {
        material: table.clone(),
        origin: Origin::Table(table),
    })
}

/// Warns of unmeasured directions, and of parts of a file that are not read.
pub(crate) fn warn_of_gaps(py: Python<'_>, material: &dyn Material) -> Result<()> {
    let mut remarks = material.remarks().into_iter();
    remarks.try_for_each(|remark| warn(py, format!("{}: {remark}", material.name())))
}

/// A material that is shared with Python, for trainings and evaluations: they read neither network nor spectrum, and its BRDF
/// is known everywhere.
pub(crate) struct Shared(pub(crate) Arc<dyn Material>);

impl Brdf for Shared {
    fn at_angles(&self, angles: Angles<f32>) -> [f32; 3] {
        self.0.at_angles(angles)
    }

    fn values_at(&self, at: &[HalfDifference<f32>]) -> Vec<[f32; 3]> {
        self.0.values_at(at)
    }
}

impl Material for Shared {
    fn name(&self) -> &str {
        self.0.name()
    }
    fn with_derivatives(&self, angles: &[Angles<f32>]) -> Vec<BrdfWithDerivative> {
        self.0.with_derivatives(angles)
    }
    fn is_reciprocal(&self) -> bool {
        self.0.is_reciprocal()
    }
}
