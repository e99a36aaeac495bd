//! Materials: looked up, made of functions and arrays, written.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::Arc;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::NeuralParameters;
use glimpse_materials::{
    self, Format, Material, MerlTable, Source, SourceError, digest, table_nodes,
};
use glimpse_trainer::conversion::{files_of, format_of_ending, name_of, paths};
use glimpse_trainer::measurement::angles_of_pair;
use numpy::PyArrayDyn;
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyType;
use rayon::prelude::*;

use crate::arrays::{Pairs, array, rows};
use crate::choices::{FORMATS, choose};
use crate::error::{raised, refused};
use crate::files::write;
use crate::waiting::detached;

/// How many directions are asked of a function at a time.
const CHUNK: usize = 1 << 16;
/// How many a thread looks up at a time.
const BATCH: usize = 1024;

/// A material: a BRDF that can be looked up anywhere.
///
/// material(incoming, outgoing) takes vectors from the surface to light and sensor, z along the normal, arrays of
/// shape (..., 3) that are broadcast; material(directions) takes both in one array (..., 2, 3). They are brought to
/// length 1. The answer is float32 of shape (..., 3): linear RGB, sr^-1, not times the cosine; 0 where a direction is not
/// above the horizon.
#[pyclass(subclass, frozen, name = "Material", module = "glimpse_brdf")]
pub(crate) struct PyMaterial {
    pub(crate) material: Arc<dyn Material>,
    /// True if many places at once are looked up faster, and come to the same.
    pub(crate) in_batches: bool,
    pub(crate) origin: Origin,
}

/// The origin of a material, by which it is pickled.
pub(crate) enum Origin {
    /// The source that it was read from, with a path that does not depend on the working directory, and its place
    /// there. None if the path is not UTF-8.
    Source(Option<(String, usize)>),
    /// Values of its own.
    Table(Arc<MerlTable>),
    /// Readings: `PyFittedMaterial` pickles itself.
    Readings,
}

impl PyMaterial {
    /// The materials of a source.
    fn read_all(source: &Source) -> Result<Vec<Self>, SourceError> {
        let materials = source.load()?;
        let paths = source.paths()?;
        let origin = |index: usize| match paths.get(index) {
            None => Some((source.0.clone(), index)),
            Some(path) => Some((std::path::absolute(path).ok()?.to_str()?.to_owned(), 0)),
        };
        let all = materials.into_iter().enumerate();
        let read = all.map(|(index, material)| Self {
            material: material.into(),
            in_batches: false,
            origin: Origin::Source(origin(index)),
        });
        Ok(read.collect())
    }

    /// The BRDF at pairs of directions; 0 where one is not above the horizon.
    fn look_up(&self, pairs: &[[[f64; 3]; 2]]) -> Vec<f32> {
        let mut found = vec![[0.0_f32; 3]; pairs.len()];
        let chunks = pairs.par_chunks(BATCH).zip(found.par_chunks_mut(BATCH));
        chunks.for_each(|(pairs, found)| {
            let angles = pairs
                .iter()
                .map(|[incoming, outgoing]| angles_of_pair(*incoming, *outgoing));
            let above: Vec<(usize, Angles<f32>)> = angles
                .enumerate()
                .filter_map(|(place, angles)| Some((place, angles?)))
                .collect();
            if !self.in_batches {
                for (place, angles) in above {
                    found[place] = self.material.brdf(angles);
                }
                return;
            }
            let at: Vec<_> = above
                .iter()
                .map(|(_, angles)| HalfDifference::from_angles(*angles))
                .collect();
            let mut brdf = vec![[0.0; 3]; at.len()];
            self.material.brdf_batch(&at, &mut brdf);
            for ((place, _), brdf) in above.into_iter().zip(brdf) {
                found[place] = brdf;
            }
        });
        found.into_flattened()
    }
}

