//! Conversion of materials to the formats of other programs: file names and contents.
//!
//! The format NBRDF only holds networks, so a network is fitted to other materials. Shading models of renderers are fitted
//! too. Tables hold a BRDF that is reciprocal and conserves energy, see [`Physical`].

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use clap::ValueEnum;
use clap::builder::PossibleValue;
use glimpse_core::model::{ModelKind, NeuralParameters, ParameterSet};
use glimpse_fitting::choice::Choice;
use glimpse_materials::loss::loss_between;
use glimpse_materials::setting::Name;
use glimpse_materials::{
    Brdf, Format, Material, NotFinite, Physical, PhysicalErrors, Source, SourceError, Tabulation,
    to_nbrdf,
};

use crate::evaluation::{EvaluationError, Method, OPTIMUM_STEPS, compare};
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
        "{} does not have the ending of a format: use .binary, .bsdf, .ssdd, _brdf.xompt, _fc1.npy, .gltf or .mtlx, or give {}",
        .0.display(), Name("format")
    )]
    UnknownEnding(PathBuf),
    /// A path has no file name.
    #[error("{} has no file name; give DIR/NAME", .0.display())]
    Name(PathBuf),
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
    /// Returns true if a file of this format is a table, which can hold any BRDF.
    #[must_use]
    pub fn is_table(self) -> bool {
        matches!(self, Self::Brdf(format) if format.properties().tabulate.is_some())
    }

    /// Returns the requested format, or else that of the ending of a file's name.
    ///
    /// # Errors
    /// If the ending is that of another format, or neither states a format.
    pub fn choose(requested: Option<Self>, path: &Path) -> Result<Self, ConversionError> {
        match (requested, Self::from_ending(path)) {
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
    pub fn from_ending(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_str()?;
        let mut models = ShadingModel::value_variants().iter();
        let model = models.find(|model| name.ends_with(model.suffix()));
        let format = Format::from_ending(path).map(Self::Brdf);
        format.or(model.copied().map(Self::Shading))
    }

    /// Returns the ends of the names of written files, one for each file.
    fn endings(self) -> Vec<&'static str> {
        match self {
            Self::Brdf(format) => format.properties().written.to_vec(),
            Self::Shading(model) => vec![model.suffix()],
        }
    }
}

impl ValueEnum for OutputFormat {
    fn value_variants<'a>() -> &'a [Self] {
        static ALL: LazyLock<Vec<OutputFormat>> = LazyLock::new(|| {
            let brdfs = Format::value_variants().iter().copied();
            let models = ShadingModel::value_variants().iter().copied();
            let brdfs = brdfs.map(OutputFormat::Brdf);
            brdfs.chain(models.map(OutputFormat::Shading)).collect()
        });
        &ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        match self {
            Self::Brdf(format) => format.to_possible_value(),
            Self::Shading(model) => model.to_possible_value(),
        }
    }
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

/// Returns the paths of a material's files. `path` is the only file, or one of several files, or their common prefix.
///
/// # Errors
/// If the path has no file name.
pub fn output_paths(format: OutputFormat, path: &Path) -> Result<Vec<PathBuf>, ConversionError> {
    let endings = format.endings();
    if endings.len() == 1 {
        return Ok(vec![path.to_owned()]);
    }
    let name = file_name(path)?;
    let prefix = endings.iter().find_map(|ending| name.strip_suffix(ending));
    let prefix = prefix.unwrap_or(name);
    let names = endings.iter().map(|ending| format!("{prefix}{ending}"));
    Ok(names.map(|name| path.with_file_name(name)).collect())
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
    let encoded = |files: Vec<Vec<u8>>| {
        let names = format.endings().into_iter();
        let names = names.map(|ending| format!("{name}{ending}"));
        Encoded {
            files: names.zip(files).collect(),
            shading: None,
            is_changed: false,
        }
    };
    match format {
        OutputFormat::Brdf(format) => {
            let Some(tabulate) = format.properties().tabulate else {
                let network = match material.network() {
                    Some(network) => network,
                    None => fit_network(material, seed)?,
                };
                return Ok(encoded(to_nbrdf(&network).to_vec()));
            };
            let spectrum = material
                .spectrum()
                .filter(|_| format.properties().has_spectra);
            let groups: Vec<_> = spectrum.iter().flat_map(|bands| bands.groups()).collect();
            let in_rgb = Physical::as_fitted(material);
            let physical = if as_fitted {
                Physical::as_fitted
            } else {
                Physical::of
            };
            let tables: Vec<Physical<'_>> = match spectrum {
                Some(_) => groups.iter().map(|group| physical(group)).collect(),
                None => vec![physical(&in_rgb)],
            };
            let groups: Vec<&dyn Brdf> = tables.iter().map(|brdf| brdf as &dyn Brdf).collect();
            let table = Tabulation {
                name,
                rgb: spectrum.map_or(groups[0], |_| &in_rgb),
                wavelengths: spectrum.map_or(&[], |spectrum| spectrum.wavelengths()),
                groups: &groups,
            };
            Ok(Encoded {
                is_changed: tables.iter().any(Physical::is_changed),
                ..encoded(tabulate(&table)?)
            })
        }
        OutputFormat::Shading(model) => {
            let shading = shading::fit(material, model)?;
            let metrics = compare(&shading, material);
            let file = shading.to_file(name, &metrics);
            Ok(Encoded {
                shading: Some(WrittenErrors {
                    loss: metrics.loss,
                    delta_e: Some(metrics.delta_e),
                    before: PhysicalErrors::of(material),
                    after: PhysicalErrors::of(&shading),
                }),
                ..encoded(vec![file])
            })
        }
    }
}

/// Fits a network to a material.
fn fit_network(
    material: &dyn Material,
    seed: u64,
) -> Result<NeuralParameters<f32>, ConversionError> {
    let optimum = Method::optimum(ModelKind::Neural, OPTIMUM_STEPS).fit(material, seed)?;
    let network = NeuralParameters::view(&optimum.values).cloned();
    network.ok_or(EvaluationError::Diverged.into())
}
