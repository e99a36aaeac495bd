//! Formats of materials' files, told by what is in them.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::error::refused;
use crate::pab;
use crate::{MerlTable, NeuralBrdf, RglMeasurement, SourceError};

/// How many bytes of a file are looked at.
const HEAD: u64 = 2048;

/// A format that materials are read and written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// MERL: a table of 90 x 90 x 180 measurements.
    Merl,
    /// RGL: a tensor file, in RGB.
    Rgl,
    /// NBRDF: a network in six arrays of NumPy's.
    Nbrdf,
    /// PAB-Opto's text, a file for each incoming direction.
    Pab,
}

impl Format {
    /// In a word: merl, rgl, nbrdf or pab.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Merl => "merl",
            Self::Rgl => "rgl",
            Self::Nbrdf => "nbrdf",
            Self::Pab => "pab",
        }
    }

    /// By the first bytes of a file, whatever it is called. One that begins like none of them is taken
    /// at its ending's word, so that its reader says what is wrong with it. (Arrays of a network
    /// belong together by their names alone.)
    ///
    /// # Errors
    /// If the file cannot be read, or is none of these.
    pub fn detect(path: &Path) -> Result<Self, SourceError> {
        if NeuralBrdf::name_of(path).is_some() {
            return Ok(Self::Nbrdf);
        }
        if !path.is_file() {
            return Err(SourceError::UnknownFormat(path.into()));
        }
        let mut head = Vec::new();
        let file = File::open(path).map_err(refused(path))?;
        file.take(HEAD)
            .read_to_end(&mut head)
            .map_err(refused(path))?;
        if RglMeasurement::begins(&head) {
            return Ok(Self::Rgl);
        }
        if MerlTable::begins(&head) {
            return Ok(Self::Merl);
        }
        if pab::begins(&head) {
            return Ok(Self::Pab);
        }
        if let Some(what) = dialect(&head) {
            return Err(SourceError::Damaged {
                path: path.into(),
                what: what.to_owned(),
            });
        }
        match path.extension().and_then(|ending| ending.to_str()) {
            Some("binary") => Ok(Self::Merl),
            Some("bsdf") => Ok(Self::Rgl),
            _ => Err(SourceError::UnknownFormat(path.into())),
        }
    }
}

/// What a file is that is known and not read, and the remedy.
fn dialect(head: &[u8]) -> Option<&'static str> {
    if head.starts_with(b"SCATFUN") {
        return Some(
            "it is a Fourier series as layerlab writes and pbrt reads, a .bsdf of another kind than \
             RGL's, and is not read; tabulate it there as MERL's NAME.binary",
        );
    }
    if head.starts_with(b"\x93NUMPY") {
        return Some(
            "it is an array of NumPy's that is not named as one of a network's six; name them \
             NAME_fc1.npy, _b1, _fc2, _b2, _fc3 and _b3",
        );
    }
    if head.starts_with(b"\x89HDF") {
        return Some("it is an HDF5 file, which is not read; tabulate it as MERL's NAME.binary");
    }
    let text = head
        .strip_prefix(b"\xef\xbb\xbf")
        .unwrap_or(head)
        .trim_ascii_start();
    if text.starts_with(b"<") {
        return Some(
            "it is XML, as Radiance and WINDOW have BSDFs, which is not read; tabulate it as MERL's \
             NAME.binary",
        );
    }
    // Comments may come before the line that says where it was measured.
    let mut lines = text.split(|byte| *byte == b'\n').map(<[u8]>::trim_ascii);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with(b"#"))?;
    first.starts_with(b"Source").then_some(
        "it is a text as Zemax reads, a .bsdf of another kind than RGL's, and is not read; tabulate \
         it as MERL's NAME.binary",
    )
}