#[pymethods]
impl PyMaterial {
    /// A material of a function(incoming, outgoing) -> (n, 3), which gets unit vectors (n, 3) each and gives the BRDF,
    /// linear RGB, sr^-1, not times the cosine; NaN where it is not known.
    ///
    /// Infinite and negative values are refused, however small: set the noise of a dark measurement to 0. (`Recipe.fit`
    /// takes readings down to -1 sr^-1, since noise around a dark reading has to average out.)
    ///
    /// It is asked once, here, at `table_directions()`, 65,536 at a time, and its values are interpolated from then on;
    /// see there for what that loses. The table takes 35 MB of memory.
    #[classmethod]
    #[pyo3(signature = (function, name))]
    fn from_function(
        _class: &Bound<'_, PyType>,
        py: Python<'_>,
        function: &Bound<'_, PyAny>,
        name: String,
    ) -> PyResult<Self> {
        let nodes = detached(py, table_nodes)?;
        let mut brdf = Vec::with_capacity(nodes.len());
        for nodes in nodes.chunks(CHUNK) {
            let pairs: Vec<[[f64; 3]; 2]> = nodes.iter().map(directions_of).collect();
            let arm = |arm: usize| {
                let flat = pairs.iter().flat_map(|pair| pair[arm]).collect();
                array::<f64>(py, &[pairs.len(), 3], flat)
            };
            let found = rows(
                &function.call1((arm(0)?, arm(1)?))?,
                "what the function returns",
            )?;
            if found.len() != nodes.len() {
                return refused(format!(
                    "what the function returns should have the shape ({}, 3), not ({}, 3)",
                    nodes.len(),
                    found.len()
                ));
            }
            brdf.extend(found.into_iter().map(narrow));
            py.check_signals()?;
        }
        tabulated(py, name, brdf)
    }

    /// A material of its BRDF at `table_directions()`, an array of as many rows (n, 3), in their order: linear RGB, sr^-1,
    /// not times the cosine; NaN where it is not known. Infinite and negative values are refused.
    #[classmethod]
    #[pyo3(signature = (brdf, name))]
    fn from_table(
        _class: &Bound<'_, PyType>,
        py: Python<'_>,
        brdf: &Bound<'_, PyAny>,
        name: String,
    ) -> PyResult<Self> {
        let brdf = rows(brdf, "brdf")?.into_iter().map(narrow).collect();
        tabulated(py, name, brdf)
    }

    /// Its name: of a file its stem.
    #[getter]
    fn name(&self) -> &str {
        self.material.name()
    }

