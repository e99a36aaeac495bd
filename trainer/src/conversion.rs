//! Materials in the formats of other programs: which files, and what is in them.
//!
//! A network is fitted to a material where the format holds nothing else.

use std::path::{Path, PathBuf};

use glimpse_core::model::{ModelKind, NeuralParameters};
use glimpse_materials::loss::loss_between;
use glimpse_materials::{
    Format, Material, NeuralBrdf, NotFinite, Source, SourceError, pab_endings, to_merl, to_nbrdf,
    to_pab, to_rgl,
};

use crate::evaluation::{EvaluationError, Method, OPTIMUM_STEPS};

/// Why a material is not written in a format.
#[derive(Debug, thiserror::Error)]
pub enum ConversionError {
    /// It has no finite value somewhere.
    #[error(transparent)]
    NotFinite(#[from] NotFinite),
    /// No network can be fitted to it.
    #[error(transparent)]
    Fit(#[from] EvaluationError),
    /// A network was fitted, and is of no use.
    #[error("no network could be fitted: give another seed")]
    NoNetwork,
    /// What was written cannot be read.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// A path is no name of files.
    #[error("{} is no name of files: give DIR/NAME", .0.display())]
    Name(PathBuf),
    /// A path ends as a network's files do, and is none of them.
    #[error("{} is none of a network's six files: name it NAME_fc1.npy, or NAME", .0.display())]
    NoneOfSix(PathBuf),
}

/// The format that a file's ending stands for: `.binary`, `.bsdf` or `.npy`; None of others.
#[must_use]
pub fn format_of_ending(path: &Path) -> Option<Format> {
    match path.extension()?.to_str()? {
        "binary" => Some(Format::Merl),
        "bsdf" => Some(Format::Rgl),
        "npy" => Some(Format::Nbrdf),
        _ => None,
    }
}

/// The files of a material that is written to a path: for NBRDF it is one of the six, or what their
/// names begin with, for PAB-Opto's text the latter.
///
/// # Errors
/// If it is no such name.
pub fn paths(format: Format, path: &Path) -> Result<Vec<PathBuf>, ConversionError> {
    match format {
        Format::Merl | Format::Rgl => Ok(vec![path.to_owned()]),
        Format::Pab => {
            let name = name_of(path)?;
            let names = pab_endings().map(|ending| format!("{name}{ending}"));
            Ok(names.map(|name| path.with_file_name(name)).collect())
        }
        Format::Nbrdf => {
            if let Some(six) = NeuralBrdf::files_of(path) {
                return Ok(six.to_vec());
            }
            if path.extension().is_some_and(|ending| ending == "npy") {
                return Err(ConversionError::NoneOfSix(path.into()));
            }
            let first = format!("{}_fc1.npy", name_of(path)?);
            let six = NeuralBrdf::files_of(&path.with_file_name(first));
            Ok(six.into_iter().flatten().collect())
        }
    }
}

/// What the names of several files begin with.
///
/// # Errors
/// If a path has no name.
pub fn name_of(path: &Path) -> Result<&str, ConversionError> {
    let name = path.file_name().and_then(|name| name.to_str());
    name.ok_or_else(|| ConversionError::Name(path.into()))
}

/// A material's files in a format: their names, as of a material of that name, and their bytes, in the
/// order of [`paths`]. The seed is of the network that is fitted where the format holds one and the
/// material is none; it takes some seconds.
///
/// # Errors
/// If the material has a value that is not finite, or no network can be fitted to it.
pub fn files_of(
    material: &dyn Material,
    format: Format,
    name: &str,
    seed: u64,
) -> Result<Vec<(String, Vec<u8>)>, ConversionError> {
    Ok(match format {
        Format::Merl => vec![(format!("{name}.binary"), to_merl(material)?)],
        Format::Rgl => {
            let version = env!("CARGO_PKG_VERSION");
            let description = format!("{}, by glimpse-trainer {version}", material.name());
            vec![(format!("{name}_rgb.bsdf"), to_rgl(&description, material)?)]
        }
        Format::Nbrdf => {
            let network = match material.network() {
                Some(network) => network,
                None => fit_network(material, seed)?,
            };
            let six = to_nbrdf(&network).into_iter();
            six.map(|(ending, bytes)| (format!("{name}{ending}"), bytes))
                .collect()
        }
        Format::Pab => {
            let texts = to_pab(name, material)?.into_iter();
            let names = pab_endings().map(|ending| format!("{name}{ending}"));
            names.zip(texts.map(String::into_bytes)).collect()
        }
    })
}

/// What a file of a material loses against it: mean cosine-weighted logarithmic error.
///
/// # Errors
/// If it cannot be read.
pub fn loss_of(material: &dyn Material, file: &Path) -> Result<f64, ConversionError> {
    let written = Source(file.display().to_string()).load()?;
    let written = written.first().ok_or(SourceError::Empty(file.into()))?;
    Ok(loss_between(&**written, material))
}

/// The best network that descent finds for a material.
fn fit_network(
    material: &dyn Material,
    seed: u64,
) -> Result<NeuralParameters<f32>, ConversionError> {
    let fitted = Method::optimum(ModelKind::Neural, OPTIMUM_STEPS).fit(material, seed)?;
    let is_finite = fitted.values().iter().all(|weight| weight.is_finite());
    let network = fitted.network().filter(|_| is_finite);
    network.ok_or(ConversionError::NoNetwork)
}

#[cfg(test)]
mod tests {
    use glimpse_materials::{Procedural, RglMeasurement};
    use glimpse_training::linear::{Columns, principal_components};

    use super::*;

    #[test]
    fn fits_of_every_model_keep_their_loss_in_a_tensor_file() {
        let material = Procedural::set(3, 8).remove(2);
        let directory = tempfile::tempdir().expect("a temporary directory");
        let others: Vec<Box<dyn Material>> = Procedural::set(2, 9)
            .into_iter()
            .map(|each| Box::new(each) as _)
            .collect();
        let columns = Columns::new(&others);
        let all: Vec<usize> = (0..columns.count()).collect();
        let basis = principal_components(&columns, &all, 4);
        for method in [
            Method::optimum(ModelKind::Phong, 500),
            Method::optimum(ModelKind::CookTorrance, 500),
            Method::optimum(ModelKind::Neural, 500),
            Method::linear_optimum(&basis, 40.0),
        ] {
            let model = method.model();
            let fitted = method.fit(&material, 1).expect("it can be fitted");
            let path = directory.path().join("written_rgb.bsdf");
            let bytes = to_rgl("a fit", &fitted).expect("it is finite");
            std::fs::write(&path, bytes).expect("it is written");
            let read = RglMeasurement::read(&path).expect("it is read");
            let before = loss_between(&fitted, &material);
            let after = loss_between(&read as &dyn Material, &material);
            assert!(after < 1.02 * before, "{model:?}: {before} became {after}");
        }
    }
}
