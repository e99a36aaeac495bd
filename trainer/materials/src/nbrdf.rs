//! NBRDF: a material as a network of 675 weights in six `.npy` files (Sztrajman et al. 2021).
//!
//! The files are `NAME_fc1.npy` (6 x 21), `_b1` (21), `_fc2` (21 x 21), `_b2` (21), `_fc3` (21 x 3) and `_b3` (3).
//! Values are little-endian f32 in C order. Matrices have one row per input and one column per output.

use std::io;
use std::path::{Path, PathBuf};

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{Model, Neural, NeuralParameters, ParameterSet};
use glimpse_kernels::brdf::{neural_batch_with_derivatives, with_derivative};
use glimpse_kernels::{Dual, LaneModel};

use crate::error::{Defect, ensure, read_error};
use crate::untrusted::{escaped, read_at_most};
use crate::{Material, SourceError};

/// Name and shape of the six arrays.
const ARRAYS: [(&str, &[u64]); 6] = [
    ("fc1", &[6, 21]),
    ("b1", &[21]),
    ("fc2", &[21, 21]),
    ("b2", &[21]),
    ("fc3", &[21, 3]),
    ("b3", &[3]),
];

/// The first bytes of a NumPy file.
const NPY_MAGIC: &[u8] = b"\x93NUMPY";

/// The largest number of bytes before the values: magic, version, header length and header. NumPy writes 128 bytes.
const MAX_HEADER_BYTES: u64 = 4096;

/// A material that is a network of the model Neural.
#[derive(Clone, Debug)]
pub struct NeuralBrdf {
    name: String,
    parameters: NeuralParameters<f32>,
    /// The parameters as dual numbers with zero derivatives.
    constants: Box<NeuralParameters<Dual<f32, 3>>>,
}

impl NeuralBrdf {
    /// Makes a material from network parameters.
    #[must_use]
    pub fn new(name: String, parameters: NeuralParameters<f32>) -> Self {
        let constants = Box::new(Dual::constants::<Neural>(&parameters));
        Self {
            name,
            parameters,
            constants,
        }
    }

    /// Reads a material. `path` is any of its six files.
    ///
    /// # Errors
    /// If a file is missing or damaged, an array has the wrong shape, or a weight is not finite.
    pub fn read(path: &Path) -> Result<Self, SourceError> {
        let name = Self::name_of(path).ok_or_else(|| SourceError::UnknownFormat(path.into()))?;
        let mut parameters = NeuralParameters::filled(0.0);
        let mut rest = &mut parameters[..];
        for ((array, shape), length) in ARRAYS.into_iter().zip(Neural::LAYERS) {
            let file = path.with_file_name(format!("{name}_{array}.npy"));
            let (layer, after) = rest.split_at_mut(length);
            layer.copy_from_slice(&read_npy(&file, shape)?);
            rest = after;
        }
        Ok(Self::new(name, parameters))
    }

    /// Returns `NAME` of a path `.../NAME_fc1.npy` or of one of its five siblings, or None for any other path.
    #[must_use]
    pub fn name_of(path: &Path) -> Option<String> {
        let stem = path.file_name()?.to_str()?.strip_suffix(".npy")?;
        let (name, suffix) = stem.rsplit_once('_')?;
        let is_array = ARRAYS.iter().any(|(array, _)| *array == suffix);
        is_array.then(|| name.to_owned())
    }

    /// Returns the paths of a material's six files. `path` is one of them. Returns None for any other path.
    #[must_use]
    pub fn files_of(path: &Path) -> Option<[PathBuf; 6]> {
        let name = Self::name_of(path)?;
        Some(ARRAYS.map(|(array, _)| path.with_file_name(format!("{name}_{array}.npy"))))
    }

    /// Returns the weights.
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
        with_derivative::<Neural>(&self.parameters, angles)
    }

    fn brdf_batch_with_derivative(
        &self,
        angles: &[Angles<f32>],
        results: &mut [([f32; 3], [[f32; 3]; 3])],
    ) {
        neural_batch_with_derivatives(&self.constants, angles, results);
    }

    fn network(&self) -> Option<NeuralParameters<f32>> {
        Some(self.parameters)
    }

    fn brdf_batch(&self, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]) {
        <Neural as LaneModel>::evaluate(&self.parameters, at, brdf);
    }
}

