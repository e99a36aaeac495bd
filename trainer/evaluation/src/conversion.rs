//! Conversion of materials to the formats of other programs: file names and contents.
//!
//! The format NBRDF only holds networks, so a network is fitted to other materials. Shading models of renderers are fitted
//! too. Tables hold a BRDF that is reciprocal and conserves energy, see [`Physical`].

use std::path::{Path, PathBuf};

use glimpse_core::model::{ModelKind, NeuralParameters};
use glimpse_materials::loss::loss_between;
use glimpse_materials::setting::Name;
use glimpse_materials::{
    Brdf, Colors, Format, Material, NeuralBrdf, NotFinite, Physical, PhysicalErrors, Source,
    SourceError, pab_suffixes, to_merl, to_nbrdf, to_open_material, to_pab, to_rgl, to_ssdd,
};

use crate::evaluation::{EvaluationError, Fitted, Method, OPTIMUM_STEPS, compare};
use crate::metrics::CompareError;
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
    #[error(
        "{} has the ending of the format {}, but {setting} is another: change the ending, or remove {setting}",
        .0.display(), .1.name(), setting = Name("format")
    )]
    OtherEnding(PathBuf, OutputFormat),
    /// A format of parameters was requested as fitted, which it always is.
    #[error(
        "{} has no effect on the format {}, which holds parameters: remove it",
        Name("as_fitted"), .0.name()
    )]
    AsFitted(OutputFormat),
    /// The ending of a path is not that of a format.
    #[error(
        "{} does not have the ending of a format: use .binary, .bsdf, .ssdd, .xompt, _fc1.npy, .gltf or .mtlx, or give {}",
        .0.display(), Name("format")
    )]
    UnknownEnding(PathBuf),
    /// A path has no file name.
    #[error("{} has no file name; give DIR/NAME", .0.display())]
    Name(PathBuf),
    /// A path has the extension `.npy`, but not the suffix of one of a network's files.
    #[error("{} is not one of a network's six file names; give NAME_fc1.npy or NAME", .0.display())]
    NotNetworkFile(PathBuf),
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
    pub const ALL: [Self; 10] = [
        Self::Brdf(Format::Merl),
        Self::Brdf(Format::Nbrdf),
        Self::Brdf(Format::Rgl),
        Self::Brdf(Format::RglSpectra),
        Self::Brdf(Format::Pab),
        Self::Brdf(Format::OpenMaterial),
        Self::Brdf(Format::Ssdd),
        Self::Shading(ShadingModel::Principled),
        Self::Shading(ShadingModel::Gltf),
        Self::Shading(ShadingModel::OpenPbr),
    ];

    /// Returns the name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Brdf(format) => format.name(),
            Self::Shading(ShadingModel::Principled) => "principled",
            Self::Shading(ShadingModel::Gltf) => "gltf",
            Self::Shading(ShadingModel::OpenPbr) => "openpbr",
        }
    }

    /// Returns true if a file of this format is a table, which can hold any BRDF.
    #[must_use]
    pub fn is_table(self) -> bool {
        !matches!(self, Self::Brdf(Format::Nbrdf) | Self::Shading(_))
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
            "xompt" => Some(Self::Brdf(Format::OpenMaterial)),
            "ssdd" => Some(Self::Brdf(Format::Ssdd)),
            "npy" => Some(Self::Brdf(Format::Nbrdf)),
            "gltf" => Some(Self::Shading(ShadingModel::Gltf)),
            "mtlx" => Some(Self::Shading(ShadingModel::OpenPbr)),
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

/// The files of a material.
#[derive(Clone, Debug)]
pub struct Encoded {
    /// Names and contents, in the order of [`output_paths`].
    pub files: Vec<(String, Vec<u8>)>,
    /// True if a table holds another BRDF than the material's, see [`Physical`].
    pub is_changed: bool,
    /// The errors of a shading model.
    shading: Option<WrittenErrors>,
}

/// The errors of written files.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct WrittenErrors {
    /// The loss against the material.
    pub loss: f64,
    /// For a shading model, the mean CIEDE2000 of a sphere.
    pub delta_e: Option<f64>,
    /// The physical errors of the material.
    pub before: PhysicalErrors,
    /// The physical errors of the files.
    pub after: PhysicalErrors,
}

impl Encoded {
    /// Returns the errors of the files against their material. Reads the first of them again, unless it holds a shading model.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn errors(
        &self,
        material: &dyn Material,
        first: &Path,
    ) -> Result<WrittenErrors, ConversionError> {
        if let Some(errors) = self.shading {
            return Ok(errors);
        }
        let written = Source(first.display().to_string()).load()?;
        let written = written.first().ok_or(SourceError::Empty(first.into()))?;
        Ok(WrittenErrors {
            loss: loss_between(&**written, material),
            delta_e: None,
            before: PhysicalErrors::of(material),
            after: PhysicalErrors::of(&**written),
        })
    }
}