    /// The BRDF, float32 of shape (..., 3): linear RGB, sr^-1, not times the cosine.
    #[pyo3(signature = (incoming, outgoing = None))]
    fn __call__<'py>(
        &self,
        py: Python<'py>,
        incoming: &Bound<'py, PyAny>,
        outgoing: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let Pairs { pairs, mut shape } = Pairs::of(incoming, outgoing)?;
        let found = match pairs.len() > BATCH {
            true => detached(py, || self.look_up(&pairs))?,
            false => py.detach(|| self.look_up(&pairs)),
        };
        shape.push(3);
        array(py, &shape, found)
    }

    /// Writes it in another program's format: "merl" (NAME.binary), "rgl" (NAME.bsdf, which Mitsuba 3 renders as its
    /// `measured`), "nbrdf" (NAME_fc1.npy and five more; to what is no network one is fitted, by `seed`, in some seconds) or
    /// "pab" (NAME_in00.txt and more, for Radiance). The ending tells which, unless `format` does. Files that are there
    /// and not the same stay, and FileExistsError is raised, unless `overwrite`.
    #[pyo3(signature = (path, format = None, *, seed = 0, overwrite = false))]
    pub(crate) fn save(
        &self,
        py: Python<'_>,
        path: PathBuf,
        format: Option<&str>,
        seed: u64,
        overwrite: bool,
    ) -> PyResult<()> {
        let format = format
            .map(|word| choose("format", word, &FORMATS))
            .transpose()?;
        let format = match (format, format_of_ending(&path)) {
            (Some(format), None) => format,
            (None, Some(format)) => format,
            (Some(format), Some(meant)) if format == meant => format,
            (Some(_), Some(meant)) => {
                return refused(format!(
                    "{} ends as the format {} does, and another one is asked for: give a path of that one's \
                     ending, or leave out the format",
                    path.display(),
                    meant.name()
                ));
            }
            (None, None) => {
                return refused(format!(
                    "{} does not say in which format to write: end it with .binary, .bsdf or _fc1.npy (a fit \
                     also with .json), or give the format",
                    path.display()
                ));
            }
        };
        let places = paths(format, &path).map_err(raised)?;
        let name = match format {
            Format::Pab => name_of(&path).map_err(raised)?,
            _ => self.material.name(),
        };
        let files =
            detached(py, || files_of(&*self.material, format, name, seed))?.map_err(raised)?;
        let bytes = files.into_iter().map(|(_, bytes)| bytes);
        write(
            &places.into_iter().zip(bytes).collect::<Vec<_>>(),
            overwrite,
        )
    }

    /// Itself: a material does not change.
    fn __copy__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    /// Itself: a material does not change.
    fn __deepcopy__<'py>(slf: Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf
    }

    /// For other processes. A material of a function or an array takes its table along; one that was read takes its
    /// source along and is read again, from the same path, and refused if it is another one there.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let class = py.get_type::<Self>();
        let name = self.material.name();
        match &self.origin {
            Origin::Table(table) => {
                let nodes = detached(py, || table.to_nodes())?;
                let nodes = array(py, &[nodes.len(), 3], nodes.into_flattened())?;
                (class.getattr("from_table")?, (nodes, name)).into_bound_py_any(py)
            }
            Origin::Source(Some((source, index))) => {
                let digest = digest(&*self.material);
                let arguments = (source, index, digest);
                (class.getattr("_from_source")?, arguments).into_bound_py_any(py)
            }
            Origin::Source(None) | Origin::Readings => Err(PyTypeError::new_err(format!(
                "the material {name} cannot be pickled: the path of its file is not UTF-8; rename it"
            ))),
        }
    }

    /// A material that was pickled by its source, its place there, and its digest.
    #[classmethod]
    fn _from_source(
        _class: &Bound<'_, PyType>,
        py: Python<'_>,
        source: String,
        index: usize,
        digest: u32,
    ) -> PyResult<Self> {
        let source: Source = source.parse().map_err(raised)?;
        let read = detached(py, || Self::read_all(&source))?.map_err(raised)?;
        let found = read.into_iter().nth(index);
        let same = |found: &Self| glimpse_materials::digest(&*found.material) == digest;
        match found.filter(same) {
            Some(found) => Ok(found),
            None => refused(format!(
                "{source} does not hold the material that was pickled: put it back, or pickle it again"
            )),
        }
    }

    fn __repr__(&self) -> String {
        format!("<glimpse_brdf.Material {:?}>", self.material.name())
    }
}

/// Reads the one material of a source: a file of MERL's (*.binary), RGL's (*_rgb.bsdf), NBRDF's (NAME_fc1.npy), PAB-Opto's,
/// or a material.json; or "procedural:1:SEED", a built-in one.
#[pyfunction]
pub(crate) fn load_material(py: Python<'_>, source: &Bound<'_, PyAny>) -> PyResult<PyMaterial> {
    let source = source_of(source)?;
    let mut materials = detached(py, || PyMaterial::read_all(&source))?.map_err(raised)?;
    match (materials.pop(), materials.len()) {
        (Some(one), 0) => Ok(one),
        (_, more) => refused(format!(
            "{source} holds {} materials, and one is asked for: name its file, or use load_materials",
            more + 1
        )),
    }
}

/// Reads all materials of a source, sorted by name: a folder of such files, or "procedural:COUNT:SEED".
#[pyfunction]
pub(crate) fn load_materials(
    py: Python<'_>,
    source: &Bound<'_, PyAny>,
) -> PyResult<Vec<PyMaterial>> {
    let source = source_of(source)?;
    detached(py, || PyMaterial::read_all(&source))?.map_err(raised)
}

/// A source by its text or its path.
pub(crate) fn source_of(given: &Bound<'_, PyAny>) -> PyResult<Source> {
    let path: OsString = given.extract::<PathBuf>()?.into_os_string();
    match path.into_string() {
        Ok(text) => text.parse().map_err(raised),
        Err(path) => refused(format!("{} is no UTF-8: rename it", path.display())),
    }
}

