//! Material file formats, detected from the content of a file.

use std::path::Path;

use crate::error::{Defect, read_error};
use crate::name::has_extension;
use crate::untrusted::read_head;
use crate::{MerlTable, NeuralBrdf, RglMeasurement, SourceError};
use crate::{other_format, pab, ssdd};

/// The number of bytes at the start of a file that detection reads.
const HEAD_BYTES: u64 = 2048;

/// A file format that materials are read from and written to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// MERL: a table of 90 x 90 x 180 values per channel.
    Merl,
    /// RGL: a tensor file, in RGB.
    Rgl,
    /// RGL: a tensor file of spectra.
    RglSpectra,
    /// NBRDF: a network in six NumPy arrays.
    Nbrdf,
    /// PAB-Opto text, one file per incoming direction.
    Pab,
    /// A BRDF look-up table of ASAM OpenMATERIAL 3D.
    OpenMaterial,
    /// SSDD, the text format of libbsdf.
    Ssdd,
}

impl Format {
    /// Returns the name: merl, rgl, rgl-spectral, nbrdf, pab, openmaterial or ssdd.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Merl => "merl",
            Self::Rgl => "rgl",
            Self::RglSpectra => "rgl-spectral",
            Self::Nbrdf => "nbrdf",
            Self::Pab => "pab",
            Self::OpenMaterial => "openmaterial",
            Self::Ssdd => "ssdd",
        }
    }

    /// Detects the format of a file from its first bytes. NBRDF arrays are recognized by their names.
    ///
    /// If the bytes match no format, the extension decides, so that the reader reports the error in the file.
    ///
    /// # Errors
    /// If the file cannot be read or has none of these formats.
    pub fn detect(path: &Path) -> Result<Self, SourceError> {
        if NeuralBrdf::name_of(path).is_some() {
            return Ok(Self::Nbrdf);
        }
        if has_extension(path, "xompt") {
            return Ok(Self::OpenMaterial);
        }
        if !path.is_file() {
            return Err(SourceError::UnknownFormat(path.into()));
        }
        let head = read_head(path, HEAD_BYTES).map_err(read_error(path))?;
        if RglMeasurement::has_signature(&head) {
            return Ok(match RglMeasurement::has_spectra(&head) {
                true => Self::RglSpectra,
                false => Self::Rgl,
            });
        }
        if MerlTable::has_signature(&head) {
            return Ok(Self::Merl);
        }
        if pab::has_signature(&head) {
            return Ok(Self::Pab);
        }
        if ssdd::has_signature(&head) {
            return Ok(Self::Ssdd);
        }
        if let Some(defect) = other_format::detect(path, &head) {
            return Err(Defect::in_file(path)(defect));
        }
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("binary") => Ok(Self::Merl),
            Some("bsdf") => Ok(Self::Rgl),
            _ => Err(SourceError::UnknownFormat(path.into())),
        }
    }
}
