//! Formats that are not read, recognized by the first bytes of a file, so that errors name them and a remedy.

use std::path::Path;

use crate::error::{CONVERT, Defect};
use crate::untrusted::escaped;

/// The remedy for networks of Neural-BRDF in Keras's formats.
pub(super) const SAVE_WEIGHTS: &str = "save the weights in the .h5 file as NAME_fc1.npy and its five siblings, as `h5_to_npy.py` of Neural-BRDF does";
const EXTRACT: &str = "extract it, and give an extracted file or the directory";
const SPEOS: &str = "a surface file of Speos";
/// Extensions of surface files of Speos, whose binary forms have no signature.
const SPEOS_EXTENSIONS: [&str; 7] = [
    "brdf",
    "anisotropicbsdf",
    "bsdf180",
    "simplescattering",
    "scattering",
    "unpolished",
    "coated",
];

/// Binary formats: the first bytes, the name and the remedy.
const BINARY: [(&[u8], &str, &str); 12] = [
    (
        b"\x89HDF",
        "an HDF5 file, such as a network of Neural-BRDF from Keras",
        SAVE_WEIGHTS,
    ),
    (
        b"\x93NUMPY",
        "a NumPy array without the name of an NBRDF array",
        "rename it to NAME_fc1.npy, _b1, _fc2, _b2, _fc3 or _b3, next to the five others",
    ),
    (
        b"PK\x03\x04",
        "a ZIP archive, such as an Excel workbook, a .npz or a PyTorch .pt",
        "extract it; save a workbook as CSV, and weights as NAME_fc1.npy and its five siblings",
    ),
    (b"\x1f\x8b", "a gzip archive", EXTRACT),
    (b"BZh", "a bzip2 archive", EXTRACT),
    (b"\xfd7zXZ", "an xz archive", EXTRACT),
    (b"7z\xbc\xaf", "a 7z archive", EXTRACT),
    (b"\x28\xb5\x2f\xfd", "a zstd archive", EXTRACT),
    (b"Rar!", "a RAR archive", EXTRACT),
    (
        b"SCATFUN",
        "a Fourier BSDF (layerlab, pbrt) and not an RGL .bsdf",
        CONVERT,
    ),
    (b"NVIDIA ARC MBSDF", "an MBSDF file of MDL", CONVERT),
    (b"MATLAB", "a MATLAB file", CONVERT),
];
/// Text formats: the start of the first line that is not a comment, and the name.
const TEXTS: [(&str, &str); 5] = [
    ("<", "an XML BSDF (Radiance, WINDOW)"),
    ("Source", "a Zemax BSDF and not an RGL .bsdf"),
    ("OPTIS -", SPEOS),
    ("analytic", "a shader of BRDF Explorer"),
    (
        "{",
        "a JSON file (a material.json of `trainer fit` needs the extension .json)",
    ),
];

/// Returns the name of a binary format, with an article, if a file of it starts with these bytes.
#[must_use]
pub fn binary_format(bytes: &[u8]) -> Option<&'static str> {
    binary(bytes).map(|(_, format, _)| *format)
}

fn binary(bytes: &[u8]) -> Option<&'static (&'static [u8], &'static str, &'static str)> {
    BINARY.iter().find(|(start, ..)| bytes.starts_with(start))
}

/// Recognizes a file that is not a material by its first bytes, or else by its extension.
pub(super) fn detect(path: &Path, head: &[u8]) -> Option<Defect> {
    let other_form = |format: &str, remedy| {
        Some(Defect::Unsupported(
            format!("it is {format}, and is not supported"),
            remedy,
        ))
    };
    if let Some((_, format, remedy)) = binary(head) {
        return other_form(format, remedy);
    }
    // The head may end within a character.
    let text = String::from_utf8_lossy(head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head));
    // Comments may precede the line `Source  Measured` of a Zemax file.
    let mut lines = text.lines().map(str::trim);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with('#'))?;
    if let Some((_, format)) = TEXTS.iter().find(|(start, _)| first.starts_with(start)) {
        return other_form(format, CONVERT);
    }
    if !text.contains(|c: char| c.is_control() && !c.is_whitespace()) {
        return Some(Defect::Unsupported(
            format!(
                "it is a text of an unknown format, which starts with `{}`",
                escaped(first)
            ),
            "give PAB-Opto text, a material.json of `trainer fit`, or a MERL table NAME.binary",
        ));
    }
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    let is_speos = SPEOS_EXTENSIONS.iter().any(|other| extension == *other);
    is_speos.then(|| other_form(SPEOS, CONVERT)).flatten()
}