/// Where `Material.from_function` and `Material.from_table` take a BRDF: unit vectors, incoming and outgoing, float64 of
/// shape (n, 2, 3).
///
/// They are the nodes of MERL's tables that are above the horizon: theta_h at pi/2 (k/90)^2, theta_d and phi_d at whole
/// degrees, phi_d over half a turn. So a table knows isotropic, reciprocal materials only; highlights narrower than a
/// tenth of a degree, and what changes within a degree of theta_d or phi_d, are smoothed;
/// and within two degrees of the horizon the nearest nodes stand for what lies between them and it.
#[pyfunction]
pub(crate) fn table_directions(py: Python<'_>) -> PyResult<Bound<'_, PyArrayDyn<f64>>> {
    let (count, flat) = detached(py, || {
        let nodes = table_nodes();
        let flat: Vec<f64> = nodes
            .iter()
            .flat_map(|angles| directions_of(angles).concat())
            .collect();
        (nodes.len(), flat)
    })?;
    array(py, &[count, 2, 3], flat)
}

/// Unit vectors of polar angles theta (from the normal) and azimuths phi, degrees, numbers or arrays that are broadcast:
/// incoming by theta_i, phi_i and outgoing by theta_o, phi_o, float64 of shape (..., 2, 3).
#[pyfunction]
pub(crate) fn directions_from_degrees<'py>(
    theta_i: &Bound<'py, PyAny>,
    phi_i: &Bound<'py, PyAny>,
    theta_o: &Bound<'py, PyAny>,
    phi_o: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let numpy = theta_i.py().import("numpy")?;
    let radians = |degrees: &Bound<'py, PyAny>| numpy.call_method1("radians", (degrees,));
    let arm = |theta: &Bound<'py, PyAny>, phi: &Bound<'py, PyAny>| {
        let (theta, phi) = (radians(theta)?, radians(phi)?);
        let of = |function: &str, angle: &Bound<'py, PyAny>| numpy.call_method1(function, (angle,));
        let sin = of("sin", &theta)?;
        let parts = (
            sin.mul(of("cos", &phi)?)?,
            sin.mul(of("sin", &phi)?)?,
            of("cos", &theta)?,
        );
        Ok::<_, PyErr>(parts)
    };
    let ((a, b, c), (d, e, f)) = (arm(theta_i, phi_i)?, arm(theta_o, phi_o)?);
    let all = numpy.call_method1("broadcast_arrays", (a, b, c, d, e, f))?;
    let stacked = numpy.call_method1("stack", (all, -1))?;
    let mut shape: Vec<usize> = stacked.getattr("shape")?.extract()?;
    shape.pop();
    shape.extend([2, 3]);
    stacked.call_method1("reshape", (shape,))
}

/// Incoming and outgoing unit vectors of angles.
pub(crate) fn directions_of(angles: &Angles<f32>) -> [[f64; 3]; 2] {
    let angles = Angles {
        theta_h: f64::from(angles.theta_h),
        theta_d: f64::from(angles.theta_d),
        phi_d: f64::from(angles.phi_d),
    };
    let pair = HalfDifference::from_angles(angles).directions();
    [pair.incoming, pair.outgoing]
}

fn tabulated(py: Python<'_>, name: String, brdf: Vec<[f32; 3]>) -> PyResult<PyMaterial> {
    let table = detached(py, || MerlTable::of_nodes(name, &brdf))?.map_err(raised)?;
    let table = Arc::new(table);
    Ok(PyMaterial {
        material: table.clone(),
        in_batches: false,
        origin: Origin::Table(table),
    })
}

fn narrow(rgb: [f64; 3]) -> [f32; 3] {
    rgb.map(|value| value as f32)
}

/// A material that Python holds too.
pub(crate) struct Shared(pub(crate) Arc<dyn Material>);

impl Material for Shared {
    fn name(&self) -> &str {
        self.0.name()
    }
    fn brdf(&self, angles: Angles<f32>) -> [f32; 3] {
        self.0.brdf(angles)
    }
    fn brdf_with_derivative(&self, angles: Angles<f32>) -> ([f32; 3], [[f32; 3]; 3]) {
        self.0.brdf_with_derivative(angles)
    }
    fn brdf_batch_with_derivative(
        &self,
        angles: &[Angles<f32>],
        found: &mut [([f32; 3], [[f32; 3]; 3])],
    ) {
        self.0.brdf_batch_with_derivative(angles, found);
    }
    fn is_reciprocal(&self) -> bool {
        self.0.is_reciprocal()
    }
    fn network(&self) -> Option<NeuralParameters<f32>> {
        self.0.network()
    }
    fn brdf_batch(&self, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]) {
        self.0.brdf_batch(at, brdf);
    }
}
