//! Material file formats, detected from the content of a file.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::error::read_error;
use crate::pab;
use crate::{MerlTable, NeuralBrdf, RglMeasurement, SourceError};

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
}

impl Format {
    /// Returns the name: merl, rgl, rgl-spectral, nbrdf or pab.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Merl => "merl",
            Self::Rgl => "rgl",
            Self::RglSpectra => "rgl-spectral",
            Self::Nbrdf => "nbrdf",
            Self::Pab => "pab",
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
        if !path.is_file() {
            return Err(SourceError::UnknownFormat(path.into()));
        }
        let mut head = Vec::new();
        let file = File::open(path).map_err(read_error(path))?;
        file.take(HEAD_BYTES)
            .read_to_end(&mut head)
            .map_err(read_error(path))?;
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
        if let Some(defect) = unsupported_format(&head) {
            return Err(SourceError::Damaged {
                path: path.into(),
                defect: defect.to_owned(),
            });
        }
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("binary") => Ok(Self::Merl),
            Some("bsdf") => Ok(Self::Rgl),
            _ => Err(SourceError::UnknownFormat(path.into())),
        }
    }
}

/// Recognizes formats that are not supported. Returns the actual format and the remedy.
fn unsupported_format(head: &[u8]) -> Option<&'static str> {
    if head.starts_with(b"SCATFUN") {
        return Some(
            "it is a Fourier BSDF (layerlab, pbrt) and not an RGL .bsdf, and is not supported; convert it to a MERL \
             table NAME.binary",
        );
    }
    if head.starts_with(b"\x93NUMPY") {
        return Some(
            "it is a NumPy array whose name is not that of an NBRDF network; name the six arrays NAME_fc1.npy, _b1, \
             _fc2, _b2, _fc3 and _b3",
        );
    }
    if head.starts_with(b"\x89HDF") {
        return Some(
            "it is an HDF5 file, which is not supported; convert it to a MERL table NAME.binary",
        );
    }
    let text = head
        .strip_prefix(b"\xef\xbb\xbf")
        .unwrap_or(head)
        .trim_ascii_start();
    if text.starts_with(b"<") {
        return Some(
            "it is an XML BSDF (Radiance, WINDOW), which is not supported; convert it to a MERL table NAME.binary",
        );
    }
    // Comments may precede the line `Source  Measured`.
    let mut lines = text.split(|byte| *byte == b'\n').map(<[u8]>::trim_ascii);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with(b"#"))?;
    first.starts_with(b"Source").then_some(
        "it is a Zemax BSDF and not an RGL .bsdf, and is not supported; convert it to a MERL table NAME.binary",
    )
}