/// Returns the paths of a material's files. For MERL, RGL and shading models, `path` is the only file. For NBRDF, it is one of the six
/// files or their common prefix. For PAB-Opto's text, it is the common prefix.
///
/// # Errors
/// If the path has no file name, or ends in `.npy` but not like one of the six files.
pub fn output_paths(format: OutputFormat, path: &Path) -> Result<Vec<PathBuf>, ConversionError> {
    match format {
        OutputFormat::Shading(_)
        | OutputFormat::Brdf(
            Format::Merl | Format::Rgl | Format::RglSpectra | Format::OpenMaterial | Format::Ssdd,
        ) => Ok(vec![path.to_owned()]),
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

/// Encodes a material in a format. The names of files begin with `name`.
///
/// A table holds the material as [`Physical`] changes it, unless `as_fitted` is true. For NBRDF, a network is fitted to a
/// material that is not a network. The fit takes a few seconds and depends on the seed. The fit of a shading model takes a few
/// seconds too.
///
/// # Errors
/// If the material has a value that is not finite, no network or shading model can be fitted to it, or `as_fitted` is true for a
/// format of parameters.
pub fn encode(
    material: &dyn Material,
    format: OutputFormat,
    name: &str,
    seed: u64,
    as_fitted: bool,
) -> Result<Encoded, ConversionError> {
    if as_fitted && !format.is_table() {
        return Err(ConversionError::AsFitted(format));
    }
    let unchanged = |files| Encoded {
        files,
        shading: None,
        is_changed: false,
    };
    match format {
        OutputFormat::Brdf(Format::Nbrdf) => {
            let network = match material.network() {
                Some(network) => network,
                None => fit_network(material, seed)?,
            };
            let files = to_nbrdf(&network).into_iter();
            let files = files.map(|(suffix, bytes)| (format!("{name}{suffix}"), bytes));
            Ok(unchanged(files.collect()))
        }
        OutputFormat::Brdf(format) => {
            let has_bands = matches!(
                format,
                Format::RglSpectra | Format::OpenMaterial | Format::Ssdd
            );
            let spectrum = material.spectrum().filter(|_| has_bands);
            let groups: Vec<_> = spectrum.iter().flat_map(|bands| bands.groups()).collect();
            let in_rgb = Physical::as_fitted(material);
            let brdfs: Vec<&dyn Brdf> = match spectrum {
                Some(_) => groups.iter().map(|group| group as &dyn Brdf).collect(),
                None => vec![&in_rgb],
            };
            let physical = match as_fitted {
                true => Physical::as_fitted,
                false => Physical::of,
            };
            let tables: Vec<Physical<'_>> = brdfs.into_iter().map(physical).collect();
            let wavelengths = spectrum.map_or(&[][..], |spectrum| spectrum.wavelengths());
            Ok(Encoded {
                is_changed: tables.iter().any(Physical::is_changed),
                ..unchanged(table(material, wavelengths, &tables, format, name)?)
            })
        }
        OutputFormat::Shading(model) => {
            let shading = shading::fit(material, model)?;
            let metrics = compare(&shading, material)?;
            let file = shading.to_file(name, &metrics);
            Ok(Encoded {
                shading: Some(WrittenErrors {
                    loss: metrics.loss,
                    delta_e: Some(metrics.delta_e),
                    before: PhysicalErrors::of(material),
                    after: PhysicalErrors::of(&shading),
                }),
                ..unchanged(vec![(format!("{name}{}", model.suffix()), file)])
            })
        }
    }
}

/// Returns the files of a table. Without wavelengths, `brdfs` is the material in RGB. With wavelengths in nm, it has a BRDF for
/// each three of them.
fn table(
    material: &dyn Material,
    wavelengths: &[f32],
    brdfs: &[Physical<'_>],
    format: Format,
    name: &str,
) -> Result<Vec<(String, Vec<u8>)>, ConversionError> {
    let groups: Vec<&dyn Brdf> = brdfs.iter().map(|brdf| brdf as &dyn Brdf).collect();
    let in_rgb = groups[0];
    let tensors = |brdf: &dyn Brdf, suffix: &str, colors: Colors<'_>| {
        let version = env!("CARGO_PKG_VERSION");
        let description = format!("{}, by glimpse-trainer {version}", material.name());
        let bytes = to_rgl(&description, brdf, colors)?;
        Ok::<_, ConversionError>((format!("_{suffix}.bsdf"), bytes))
    };
    let (suffix, bytes) = match format {
        Format::Merl => (".binary".to_owned(), to_merl(in_rgb)?),
        Format::Rgl => tensors(in_rgb, "rgb", Colors::Rgb)?,
        Format::RglSpectra if wavelengths.is_empty() => tensors(in_rgb, "spec", Colors::Spectra)?,
        Format::RglSpectra => {
            let colors = Colors::Bands(wavelengths, &groups);
            tensors(&Physical::as_fitted(material), "spec", colors)?
        }
        Format::OpenMaterial => {
            let bytes = to_open_material(name, wavelengths, &groups)?;
            ("_brdf.xompt".to_owned(), bytes)
        }
        Format::Ssdd => (".ssdd".to_owned(), to_ssdd(name, wavelengths, &groups)?),
        Format::Pab => {
            let texts = to_pab(name, in_rgb)?.into_iter().map(String::into_bytes);
            let names = pab_suffixes().map(|suffix| format!("{name}{suffix}"));
            return Ok(names.zip(texts).collect());
        }
        Format::Nbrdf => return Err(ConversionError::NotNetworkFile(name.into())),
    };
    Ok(vec![(format!("{name}{suffix}"), bytes)])
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
