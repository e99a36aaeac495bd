//! NBRDF: a material as a network of 675 weights in six `.npy` files (Sztrajman et al. 2021).
//!
//! The files are `NAME_fc1.npy` (6 x 21), `_b1` (21), `_fc2` (21 x 21), `_b2` (21), `_fc3` (21 x 3) and `_b3` (3).
//! Matrices have one row per input and one column per output. Matrices that PyTorch saves, outputs x inputs, are
//! transposed: `fc1` then has the shape 21 x 6. The square matrix `fc2` has the orientation of the other two. Values are
//! 32-bit or 64-bit floats of either byte order, in C or Fortran order.

use std::io;
use std::path::{Path, PathBuf};

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{Model, Neural, NeuralParameters, ParameterSet};
use glimpse_kernels::brdf::neural_batch_with_derivatives;
use glimpse_kernels::{Dual, NEURAL};

use serde::Deserialize;

use crate::error::{Defect, ensure, read_error};
use crate::lists::indices;
use crate::untrusted::{escaped, read_at_most};
use crate::{Brdf, BrdfWithDerivative, Material, SourceError};

/// The ends of the names of the six files.
pub(super) const ENDINGS: [&str; 6] = [
    "_fc1.npy", "_b1.npy", "_fc2.npy", "_b2.npy", "_fc3.npy", "_b3.npy",
];
/// The shapes of the six arrays.
const SHAPES: [&[usize]; 6] = [&[6, 21], &[21], &[21, 21], &[21], &[21, 3], &[3]];

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
    pub(crate) fn read(path: &Path, name: String) -> Result<Self, SourceError> {
        let files = files_of(path, &name);
        let arrays = files.iter().zip(SHAPES);
        let arrays = arrays.map(|(file, shape)| Array::read(file, shape.iter().product()));
        let arrays: Vec<Array> = arrays.collect::<Result<_, _>>()?;
        // The shape of the square matrix does not tell its orientation, so that all have that of the first.
        let is_transposed = arrays[0].header.shape == [21, 6];
        let mut parameters = NeuralParameters::filled(0.0);
        let mut rest = &mut parameters[..];
        for ((file, array), shape) in files.iter().zip(arrays).zip(SHAPES) {
            let (layer, after) = rest.split_at_mut(array.values.len());
            let oriented = array.oriented(shape, is_transposed);
            layer.copy_from_slice(&oriented.map_err(Defect::in_file(file))?);
            rest = after;
        }
        Ok(Self::new(name, parameters))
    }

    /// Returns the weights.
    #[must_use]
    pub fn parameters(&self) -> &NeuralParameters<f32> {
        &self.parameters
    }
}

impl Brdf for NeuralBrdf {
    fn at_angles(&self, angles: Angles<f32>) -> [f32; 3] {
        Neural::brdf::<f32>(&self.parameters, &HalfDifference::from_angles(angles))
    }

    fn values_at(&self, at: &[HalfDifference<f32>]) -> Vec<[f32; 3]> {
        let mut values = vec![[0.0; 3]; at.len()];
        (NEURAL.evaluate)(self.parameters.as_slice(), at, &mut values);
        values
    }
}

impl Material for NeuralBrdf {
    fn name(&self) -> &str {
        &self.name
    }

    fn with_derivatives(&self, angles: &[Angles<f32>]) -> Vec<BrdfWithDerivative> {
        let mut results = vec![Default::default(); angles.len()];
        neural_batch_with_derivatives(&self.constants, angles, &mut results);
        results
    }

    fn network(&self) -> Option<NeuralParameters<f32>> {
        Some(self.parameters)
    }
}

/// Returns the paths of the six files of a material with this name. `path` is one of them.
pub(crate) fn files_of(path: &Path, name: &str) -> [PathBuf; 6] {
    ENDINGS.map(|ending| path.with_file_name(format!("{name}{ending}")))
}

/// Returns the six files of a network.
#[must_use]
pub fn to_nbrdf(parameters: &NeuralParameters<f32>) -> [Vec<u8>; 6] {
    let mut rest = &parameters[..];
    SHAPES.map(|shape| {
        let (layer, after) = rest.split_at(shape.iter().product());
        rest = after;
        to_npy(shape, layer)
    })
}

/// Returns a shape as Python writes it.
fn shape_text(shape: &[usize]) -> String {
    let lengths: Vec<String> = shape.iter().map(usize::to_string).collect();
    let comma = if shape.len() == 1 { "," } else { "" };
    format!("({}{comma})", lengths.join(", "))
}

/// Returns a `.npy` file of version 1.0: magic, version, header length, header and values. The header is padded to a
/// multiple of 64 bytes from the start of the file.
#[must_use]
pub fn to_npy(shape: &[usize], values: &[f32]) -> Vec<u8> {
    const ALIGNMENT: usize = 64;
    let shape = shape_text(shape);
    let mut header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}");
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

/// The header of a `.npy` file.
#[derive(Deserialize)]
struct Header {
    /// The byte order, and the type of the values.
    descr: String,
    fortran_order: bool,
    shape: Vec<usize>,
}

