//! Fitted materials and their file, `material.json`.

use std::path::{Path, PathBuf};

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{ModelKind, NeuralParameters};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::basis::{BasisTable, Kernels};
use crate::error::{Defect, ensure, read_error};
use crate::fitted_brdf::FittedBrdf;
use crate::untrusted::{escaped, escaped_json_error, is_valid_name, read_at_most};
use crate::{BandValues, Bands, Brdf, BrdfWithDerivative, Material, SourceError};

/// The value of the field `format`.
const FORMAT: &str = "glimpse-material";
/// The only version of the format that is written and read.
const VERSION: u32 = 2;
/// The largest length of a file in bytes. Files from `trainer fit` are much shorter.
const MAX_BYTES: u64 = 1 << 26;
/// The file name of a fitted material in a directory.
const FILE_NAME: &str = "material.json";
/// All models, in the paper's order.
pub const MODELS: [ModelKind; 4] = [
    ModelKind::Phong,
    ModelKind::CookTorrance,
    ModelKind::Linear,
    ModelKind::Neural,
];

/// A reference to the file of a basis.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BasisFile {
    /// The path, relative to the directory of the material's file.
    pub file: String,
    /// The checksum that a recipe has of it, as eight hexadecimal digits.
    pub checksum: String,
}

impl BasisFile {
    /// Makes a reference from a path and a checksum.
    #[must_use]
    pub fn new(file: String, checksum: u32) -> Self {
        let checksum = format!("{checksum:08x}");
        Self { file, checksum }
    }
}

/// The meaning of BRDF values in JSON output, for other programs.
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
    /// The convention of all output of this program: the BRDF in linear RGB, sr^-1, not times the cosine.
    pub const BRDF: Self = Self {
        quantity: "brdf",
        unit: "sr^-1",
        times_cosine: false,
        color_space: "linear-rgb",
    };
}

/// The fields that define the material. The other fields of a file report on the fit.
#[derive(Serialize, Deserialize)]
struct MaterialFields {
    name: String,
    model: String,
    basis: Option<BasisFile>,
    /// The kernels of Linear, fitted to readings at any directions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    kernels: Option<Kernels>,
    values: Vec<f32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    bands: Option<BandValues>,
}

/// All fields of a file, for writing.
#[derive(Serialize)]
struct FileFields<M: Serialize> {
    format: &'static str,
    version: u32,
    #[serde(flatten)]
    convention: Convention,
    #[serde(flatten)]
    metadata: M,
    #[serde(flatten)]
    material: MaterialFields,
}

/// A material from a fit: a name and a BRDF.
#[derive(Clone, Debug)]
pub struct FittedMaterial {
    name: String,
    fitted: FittedBrdf,
    bands: Option<Bands>,
}

impl FittedMaterial {
    /// Makes a material from a fitted BRDF. Returns None if one of its values is not finite.
    #[must_use]
    pub fn new(name: String, fitted: FittedBrdf) -> Option<Self> {
        let is_finite = fitted.values().iter().all(|value| value.is_finite());
        is_finite.then_some(Self {
            name,
            fitted,
            bands: None,
        })
    }

    /// Adds a spectrum. The material is the color of the spectrum then, and no longer the fitted BRDF.
    #[must_use]
    pub fn with_bands(self, bands: Bands) -> Self {
        let bands = Some(bands);
        Self { bands, ..self }
    }

    /// Returns the fitted BRDF.
    #[must_use]
    pub fn fitted(&self) -> &FittedBrdf {
        &self.fitted
    }

    /// Returns the text of the file: the values with enough digits to restore the same 32-bit floats, the reference to
    /// the basis if there is one, and the entries of `metadata`.
    ///
    /// # Errors
    /// If `metadata` is neither a map nor a struct.
    pub fn to_json(
        &self,
        basis: Option<&BasisFile>,
        metadata: impl Serialize,
    ) -> Result<String, serde_json::Error> {
        let fields = FileFields {
            format: FORMAT,
            version: VERSION,
            convention: Convention::BRDF,
            metadata,
            material: MaterialFields {
                name: self.name.clone(),
                model: self.fitted.model().name().to_owned(),
                basis: basis.cloned(),
                kernels: Some(self.fitted.kernels().clone())
                    .filter(|kernels| !kernels.directions.is_empty()),
                values: self.fitted.values().to_vec(),
                bands: self.bands.as_ref().map(|bands| bands.values().clone()),
            },
        };
        Ok(serde_json::to_string_pretty(&fields)? + "\n")
    }

    /// Reads a file, and the basis that it refers to.
    ///
    /// # Errors
    /// If a file is missing or damaged, or the basis has a different checksum.
    pub fn read(path: &Path) -> Result<Self, SourceError> {
        let fields = read_fields(path)?;
        let is_linear = fields.model == ModelKind::Linear.name();
        let basis = match &fields.basis {
            Some(reference) if is_linear => {
                let basis = read_basis(path, reference)?;
                Some(match &fields.kernels {
                    Some(kernels) => basis.with_kernels(kernels.clone()),
                    None => basis,
                })
            }
            _ => None,
        };
        Self::from_fields(fields, basis.as_ref()).map_err(Defect::in_file(path))
    }

