//! Formats of materials, as named on the command line.

use std::path::PathBuf;

use glimpse_materials::{Format, Material};
use glimpse_trainer::conversion::{self, ConversionError};

/// An output format of materials.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum FormatName {
    /// NAME.binary: MERL's table of 90 x 90 x 180 values, 33 MiB.
    Merl,
    /// NAME_fc1.npy and its five siblings: a network of 675 weights.
    Nbrdf,
    /// NAME_rgb.bsdf: a tensor file for Mitsuba 3's plugin `measured`, 12 MB.
    Rgl,
    /// NAME_in00.txt, NAME_in10.txt, ...: PAB-Opto's text files, for Radiance's pabopto2bsdf.
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

/// A group of files that are written together: their paths and contents.
pub(super) type Files = Vec<(PathBuf, Vec<u8>)>;

/// Calls [`conversion::encode`]. Prints a message first if the conversion takes seconds.
pub(super) fn files_of(
    material: &dyn Material,
    format: Format,
    name: &str,
    seed: u64,
) -> Result<Vec<(String, Vec<u8>)>, ConversionError> {
    if format == Format::Nbrdf && material.network().is_none() {
        eprintln!("fitting a network to {}", material.name());
    }
    conversion::encode(material, format, name, seed)
}
