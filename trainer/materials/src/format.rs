//! Material file formats, detected from the content of a file.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::error::{Defect, read_error};
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
            return Err(Defect::in_file(path)(defect));
        }
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("binary") => Ok(Self::Merl),
            Some("bsdf") => Ok(Self::Rgl),
            _ => Err(SourceError::UnknownFormat(path.into())),
        }
    }
}

/// The first bytes of formats that are not supported.
const UNSUPPORTED: [(&[u8], &str); 5] = [
    (
        b"SCATFUN",
        "a Fourier BSDF (layerlab, pbrt) and not an RGL .bsdf",
    ),
    (
        b"\x93NUMPY",
        "a NumPy array without the name of an NBRDF array",
    ),
    (b"\x89HDF", "an HDF5 file"),
    (b"<", "an XML BSDF (Radiance, WINDOW)"),
    (b"Source", "a Zemax BSDF and not an RGL .bsdf"),
];

/// Recognizes formats that are not supported.
fn unsupported_format(head: &[u8]) -> Option<Defect> {
    let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head);
    // Comments may precede the line `Source  Measured` of a Zemax file.
    let mut lines = text.split(|byte| *byte == b'\n').map(<[u8]>::trim_ascii);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with(b"#"))?;
    let (_, format) = UNSUPPORTED
        .iter()
        .find(|(start, _)| first.starts_with(start))?;
    Some(Defect::Unsupported(format!(
        "it is {format}, and is not supported"
    )))
}
