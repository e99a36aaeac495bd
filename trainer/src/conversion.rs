//! Conversion of materials to the formats of other programs: file names and contents.
//!
//! The format NBRDF only holds networks, so a network is fitted to other materials. Shading models of renderers are fitted
//! too.

use std::path::{Path, PathBuf};

use glimpse_core::model::{ModelKind, NeuralParameters};
use glimpse_materials::loss::loss_between;
use glimpse_materials::setting::{Setting, SettingError, SettingNames};
use glimpse_materials::{
    Colors, Format, Material, NeuralBrdf, NotFinite, Source, SourceError, pab_suffixes, to_merl,
    to_nbrdf, to_pab, to_rgl,
};

use crate::evaluation::{EvaluationError, Fitted, Method, OPTIMUM_STEPS, compare};
use crate::metrics::{CompareError, Metrics};
use crate::shading::{self, ShadingError, ShadingModel};

/// An error in converting a material.
#[derive(Debug, thiserror::Error)]
pub enum ConversionError {
    /// The material has a value that is not finite.
    #[error(transparent)]
    NotFinite(#[from] NotFinite),
    /// No network can be fitted to the material.
    #[error(transparent)]
    Fit(#[from] EvaluationError),
    /// No shading model can be fitted to the material.
    #[error(transparent)]
    Shading(#[from] ShadingError),
    /// Pictures cannot be compared. Does not happen in practice because all have the same size.
    #[error(transparent)]
    Compare(#[from] CompareError),
    /// The fit of a network diverged.
    #[error("the fit of a network diverged; give another seed")]
    FitDiverged,
    /// The written file cannot be read.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// The ending of a path is that of another format than the requested one.
    #[error("{}", self.message(Setting::name))]
    OtherEnding(PathBuf, OutputFormat),
    /// The ending of a path is not that of a format.
    #[error("{}", self.message(Setting::name))]
    UnknownEnding(PathBuf),
    /// A path has no file name.
    #[error("{} has no file name; give DIR/NAME", .0.display())]
    Name(PathBuf),
    /// A path has the extension `.npy`, but not the suffix of one of a network's files.
    #[error("{} is not one of a network's six file names; give NAME_fc1.npy or NAME", .0.display())]
    NotNetworkFile(PathBuf),
}

impl SettingError for ConversionError {
    fn message(&self, name: SettingNames) -> String {
        let setting = name(Setting::Format);
        match self {
            Self::OtherEnding(path, format) => format!(
                "{} has the ending of the format {}, but {setting} is another: change the ending, or remove {setting}",
                path.display(),
                format.name()
            ),
            Self::UnknownEnding(path) => format!(
                "{} does not have the ending of a format: use .binary, .bsdf, _fc1.npy, .gltf or .mtlx, or give \
                 {setting}",
                path.display()
            ),
            other => other.to_string(),
        }
    }
}

/// An output format of materials.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutputFormat {
    /// The BRDF, in a format that the trainer also reads.
    Brdf(Format),
    /// The parameters of a shading model that approximates the BRDF.
    Shading(ShadingModel),
}

impl OutputFormat {
    /// All formats.
    pub const ALL: [Self; 8] = [
        Self::Brdf(Format::Merl),
        Self::Brdf(Format::Nbrdf),
        Self::Brdf(Format::Rgl),
        Self::Brdf(Format::RglSpectra),
        Self::Brdf(Format::Pab),
        Self::Shading(ShadingModel::Principled),
        Self::Shading(ShadingModel::Gltf),
        Self::Shading(ShadingModel::StandardSurface),
    ];

    /// Returns the name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Brdf(format) => format.name(),
            Self::Shading(ShadingModel::Principled) => "principled",
            Self::Shading(ShadingModel::Gltf) => "gltf",
            Self::Shading(ShadingModel::StandardSurface) => "materialx",
        }
    }

    /// Returns the format with this name; None if no format has it.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|format| format.name() == name)
    }

    /// Returns the requested format, or else that of the ending of a file's name.
    ///
    /// # Errors
    /// If the ending is that of another format, or neither states a format.
    pub fn choose(requested: Option<Self>, path: &Path) -> Result<Self, ConversionError> {
        match (requested, Self::from_extension(path)) {
            (Some(requested), Some(format)) if requested != format => {
                Err(ConversionError::OtherEnding(path.into(), format))
            }
            (requested, format) => requested
                .or(format)
                .ok_or_else(|| ConversionError::UnknownEnding(path.into())),
        }
    }

    /// Returns the format for the ending of a file's name; None for other endings.
    #[must_use]
    pub fn from_extension(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()? {
            "binary" => Some(Self::Brdf(Format::Merl)),
            "bsdf" if has_suffix(path, "_spec") => Some(Self::Brdf(Format::RglSpectra)),
            "bsdf" => Some(Self::Brdf(Format::Rgl)),
            "npy" => Some(Self::Brdf(Format::Nbrdf)),
            "gltf" => Some(Self::Shading(ShadingModel::Gltf)),
            "mtlx" => Some(Self::Shading(ShadingModel::StandardSurface)),
            "json" if has_suffix(path, "_principled") => {
                Some(Self::Shading(ShadingModel::Principled))
            }
            _ => None,
        }
    }
}

/// Returns true if the file's name without its extension has this ending, as `NAME_spec.bsdf`, RGL's name of spectral files.
fn has_suffix(path: &Path, suffix: &str) -> bool {
    let stem = path.file_stem().and_then(|stem| stem.to_str());
    stem.is_some_and(|stem| stem.ends_with(suffix))
}

