//! Formats that materials are written in, as named on the command line.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use glimpse_core::model::{ModelKind, Neural, NeuralParameters, ParameterSet};
use glimpse_trainer::evaluation::{Fitted, Method, OPTIMUM_STEPS, loss_between};
use glimpse_trainer::material::{
    Format, Material, Source, pab_endings, to_merl, to_nbrdf, to_pab, to_rgl,
};

/// The formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum FormatName {
    /// NAME.binary: MERL's table of 90 x 90 x 180 values, 33 MiB.
    Merl,
    /// NAME_fc1.npy and its five siblings: a network of 675 weights.
    Nbrdf,
    /// NAME_rgb.bsdf: a tensor file that Mitsuba 3 renders as its `measured`, 12 MB.
    Rgl,
    /// NAME_in00.txt, NAME_in10.txt, ...: PAB-Opto's text, of which pabopto2bsdf makes what Radiance
    /// reads.
    Pab,
}

impl From<FormatName> for Format {
    fn from(name: FormatName) -> Self {
        match name {
            FormatName::Merl => Self::Merl,
            FormatName::Nbrdf => Self::Nbrdf,
            FormatName::Rgl => Self::Rgl,
            FormatName::Pab => Self::Pab,
        }
    }
}

/// Files that belong together, ready to be written.
pub(super) type Files = Vec<(PathBuf, Vec<u8>)>;

/// A material's files in a format: their names, as of a material of that name, and their bytes.
pub(super) fn files_of(
    material: &dyn Material,
    format: Format,
    name: &str,
    seed: u64,
) -> anyhow::Result<Vec<(String, Vec<u8>)>> {
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

/// What a file of a material loses against it.
pub(super) fn loss_of(material: &dyn Material, file: &Path) -> anyhow::Result<f64> {
    let written = Source(file.display().to_string()).load()?;
    let written = written.first().context("nothing was written")?;
    Ok(loss_between(&**written, material))
}

/// The best network that descent finds for a material.
fn fit_network(material: &dyn Material, seed: u64) -> anyhow::Result<NeuralParameters<f32>> {
    eprintln!("fitting a network");
    let fitted = Method::optimum(ModelKind::Neural, OPTIMUM_STEPS).fit(material, seed)?;
    let Fitted::Parameters { parameters, .. } = fitted else {
        bail!("the fit has no parameters");
    };
    ensure!(
        parameters.iter().all(|weight| weight.is_finite()),
        "no network could be fitted: give another --seed"
    );
    let mut network = <Neural as glimpse_core::model::Model>::Parameters::filled(0.0);
    for (weight, fitted) in network.iter_mut().zip(parameters) {
        *weight = fitted;
    }
    Ok(network)
}
