//! NBRDF: a material as a network of 675 weights in six `.npy` files (Sztrajman et al. 2021).
//!
//! `NAME_fc1.npy` (6 x 21), `_b1` (21), `_fc2` (21 x 21), `_b2` (21), `_fc3` (21 x 3), `_b3` (3);
//! little-endian f32, C order, matrices inputs-by-outputs.

use std::path::{Path, PathBuf};
use std::{fs, io};

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{Model, Neural, NeuralParameters, ParameterSet};

use super::{Material, SourceError};
use glimpse_kernels::Dual;
use glimpse_kernels::LaneModel;
use glimpse_kernels::brdf::{neural_with_derivative, neural_with_derivatives};

/// The six arrays: name and shape.
const ARRAYS: [(&str, &[u64]); 6] = [
    ("fc1", &[6, 21]),
    ("b1", &[21]),
    ("fc2", &[21, 21]),
    ("b2", &[21]),
    ("fc3", &[21, 3]),
    ("b3", &[3]),
];

/// A material that is a network.
#[derive(Clone, Debug)]
pub struct NeuralBrdf {
    name: String,
    parameters: NeuralParameters<f32>,
    /// The same, as what does not change with an angle.
    constants: Box<NeuralParameters<Dual<f32, 3>>>,
}

impl NeuralBrdf {
    /// From parameters.
    #[must_use]
    pub fn new(name: String, parameters: NeuralParameters<f32>) -> Self {
        let constants = Box::new(Dual::constants::<Neural>(&parameters));
        Self {
            name,
            parameters,
            constants,
        }
    }

    /// Reads the material of whose six files `path` is one.
    ///
    /// # Errors
    /// If a file is missing, damaged or of another shape, or a weight is not finite.
    pub fn read(path: &Path) -> Result<Self, SourceError> {
        let name = Self::name_of(path).ok_or_else(|| SourceError::Unknown(path.into()))?;
        let mut parameters = NeuralParameters::filled(0.0);
        for (run, (array, shape)) in parameters.runs_mut().zip(ARRAYS) {
            let file = path.with_file_name(format!("{name}_{array}.npy"));
            run.copy_from_slice(&read_npy(&file, shape)?);
        }
        Ok(Self::new(name, parameters))
    }

    /// `NAME` of a path `.../NAME_fc1.npy` or one of its five siblings; None for any other.
    #[must_use]
    pub fn name_of(path: &Path) -> Option<String> {
        let stem = path.file_name()?.to_str()?.strip_suffix(".npy")?;
        let (name, suffix) = stem.rsplit_once('_')?;
        let known = ARRAYS.iter().any(|(array, _)| *array == suffix);
        known.then(|| name.to_owned())
    }

    /// The six files of the material of which `path` is one; None if it is none of any.
    #[must_use]
    pub fn files_of(path: &Path) -> Option<[PathBuf; 6]> {
        let name = Self::name_of(path)?;
        Some(ARRAYS.map(|(array, _)| path.with_file_name(format!("{name}_{array}.npy"))))
    }

    /// The weights.
    #[must_use]
    pub fn parameters(&self) -> &NeuralParameters<f32> {
        &self.parameters
    }
}

impl Material for NeuralBrdf {
    fn name(&self) -> &str {
        &self.name
    }

    fn brdf(&self, angles: Angles<f32>) -> [f32; 3] {
        Neural::brdf::<f32>(&self.parameters, &HalfDifference::from_angles(angles))
    }

    fn brdf_with_derivative(&self, angles: Angles<f32>) -> ([f32; 3], [[f32; 3]; 3]) {
        neural_with_derivative(&self.parameters, angles)
    }

    fn brdf_batch_with_derivative(
        &self,
        angles: &[Angles<f32>],
        found: &mut [([f32; 3], [[f32; 3]; 3])],
    ) {
        neural_with_derivatives(&self.constants, angles, found);
    }

    fn brdf_batch(&self, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]) {
        <Neural as LaneModel>::evaluate(&self.parameters, at, brdf);
    }
}

/// Reads a `.npy` file of little-endian f32 in C order with the given shape.
fn read_npy(path: &Path, shape: &[u64]) -> Result<Vec<f32>, SourceError> {
    let damaged = |what| SourceError::Damaged {
        path: path.into(),
        what,
    };
    let bytes = fs::read(path).map_err(|source| match source.kind() {
        io::ErrorKind::NotFound => damaged(
            "it is missing: an NBRDF material is six files, NAME_fc1.npy, _b1, _fc2, _b2, _fc3 \
             and _b3; put it beside the others"
                .to_owned(),
        ),
        _ => SourceError::Read {
            path: path.into(),
            source,
        },
    })?;
    let array = npyz::NpyFile::new(&bytes[..]).map_err(|error| {
        damaged(format!(
            "it is not a whole NumPy array ({error}); get it again"
        ))
    })?;
    if array.shape() != shape || array.order() != npyz::Order::C {
        return Err(damaged(format!(
            "it should hold an array of shape {shape:?} in C order, not {:?} in {:?} order; save \
             it so with numpy.save",
            array.shape(),
            array.order()
        )));
    }
    let values: Vec<f32> = array.into_vec().map_err(|error| {
        damaged(format!(
            "it should hold 32-bit floats ({error}); save it so with numpy.save"
        ))
    })?;
    match values.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(damaged(format!(
            "number {index} is not finite; get it again"
        ))),
        None => Ok(values),
    }
}
