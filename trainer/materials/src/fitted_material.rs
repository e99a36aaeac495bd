//! A material that a scan has found, as a file: `material.json`.

use std::path::{Path, PathBuf};

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{ModelKind, NeuralParameters};
use serde::{Deserialize, Serialize};

use crate::basis::Basis;
use crate::error::refused;
use crate::fitted_brdf::FittedBrdf;
use crate::name::is_name;
use crate::untrusted::{escaped, escaped_json_error, read_at_most};
use crate::{Brdf, Material, SourceError};

/// What such a file says it is.
const FORMAT: &str = "glimpse-material";
/// The version of the format that is written, and the only one that is read.
const VERSION: u32 = 1;
/// The longest file that is read: many times what `trainer fit` writes.
const MOST_BYTES: u64 = 1 << 26;
/// The name that a directory is searched for.
const FILE: &str = "material.json";
/// All models, by which a file's is found.
const MODELS: [ModelKind; 4] = [
    ModelKind::Phong,
    ModelKind::CookTorrance,
    ModelKind::Neural,
    ModelKind::Linear,
];

/// The file of a whole basis.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BasisFile {
    /// Where it is, as seen from the folder of the material's file.
    pub file: String,
    /// The CRC-32 of its bytes, eight digits of hex.
    pub checksum: String,
}

impl BasisFile {
    /// Of a basis by its checksum.
    #[must_use]
    pub fn new(file: String, checksum: u32) -> Self {
        let checksum = format!("{checksum:08x}");
        Self { file, checksum }
    }
}

/// The meaning of the numbers that a file or an answer holds, for other programs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Convention {
    /// The quantity: `brdf`.
    pub quantity: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// True if the quantity is multiplied by the cosine of theta_o.
    pub times_cosine: bool,
    /// The color space of its three channels.
    pub color_space: &'static str,
}

impl Convention {
    /// The only one that this program writes: the BRDF in linear RGB, sr^-1, not times the cosine.
    pub const BRDF: Self = Self {
        quantity: "brdf",
        unit: "sr^-1",
        times_cosine: false,
        color_space: "linear-rgb",
    };
}

/// What a file says it is, whatever else a version has in it.
#[derive(Deserialize)]
struct Kind {
    format: String,
    version: u32,
}

/// The fields that make the material. All others report on the fit.
#[derive(Deserialize)]
struct Contents {
    name: String,
    model: String,
    values: Vec<f32>,
    basis: Option<BasisFile>,
}

/// The same, to be written, with all else.
#[derive(Serialize)]
struct Written<'a, A: Serialize> {
    format: &'a str,
    version: u32,
    name: &'a str,
    model: &'a str,
    #[serde(flatten)]
    convention: Convention,
    #[serde(flatten)]
    about: A,
    basis: Option<&'a BasisFile>,
    values: &'a [f32],
}

/// A material that a scan has found: a name, and the BRDF of a fit.
#[derive(Clone, Debug)]
pub struct FittedMaterial {
    name: String,
    fitted: FittedBrdf,
}

impl FittedMaterial {
    /// Names a fit. Returns None if one of its values is not finite.
    #[must_use]
    pub fn new(name: String, fitted: FittedBrdf) -> Option<Self> {
        let is_finite = fitted.values().iter().all(|value| value.is_finite());
        is_finite.then_some(Self { name, fitted })
    }

    /// Returns the fit.
    #[must_use]
    pub fn fitted(&self) -> &FittedBrdf {
        &self.fitted
    }

    /// The text of its file: values with digits enough to get the same 32-bit floats back, the
    /// file of the basis if there is one, and the entries of `about`, a map or a struct.
    ///
    /// # Errors
    /// If `about` is neither.
    pub fn to_json(
        &self,
        basis: Option<&BasisFile>,
        about: impl Serialize,
    ) -> Result<String, serde_json::Error> {
        let written = Written {
            format: FORMAT,
            version: VERSION,
            name: &self.name,
            model: self.fitted.model().name(),
            convention: Convention::BRDF,
            about,
            basis,
            values: self.fitted.values(),
        };
        Ok(serde_json::to_string_pretty(&written)? + "\n")
    }

