//! Errors while reading materials, and values that cannot be written.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use glimpse_core::geometry::Angles;
use memmap2::{Mmap, MmapOptions};

use crate::Coverage;
use crate::untrusted::read_at_most;

/// The largest COUNT of `procedural:COUNT`.
pub(super) const MAX_PROCEDURAL: u64 = 100_000;
/// All kinds of sources.
const MATERIALS: &str = "a file of MERL (NAME.binary), RGL (NAME.bsdf), NBRDF (NAME_fc1.npy and its five siblings), SSDD \
                         (NAME.ssdd), OpenMATERIAL (NAME_brdf.xompt) or PAB-Opto, a fitted material.json, a directory \
                         of those, or procedural[:COUNT[:SEED]]";

/// An error while reading materials.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// The operating system cannot read a path.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file or directory.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
    /// A file is damaged, or its form is not supported.
    #[error("{}: {defect}", path.display())]
    Rejected {
        /// The file.
        path: PathBuf,
        /// The defect.
        defect: Defect,
    },
    /// No file or directory has this path.
    #[error("{} does not exist; give {MATERIALS}", .0.display())]
    NotFound(PathBuf),
    /// A file has no known format.
    #[error("{} is not a material: it starts with `{start}`; give {MATERIALS}", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// Its first bytes, with those escaped that are not ASCII text.
        start: String,
    },
    /// Two materials have the same name.
    #[error(
        "{} and {} both hold a material named {name}; rename or remove one of them", first.display(), second.display()
    )]
    DuplicateName {
        /// The name.
        name: String,
        /// The first file or source.
        first: PathBuf,
        /// The second file or source.
        second: PathBuf,
    },
    /// The BRDF is unknown at some directions.
    #[error(
        "{name}: {coverage}, and this needs all; add files of more incoming or outgoing directions, or give the BRDF that \
         `trainer query` returns to `trainer fit`"
    )]
    Incomplete {
        /// The name of the material.
        name: String,
        /// The directions at which it was measured.
        coverage: Coverage,
    },
    /// A directory without materials.
    #[error("{} holds no materials; give {MATERIALS}", .0.display())]
    Empty(PathBuf),
    /// A source `procedural:...` whose COUNT or SEED is invalid.
    #[error(
        "`{0}` is not a valid source; write procedural, procedural:COUNT or procedural:COUNT:SEED, with a COUNT of 1 \
         to {MAX_PROCEDURAL}"
    )]
    InvalidProcedural(String),
}

/// An infinite or NaN value of a BRDF. It prevents writing the BRDF as a material.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "the BRDF is {} at theta_h {:.2}, theta_d {:.2} and phi_d {:.2} degrees, and only finite values can be written; \
     fit the material again, or fit it to other readings", .value, .angles[0], .angles[1], .angles[2]
)]
pub struct NotFinite {
    /// The value.
    pub value: f32,
    /// theta_h, theta_d and phi_d, in degrees.
    pub angles: [f32; 3],
}

impl NotFinite {
    /// Returns a BRDF as files have it, with 0 for negative values. `angles` are in radians.
    ///
    /// # Errors
    /// The first channel that is infinite or NaN.
    pub fn check(angles: Angles<f32>, brdf: [f32; 3]) -> Result<[f32; 3], Self> {
        let angles = angles.to_array().map(f32::to_degrees);
        match brdf.into_iter().find(|value| !value.is_finite()) {
            Some(value) => Err(Self { value, angles }),
            // The sum replaces -0 by 0.
            None => Ok(brdf.map(|value| value.max(0.0) + 0.0)),
        }
    }
}

/// Returns a function that converts an I/O error at a path to a [`SourceError::Read`].
pub(super) fn read_error(path: &Path) -> impl Fn(io::Error) -> SourceError {
    move |source| SourceError::Read {
        path: path.into(),
        source,
    }
}

/// Returns the paths of all entries of a directory.
pub(super) fn entries(directory: &Path) -> Result<Vec<PathBuf>, SourceError> {
    let entries = directory.read_dir().map_err(read_error(directory))?;
    let paths = entries.map(|entry| Ok(entry.map_err(read_error(directory))?.path()));
    paths.collect()
}

/// Reads a text of up to `max_bytes` bytes.
pub(super) fn read_text(path: &Path, max_bytes: u64) -> Result<String, SourceError> {
    let bytes = read_at_most(path, max_bytes).map_err(read_error(path))?;
    String::from_utf8(bytes).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        Defect::in_file(path)(format!("it is not UTF-8 text from byte {valid} on"))
    })
}

/// Maps a file. Nothing is allocated, and pages are read on first access. If the map is made writable, changes stay in
/// memory.
pub(super) fn map_file(path: &Path) -> Result<Mmap, SourceError> {
    let file = File::open(path).map_err(read_error(path))?;
    // SAFETY: every use copies the mapped bytes and accepts any value. One risk remains for every mapped file: if
    // another program truncates it, the operating system stops this process.
    unsafe { MmapOptions::new().map_copy_read_only(&file) }.map_err(read_error(path))
}

/// A defect of a file, and its remedy.
#[derive(Debug, thiserror::Error)]
#[error("{defect}; {remedy}")]
pub struct Defect {
    defect: String,
    remedy: &'static str,
}

/// Makes the defect of a damaged file.
impl<T: Into<String>> From<T> for Defect {
    fn from(defect: T) -> Self {
        Self::new(
            defect,
            "replace the file with an intact copy, or write it again in this form",
        )
    }
}

impl Defect {
    pub(super) fn new(defect: impl Into<String>, remedy: &'static str) -> Self {
        let defect = defect.into();
        Self { defect, remedy }
    }

    /// Makes the defect of an intact file whose form is not supported.
    pub(super) fn unsupported(defect: impl Into<String>) -> Self {
        Self::new(
            defect,
            "convert it to a MERL table NAME.binary, or remove it",
        )
    }

    /// Returns a function that converts a defect of a file to a [`SourceError`].
    pub(super) fn in_file<D: Into<Self>>(path: &Path) -> impl Fn(D) -> SourceError {
        let path = path.to_owned();
        move |defect| SourceError::Rejected {
            path: path.clone(),
            defect: defect.into(),
        }
    }
}

/// Returns a defect from the function unless a condition holds.
macro_rules! ensure {
    ($condition:expr, $($message:tt)+) => {
        if !$condition {
            return Err(format!($($message)+).into());
        }
    };
}
pub(super) use ensure;
