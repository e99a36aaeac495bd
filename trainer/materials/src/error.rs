//! Errors while reading and writing materials.

use std::io;
use std::path::{Path, PathBuf};

use glimpse_core::geometry::Angles;

/// The largest COUNT of `procedural:COUNT`.
pub(super) const MAX_PROCEDURAL: usize = 100_000;

/// An error while reading or writing materials.
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
    /// The operating system cannot write a file.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
    /// A file is damaged, or of an unsupported kind.
    #[error("{}: {defect}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The defect and the remedy.
        defect: String,
    },
    /// No file or directory has this path.
    #[error(
        "{} does not exist; give a directory of materials, a single file (MERL *.binary, RGL *.bsdf, NBRDF \
         NAME_fc1.npy or a fitted material.json), or procedural[:COUNT[:SEED]]", .0.display()
    )]
    NotFound(PathBuf),
    /// A file has no known format.
    #[error(
        "{} is not a material; give a MERL (*.binary), RGL (*.bsdf) or NBRDF (NAME_fc1.npy and its five siblings) \
         file, a fitted material.json, a directory of those, or procedural[:COUNT[:SEED]]", .0.display()
    )]
    UnknownFormat(PathBuf),
    /// Two materials of a directory have the same name.
    #[error(
        "{} and {} both hold a material named {name}; rename or remove one of them", first.display(), second.display()
    )]
    DuplicateName {
        /// The name.
        name: String,
        /// The first file.
        first: PathBuf,
        /// The second file.
        second: PathBuf,
    },
    /// Two sources hold a material of the same name.
    #[error(
        "{first} and {second} both hold a material named {name}; rename or remove it in one of them"
    )]
    DuplicateAcrossSources {
        /// The name.
        name: String,
        /// The first source.
        first: String,
        /// The second source.
        second: String,
    },
    /// A directory without materials.
    #[error(
        "{} holds no materials; put MERL (*.binary), RGL (*.bsdf) or NBRDF (NAME_fc1.npy and its five siblings) \
         files or a fitted material.json into it", .0.display()
    )]
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
    /// Returns an error if a channel of `brdf` is infinite or NaN. `angles` are in radians.
    ///
    /// # Errors
    /// The first such channel.
    pub fn check(angles: Angles<f32>, brdf: [f32; 3]) -> Result<(), Self> {
        let Some(value) = brdf.into_iter().find(|value| !value.is_finite()) else {
            return Ok(());
        };
        let angles = [angles.theta_h, angles.theta_d, angles.phi_d];
        Err(Self {
            value,
            angles: angles.map(f32::to_degrees),
        })
    }
}

/// Returns a function that converts an I/O error at a path to a [`SourceError::Read`].
pub(super) fn read_error(path: &Path) -> impl Fn(io::Error) -> SourceError {
    move |source| SourceError::Read {
        path: path.into(),
        source,
    }
}