    /// Reads a file, and the basis that it names.
    ///
    /// # Errors
    /// If a file is missing or damaged, or they do not belong together.
    pub fn read(path: &Path) -> Result<Self, SourceError> {
        let damaged = damaged(path);
        let contents = contents(path)?;
        let name = contents.name;
        if !is_name(&name) {
            return Err(damaged(format!(
                "its `name` is `{}`, and should be the name of a material, without slashes; correct \
                 it",
                escaped(&name)
            )));
        }
        let model = MODELS
            .into_iter()
            .find(|model| model.name() == contents.model);
        let Some(model) = model else {
            return Err(damaged(format!(
                "its `model` is `{}`, which is none of phong, cook-torrance, neural and linear; use \
                 the trainer that wrote it",
                escaped(&contents.model)
            )));
        };
        let basis = match (model, &contents.basis) {
            (ModelKind::Linear, Some(named)) => Some(read_basis(path, named)?),
            _ => None,
        };
        if let Some(index) = contents.values.iter().position(|value| !value.is_finite()) {
            return Err(damaged(format!(
                "number {index} of its `values` is not finite as a 32-bit float; write it again \
                 with `trainer fit`"
            )));
        }
        let count = contents.values.len();
        let fitted = FittedBrdf::new(model, contents.values, basis.as_ref());
        fitted.and_then(|fitted| Self::new(name, fitted)).ok_or_else(|| {
            let expected = match (model.parameters(), &basis) {
                (Some(count), _) => count,
                (None, Some(basis)) => 3 * basis.components(),
                (None, None) => {
                    return damaged(
                        "it names no `basis`, which makes a BRDF of the model linear's \
                         coefficients; write it again with `trainer fit`"
                            .into(),
                    );
                }
            };
            damaged(format!(
                "its `values` should be {expected} finite numbers, and it has {count}; write it \
                 again with `trainer fit`"
            ))
        })
    }

    /// True if a path may be such a file: its name ends in `.json`.
    #[must_use]
    pub fn is_json_file(path: &Path) -> bool {
        path.extension().is_some_and(|ending| ending == "json")
    }

    /// True if a file is one, whatever its name.
    #[must_use]
    pub fn is_fitted_file(path: &Path) -> bool {
        contents(path).is_ok()
    }

    /// The file of a fitted material that a directory holds under its own name, or None.
    pub(super) fn within(directory: &Path) -> Option<PathBuf> {
        let path = directory.join(FILE);
        path.is_file().then_some(path)
    }

    /// The name that a file has for its material.
    pub(super) fn name_in(path: &Path) -> Result<String, SourceError> {
        Ok(contents(path)?.name)
    }

    /// The file, and that of the basis which it names, as far as it can be read.
    pub(super) fn files_of(path: &Path) -> Vec<PathBuf> {
        let named = contents(path).ok().and_then(|contents| contents.basis);
        let basis = named.map(|named| path.with_file_name(named.file));
        [path.to_owned()].into_iter().chain(basis).collect()
    }
}

/// What becomes of something that is wrong with a file.
fn damaged(path: &Path) -> impl Fn(String) -> SourceError {
    move |what| SourceError::Damaged {
        path: path.into(),
        what,
    }
}

fn contents(path: &Path) -> Result<Contents, SourceError> {
    let bytes = read_at_most(path, MOST_BYTES).map_err(refused(path))?;
    let unlike = |error: serde_json::Error| {
        damaged(path)(format!(
            "it is no fitted material as `trainer fit` writes it ({}); write it again",
            escaped_json_error(&error)
        ))
    };
    let Kind { format, version } = serde_json::from_slice(&bytes).map_err(unlike)?;
    match (format.as_str(), version) {
        (FORMAT, VERSION) => serde_json::from_slice(&bytes).map_err(unlike),
        (FORMAT, newer) => Err(damaged(path)(format!(
            "it is of version {newer}, and this trainer reads version {VERSION}; use the trainer \
             that wrote it"
        ))),
        _ => Err(damaged(path)(format!(
            "its `format` should be `{FORMAT}`, and is `{}`; give a file of `trainer fit`",
            escaped(&format)
        ))),
    }
}

fn read_basis(path: &Path, named: &BasisFile) -> Result<Basis, SourceError> {
    let checksum = u32::from_str_radix(&named.checksum, 16).map_err(|_| {
        damaged(path)(format!(
            "the `checksum` of its `basis` should be eight digits of hex, and is `{}`; write it \
             again with `trainer fit`",
            escaped(&named.checksum)
        ))
    })?;
    let basis = path.with_file_name(&named.file);
    if named.file.is_empty() || named.file.contains(char::is_control) {
        return Err(damaged(path)(format!(
            "the `file` of its `basis` is `{}`, and should be where that is; write it again with \
             `trainer fit`",
            escaped(&named.file)
        )));
    }
    Basis::read(&basis, checksum).map_err(|error| damaged(path)(error.to_string()))
}

impl Brdf for FittedMaterial {
    fn evaluate(&self, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]) {
        self.fitted.evaluate(at, brdf);
    }
}

impl Material for FittedMaterial {
    fn name(&self) -> &str {
        &self.name
    }

    fn brdf(&self, angles: Angles<f32>) -> [f32; 3] {
        let mut brdf = [[0.0; 3]];
        self.evaluate(&[HalfDifference::from_angles(angles)], &mut brdf);
        brdf[0]
    }

    fn network(&self) -> Option<NeuralParameters<f32>> {
        self.fitted.network()
    }

    fn brdf_with_derivative(&self, angles: Angles<f32>) -> ([f32; 3], [[f32; 3]; 3]) {
        self.fitted.with_derivative(angles)
    }

    fn brdf_batch(&self, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]) {
        self.evaluate(at, brdf);
    }
}