/// The files of a material, and their errors.
#[derive(Clone, Debug)]
pub struct Encoded {
    /// Names and contents, in the order of [`output_paths`].
    pub files: Vec<(String, Vec<u8>)>,
    /// The errors of a shading model against the material; None for other formats.
    pub metrics: Option<Metrics>,
}

/// Returns the paths of a material's files. For MERL, RGL and shading models, `path` is the only file. For NBRDF, it is one of the six
/// files or their common prefix. For PAB-Opto's text, it is the common prefix.
///
/// # Errors
/// If the path has no file name, or ends in `.npy` but not like one of the six files.
pub fn output_paths(format: OutputFormat, path: &Path) -> Result<Vec<PathBuf>, ConversionError> {
    match format {
        OutputFormat::Shading(_)
        | OutputFormat::Brdf(Format::Merl | Format::Rgl | Format::RglSpectra) => {
            Ok(vec![path.to_owned()])
        }
        OutputFormat::Brdf(Format::Pab) => {
            let name = file_name(path)?;
            let names = pab_suffixes().map(|suffix| format!("{name}{suffix}"));
            Ok(names.map(|name| path.with_file_name(name)).collect())
        }
        OutputFormat::Brdf(Format::Nbrdf) => {
            if let Some(files) = NeuralBrdf::files_of(path) {
                return Ok(files.to_vec());
            }
            if path.extension().is_some_and(|extension| extension == "npy") {
                return Err(ConversionError::NotNetworkFile(path.into()));
            }
            let first = format!("{}_fc1.npy", file_name(path)?);
            let files = NeuralBrdf::files_of(&path.with_file_name(first));
            Ok(files.into_iter().flatten().collect())
        }
    }
}

/// Returns the file name of a path, which is the common prefix of several files.
///
/// # Errors
/// If the path has no file name.
pub fn file_name(path: &Path) -> Result<&str, ConversionError> {
    let name = path.file_name().and_then(|name| name.to_str());
    name.ok_or_else(|| ConversionError::Name(path.into()))
}

/// Encodes a material in a format. The names of files begin with `name`. For NBRDF, a network is fitted to a material that is
/// not a network. The fit takes a few seconds and depends on the seed. The fit of a shading model takes a few seconds too.
///
/// # Errors
/// If the material has a value that is not finite, or no network or shading model can be fitted to it.
pub fn encode(
    material: &dyn Material,
    format: OutputFormat,
    name: &str,
    seed: u64,
) -> Result<Encoded, ConversionError> {
    match format {
        OutputFormat::Brdf(format) => Ok(Encoded {
            files: encode_brdf(material, format, name, seed)?,
            metrics: None,
        }),
        OutputFormat::Shading(model) => {
            let shading = shading::fit(material, model)?;
            let metrics = compare(&shading, material)?;
            let file = shading.to_file(name, &metrics);
            Ok(Encoded {
                files: vec![(format!("{name}{}", model.suffix()), file)],
                metrics: Some(metrics),
            })
        }
    }
}

fn encode_brdf(
    material: &dyn Material,
    format: Format,
    name: &str,
    seed: u64,
) -> Result<Vec<(String, Vec<u8>)>, ConversionError> {
    Ok(match format {
        Format::Merl => vec![(format!("{name}.binary"), to_merl(material)?)],
        Format::Rgl | Format::RglSpectra => {
            let (suffix, colors) = match format {
                Format::Rgl => ("rgb", Colors::Rgb),
                _ => ("spec", Colors::Spectra),
            };
            let version = env!("CARGO_PKG_VERSION");
            let description = format!("{}, by glimpse-trainer {version}", material.name());
            let bytes = to_rgl(&description, material, colors)?;
            vec![(format!("{name}_{suffix}.bsdf"), bytes)]
        }
        Format::Nbrdf => {
            let network = match material.network() {
                Some(network) => network,
                None => fit_network(material, seed)?,
            };
            let files = to_nbrdf(&network).into_iter();
            files
                .map(|(suffix, bytes)| (format!("{name}{suffix}"), bytes))
                .collect()
        }
        Format::Pab => {
            let texts = to_pab(name, material)?.into_iter();
            let names = pab_suffixes().map(|suffix| format!("{name}{suffix}"));
            names.zip(texts.map(String::into_bytes)).collect()
        }
    })
}

/// Returns the loss of a written file with its material as the reference: the mean cosine-weighted logarithmic error.
///
/// # Errors
/// If the file cannot be read.
pub fn loss_of_file(material: &dyn Material, file: &Path) -> Result<f64, ConversionError> {
    let written = Source(file.display().to_string()).load()?;
    let written = written.first().ok_or(SourceError::Empty(file.into()))?;
    Ok(loss_between(&**written, material))
}

/// Fits a network to a material.
fn fit_network(
    material: &dyn Material,
    seed: u64,
) -> Result<NeuralParameters<f32>, ConversionError> {
    let method = Method::optimum(ModelKind::Neural, OPTIMUM_STEPS);
    let Fitted::Model(fitted) = method.fit(material, seed)? else {
        return Err(ConversionError::FitDiverged);
    };
    let is_finite = fitted.values().iter().all(|weight| weight.is_finite());
    let network = fitted.network().filter(|_| is_finite);
    network.ok_or(ConversionError::FitDiverged)
}
