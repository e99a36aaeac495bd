//! NBRDF: a material as a network of 675 weights in six `.npy` files (Sztrajman et al. 2021).
//!
//! `NAME_fc1.npy` (6 x 21), `_b1` (21), `_fc2` (21 x 21), `_b2` (21), `_fc3` (21 x 3), `_b3` (3);
//! little-endian f32, C order, matrices inputs-by-outputs.

use std::path::{Path, PathBuf};
use std::{fs, io};

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{Model, Neural, NeuralParameters, ParameterSet};

use crate::untrusted::{escaped, read_at_most};
use crate::{Material, SourceError};
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

/// How a NumPy array begins.
const NPY_MAGIC: &[u8] = b"\x93NUMPY";

/// The longest header that is read, magic and lengths included; NumPy writes 128 bytes.
const LONGEST_HEADER: u64 = 4096;

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

    fn network(&self) -> Option<NeuralParameters<f32>> {
        Some(self.parameters)
    }

    fn brdf_batch(&self, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]) {
        <Neural as LaneModel>::evaluate(&self.parameters, at, brdf);
    }
}

/// The six files of a network: what follows NAME in each one's name, and its bytes.
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

/// A `.npy` file of version 1.0: magic, version, the length of a header that is a Python dictionary and
/// ends at a multiple of 64 bytes, values.
fn to_npy(shape: &[u64], values: &[f32]) -> Vec<u8> {
    const ALIGNMENT: usize = 64;
    let lengths: String = shape.iter().map(|length| format!("{length},")).collect();
    let mut header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({lengths}), }}");
    let before = NPY_MAGIC.len() + 4;
    // A line break is the header's last byte.
    let padded = (before + header.len() + 1).next_multiple_of(ALIGNMENT) - before;
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
    let damaged = |what| SourceError::Damaged {
        path: path.into(),
        what,
    };
    let missing_or_refused = |source: io::Error| match source.kind() {
        io::ErrorKind::NotFound => damaged(
            "it is missing: an NBRDF material is six files, NAME_fc1.npy, _b1, _fc2, _b2, _fc3 \
             and _b3; put it beside the others"
                .to_owned(),
        ),
        _ => SourceError::Read {
            path: path.into(),
            source,
        },
    };
    let most = LONGEST_HEADER + shape.iter().product::<u64>() * size_of::<f32>() as u64;
    let length = fs::metadata(path).map_err(missing_or_refused)?.len();
    if length > most {
        return Err(damaged(format!(
            "it has {length} bytes where an array of shape {shape:?} has {most} at most; get it again"
        )));
    }
    let bytes = read_at_most(path, most).map_err(missing_or_refused)?;
    let header = check_npy_header(&bytes).map_err(damaged)?;
    let array = npyz::NpyFile::new(&bytes[..]).map_err(|error| {
        damaged(format!(
            "it is not a whole NumPy array ({}); get it again",
            escaped(&error.to_string())
        ))
    })?;
    if array.shape() != shape || array.order() != npyz::Order::C {
        return Err(damaged(format!(
            "it should hold an array of shape {shape:?} in C order, not {} in {:?} order; save \
             it so with numpy.save",
            escaped(&format!("{:?}", array.shape())),
            array.order()
        )));
    }
    let kind = array.dtype().descr();
    // The header says the order of bytes, and big-endian values are turned.
    if !["'<f4'", "'>f4'"].contains(&&kind[..]) {
        return Err(damaged(format!(
            "it should hold 32-bit floats ('<f4'), and its `descr` is {}; save it so with numpy.save",
            escaped(&kind)
        )));
    }
    let values = shape.iter().product::<u64>() as usize * size_of::<f32>();
    if bytes.len() != header + values {
        let complaint = match bytes.len() < header + values {
            true => "it was cut short",
            false => "something was appended",
        };
        return Err(damaged(format!(
            "{complaint}: it has {} bytes where its header and an array of shape {shape:?} have {}; \
             get it again",
            bytes.len(),
            header + values
        )));
    }
    let values: Vec<f32> = array.into_vec().map_err(|error| {
        damaged(format!(
            "it should hold 32-bit floats ({}); save it so with numpy.save",
            escaped(&error.to_string())
        ))
    })?;
    match values.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(damaged(format!(
            "number {index} is {}, and should be finite; get it again",
            values[index]
        ))),
        None => Ok(values),
    }
}

/// Makes sure that a `.npy` file is as long as its header says that this is: the header is read into
/// memory of the length that it states, up to 4 GB of it. Gives where the values begin.
fn check_npy_header(bytes: &[u8]) -> Result<usize, String> {
    let Some(rest) = bytes.strip_prefix(NPY_MAGIC) else {
        return Err(
            "it is not a whole NumPy array (it does not begin as one); get it again".to_owned(),
        );
    };
    // From version 2 on the length has four bytes.
    let (begin, length) = match rest {
        [0 | 1, _, low, high, ..] => (4, u32::from(u16::from_le_bytes([*low, *high]))),
        [_, _, a, b, c, d, ..] => (6, u32::from_le_bytes([*a, *b, *c, *d])),
        _ => {
            return Err(format!(
                "it is not a whole NumPy array (it has {} bytes, too few for a header); get it again",
                bytes.len()
            ));
        }
    };
    let Some(header) = rest[begin..].get(..length as usize) else {
        return Err(format!(
            "its header states {length} bytes of itself, more than the file has; get it again"
        ));
    };
    // A dictionary, and the shape in it. What is nested deeply is read for hours.
    let brackets = header.iter().filter(|byte| b"{[(".contains(byte)).count();
    match brackets {
        0..=2 => Ok(NPY_MAGIC.len() + begin + header.len()),
        more => Err(format!(
            "its header opens {more} brackets, and that of a plain array 2; save it so with numpy.save"
        )),
    }
}