/// Returns the six files of a network: the suffix after NAME in the file name, and the bytes.
#[must_use]
pub fn to_nbrdf(parameters: &NeuralParameters<f32>) -> [(String, Vec<u8>); 6] {
    let mut rest = &parameters[..];
    let mut lengths = Neural::LAYERS.into_iter();
    ARRAYS.map(|(array, shape)| {
        let (layer, after) = rest.split_at(lengths.next().unwrap_or(0));
        rest = after;
        (format!("_{array}.npy"), to_npy(shape, layer))
    })
}

/// Returns the header of a `.npy` file, a Python dictionary, as `numpy.save` writes it.
fn npy_header(shape: &[u64]) -> String {
    let lengths: Vec<String> = shape.iter().map(u64::to_string).collect();
    let lengths = lengths.join(", ");
    let comma = if shape.len() == 1 { "," } else { "" };
    format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({lengths}{comma}), }}")
}

/// Returns a header without white space and without the optional comma after the last length.
fn normalized(header: &str) -> String {
    let header: String = header.split_whitespace().collect();
    header.replace(",)", ")")
}

/// Returns a `.npy` file of version 1.0: magic, version, header length, header and values. The header is padded to a
/// multiple of 64 bytes from the start of the file.
#[must_use]
pub fn to_npy(shape: &[u64], values: &[f32]) -> Vec<u8> {
    const ALIGNMENT: usize = 64;
    let mut header = npy_header(shape);
    let prefix = NPY_MAGIC.len() + 4;
    // The last byte of the header is a line break.
    let padded = (prefix + header.len() + 1).next_multiple_of(ALIGNMENT) - prefix;
    header += &" ".repeat(padded - 1 - header.len());
    header.push('\n');
    let mut bytes = NPY_MAGIC.to_vec();
    bytes.extend([1, 0]);
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    bytes
}

/// Reads a `.npy` file of little-endian f32 in C order with the given shape.
fn read_npy(path: &Path, shape: &[u64]) -> Result<Vec<f32>, SourceError> {
    let damaged = Defect::in_file(path);
    let value_bytes = shape.iter().product::<u64>() * size_of::<f32>() as u64;
    let bytes = read_at_most(path, MAX_HEADER_BYTES + value_bytes).map_err(|error| {
        let missing = "it is missing, and an NBRDF material has the files NAME_fc1.npy, _b1, _fc2, _b2, _fc3 and _b3";
        match error.kind() {
            io::ErrorKind::NotFound => damaged(missing.to_owned()),
            io::ErrorKind::InvalidData => damaged(error.to_string()),
            _ => read_error(path)(error),
        }
    })?;
    parse_npy(&bytes, shape, value_bytes as usize).map_err(damaged)
}

/// Parses a `.npy` file. The values of the given shape have `value_bytes` bytes.
fn parse_npy(bytes: &[u8], shape: &[u64], value_bytes: usize) -> Result<Vec<f32>, String> {
    // Since version 2 the length of the header has four bytes.
    let (begin, length) = match bytes.strip_prefix(NPY_MAGIC) {
        Some([0 | 1, _, low, high, ..]) => (4, u32::from(u16::from_le_bytes([*low, *high]))),
        Some([_, _, a, b, c, d, ..]) => (6, u32::from_le_bytes([*a, *b, *c, *d])),
        _ => return Err("it does not start with the header of a NumPy array".to_owned()),
    };
    let rest = &bytes[NPY_MAGIC.len() + begin..];
    let Some((header, values)) = rest.split_at_checked(length as usize) else {
        return Err(format!(
            "its header states that it has {length} bytes, more than the file"
        ));
    };
    let header = String::from_utf8_lossy(header);
    let expected = npy_header(shape);
    ensure!(
        normalized(&header) == normalized(&expected),
        "its header is {}, and must be {expected}",
        escaped(header.trim())
    );
    ensure!(
        values.len() == value_bytes,
        "it has {} bytes after its header, and must have {value_bytes}",
        values.len()
    );
    let values = values.as_chunks().0.iter().copied();
    let values: Vec<f32> = values.map(f32::from_le_bytes).collect();
    match values.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(format!(
            "number {index} is {}, and must be finite",
            values[index]
        )),
        None => Ok(values),
    }
}