    /// Makes a material from the fields of a file.
    fn from_fields(fields: MaterialFields, basis: Option<&BasisTable>) -> Result<Self, Defect> {
        let mut models = MODELS.into_iter();
        let Some(model) = models.find(|kind| kind.name() == fields.model) else {
            return Err(Defect::unsupported(format!(
                "its `model` is `{}`, and only phong, cook-torrance, neural and linear are supported",
                escaped(&fields.model)
            )));
        };
        let values = fields.values;
        if let Some(index) = values.iter().position(|value| !value.is_finite()) {
            return Err(format!("`values[{index}]` is not finite as a 32-bit float").into());
        }
        if (fields.kernels).is_some_and(|kernels| !kernels.is_valid() || basis.is_none()) {
            return Err("its `kernels` need a `basis`, lengths above 0, finite directions".into());
        }
        let coefficients = basis.map(|basis| 3 * basis.coefficients());
        let Some(expected) = model.parameters().or(coefficients) else {
            return Err("it has no `basis`, which the model linear needs".into());
        };
        let count = values.len();
        let fitted = FittedBrdf::new(model, values, basis);
        let material = fitted.and_then(|fitted| Self::new(fields.name, fitted));
        let material = material
            .ok_or_else(|| format!("its `values` must be {expected} numbers, not {count}"))?;
        let Some(bands) = fields.bands else {
            return Ok(material);
        };
        let bands = Bands::new(bands, model, basis).ok_or(
            "the wavelengths of its `bands` must increase, with finite values of its model",
        )?;
        Ok(material.with_bands(bands))
    }

    /// Returns true if the extension of a path is `json`, so that it may be a fitted material.
    #[must_use]
    pub fn is_json_file(path: &Path) -> bool {
        path.extension()
            .is_some_and(|extension| extension == "json")
    }

    /// Returns the path of `material.json` in a directory, or None if the file does not exist.
    pub(crate) fn find_in(directory: &Path) -> Option<PathBuf> {
        let path = directory.join(FILE_NAME);
        path.is_file().then_some(path)
    }

    /// Reads the name of the material in a file.
    pub(crate) fn read_name(path: &Path) -> Result<String, SourceError> {
        Ok(read_fields(path)?.name)
    }

    /// Returns the path itself, and that of the basis if the file can be read and refers to one.
    pub(crate) fn files_of(path: &Path) -> Vec<PathBuf> {
        let reference = read_fields(path).ok().and_then(|fields| fields.basis);
        let basis = reference.map(|reference| path.with_file_name(reference.file));
        [path.to_owned()].into_iter().chain(basis).collect()
    }
}

fn read_fields(path: &Path) -> Result<MaterialFields, SourceError> {
    let bytes = read_at_most(path, MAX_BYTES).map_err(read_error(path))?;
    parse_fields(&bytes).map_err(Defect::in_file(path))
}

fn parse_fields(bytes: &[u8]) -> Result<MaterialFields, Defect> {
    let invalid = |error: serde_json::Error| {
        format!(
            "it is not a valid fitted material ({})",
            escaped_json_error(&error)
        )
    };
    let file: Value = serde_json::from_slice(bytes).map_err(invalid)?;
    let format = file["format"].as_str().unwrap_or_default();
    if format != FORMAT {
        return Err(Defect::new(
            format!(
                "its `format` is `{}`, and must be `{FORMAT}`",
                escaped(format)
            ),
            "give the material.json of `trainer fit`, or a file of another format",
        ));
    }
    if file["version"] != VERSION {
        return Err(Defect::unsupported(format!(
            "its `version` is {}, and only version {VERSION} is supported",
            escaped(&file["version"].to_string())
        )));
    }
    let fields: MaterialFields = serde_json::from_value(file).map_err(invalid)?;
    ensure!(
        is_valid_name(&fields.name),
        "its `name` is `{}`, and must be the name of a material, without slashes",
        escaped(&fields.name)
    );
    Ok(fields)
}

fn read_basis(path: &Path, reference: &BasisFile) -> Result<BasisTable, SourceError> {
    let BasisFile { file, checksum } = reference;
    let damaged = Defect::in_file::<String>(path);
    let number = u32::from_str_radix(checksum, 16).map_err(|_| {
        let checksum = escaped(checksum);
        damaged(format!(
            "the `checksum` of its `basis` is `{checksum}`, not eight hexadecimal digits"
        ))
    })?;
    if file.is_empty() || file.contains(char::is_control) {
        return Err(damaged(format!(
            "the `file` of its `basis` is `{}`, not a path",
            escaped(file)
        )));
    }
    BasisTable::read(&path.with_file_name(file), number).map_err(|error| damaged(error.to_string()))
}

impl Brdf for FittedMaterial {
    fn at_angles(&self, angles: Angles<f32>) -> [f32; 3] {
        match &self.bands {
            Some(bands) => bands.brdf_with_derivative(angles).0,
            None => self.fitted.at_angles(angles),
        }
    }

    fn values_at(&self, at: &[HalfDifference<f32>]) -> Vec<[f32; 3]> {
        match &self.bands {
            Some(bands) => bands.colors_at(at),
            None => self.fitted.values_at(at),
        }
    }
}

impl Material for FittedMaterial {
    fn name(&self) -> &str {
        &self.name
    }

    fn network(&self) -> Option<NeuralParameters<f32>> {
        self.fitted.network().filter(|_| self.bands.is_none())
    }

    fn spectrum(&self) -> Option<&Bands> {
        self.bands.as_ref()
    }

    fn with_derivatives(&self, angles: &[Angles<f32>]) -> Vec<BrdfWithDerivative> {
        let at = |angles: &Angles<f32>| match &self.bands {
            Some(bands) => bands.brdf_with_derivative(*angles),
            None => self.fitted.brdf_with_derivative(*angles),
        };
        angles.iter().map(at).collect()
    }
}