/// An array of a `.npy` file, in the order of the file.
struct Array {
    header: Header,
    values: Vec<f32>,
}

impl Array {
    /// Reads a file with this number of values.
    fn read(path: &Path, count: usize) -> Result<Self, SourceError> {
        let damaged = Defect::in_file(path);
        let max_bytes = MAX_HEADER_BYTES + (count * size_of::<f64>()) as u64;
        let bytes = read_at_most(path, max_bytes).map_err(|error| {
            let missing = "it is missing, and an NBRDF material has the files NAME_fc1.npy, _b1, _fc2, _b2, _fc3 and _b3";
            match error.kind() {
                io::ErrorKind::NotFound => damaged(missing.to_owned()),
                io::ErrorKind::InvalidData => damaged(error.to_string()),
                _ => read_error(path)(error),
            }
        })?;
        Self::parse(&bytes, count).map_err(damaged)
    }

    fn parse(bytes: &[u8], count: usize) -> Result<Self, String> {
        // Since version 2 the length of the header has four bytes.
        let (begin, length) = match bytes.strip_prefix(NPY_MAGIC) {
            Some([0 | 1, _, low, high, ..]) => (4, u32::from(u16::from_le_bytes([*low, *high]))),
            Some([_, _, a, b, c, d, ..]) => (6, u32::from_le_bytes([*a, *b, *c, *d])),
            _ => return Err("it does not start with the header of a NumPy array".to_owned()),
        };
        let rest = &bytes[NPY_MAGIC.len() + begin..];
        let Some((text, bytes)) = rest.split_at_checked(length as usize) else {
            return Err(format!(
                "its header states that it has {length} bytes, more than the file"
            ));
        };
        let text = String::from_utf8_lossy(text);
        let Some(header) = parse_header(&text) else {
            return Err(format!(
                "its header is {}, and not that of one array; save each array with numpy.save",
                escaped(text.trim())
            ));
        };
        let number: fn([u8; 8]) -> f64 = match &header.descr[..] {
            "<f4" => |[a, b, c, d, ..]| f32::from_le_bytes([a, b, c, d]).into(),
            ">f4" => |[a, b, c, d, ..]| f32::from_be_bytes([a, b, c, d]).into(),
            "<f8" => f64::from_le_bytes,
            ">f8" => f64::from_be_bytes,
            other => {
                return Err(format!(
                    "the type (descr) of its values is {}, and must be <f4 or <f8; save array.astype('<f4')",
                    escaped(other)
                ));
            }
        };
        let width = if header.descr.ends_with('4') { 4 } else { 8 };
        // Products of huge lengths overflow.
        let product = header
            .shape
            .iter()
            .try_fold(1_usize, |product, length| product.checked_mul(*length));
        ensure!(
            product == Some(count),
            "its shape is {}, and it must have {count} values",
            escaped(&shape_text(&header.shape))
        );
        ensure!(
            bytes.len() == count * width,
            "it has {} bytes after its header, and must have {}",
            bytes.len(),
            count * width
        );
        let value = |bytes: &[u8]| {
            let mut number_bytes = [0; 8];
            number_bytes[..width].copy_from_slice(bytes);
            number(number_bytes) as f32
        };
        let values = bytes.chunks_exact(width).map(value).collect();
        Ok(Self { header, values })
    }

    /// Returns the values in C order, with one row per input. `shape` is that of such a matrix, or of a vector.
    fn oriented(&self, shape: &[usize], is_transposed: bool) -> Result<Vec<f32>, String> {
        let mut expected = shape.to_vec();
        if is_transposed {
            expected.reverse();
        }
        // A vector may be a row or a column.
        let lengths = self
            .header
            .shape
            .iter()
            .copied()
            .filter(|length| *length != 1);
        let orientation = match is_transposed {
            true => "outputs x inputs, as that of fc1",
            false => "inputs x outputs",
        };
        ensure!(
            lengths.eq(expected.iter().copied()),
            "its shape is {}, and must be {} ({orientation})",
            shape_text(&self.header.shape),
            shape_text(&expected)
        );
        let (rows, columns) = (shape[0], shape.get(1).copied().unwrap_or(1));
        let is_in_order = self.header.fortran_order == is_transposed;
        let element = |index: usize| match is_in_order {
            true => self.values[index],
            false => self.values[index % columns * rows + index / columns],
        };
        let values: Vec<f32> = (0..rows * columns).map(element).collect();
        match values.iter().position(|value| !value.is_finite()) {
            None => Ok(values),
            Some(position) => Err(format!(
                "its weight {:?} (input, output) is {}, and must be finite as a 32-bit float",
                indices(position, shape.to_vec()),
                values[position]
            )),
        }
    }
}

/// Parses the header, a Python dictionary, as JSON.
fn parse_header(text: &str) -> Option<Header> {
    let mut text: String = text.split_whitespace().collect();
    let replacements = [
        ("'", "\""),
        ("(", "["),
        (")", "]"),
        (",]", "]"),
        (",}", "}"),
        ("True", "true"),
        ("False", "false"),
    ];
    for (python, json) in replacements {
        text = text.replace(python, json);
    }
    serde_json::from_str(&text).ok()
}
