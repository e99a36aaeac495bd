//! Why a material cannot be had.

use std::io;
use std::path::{Path, PathBuf};

use glimpse_core::geometry::Angles;

/// The largest COUNT of `procedural:COUNT`.
pub(super) const MOST_PROCEDURAL: usize = 100_000;

/// Why materials cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// The operating system refuses to read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file or directory.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// It could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A file is not what its name says, or of a kind that is not read.
    #[error("{}: {what}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong with it, and the remedy.
        what: String,
    },
    /// Neither a file nor a directory.
    #[error(
        "{} does not exist: give a directory of materials, a single one (MERL *.binary, RGL \
         *_rgb.bsdf, NBRDF NAME_fc1.npy or a fitted material.json), or procedural[:COUNT[:SEED]]", .0.display()
    )]
    NotFound(PathBuf),
    /// A file of no known kind.
    #[error(
        "{} is no material: expected MERL (*.binary), RGL (*_rgb.bsdf), NBRDF (NAME_fc1.npy and \
         its five siblings), a fitted material.json, a directory of those, or procedural[:COUNT[:SEED]]", .0.display()
    )]
    UnknownFormat(PathBuf),
    /// Two materials of a directory have the same name.
    #[error(
        "{} and {} are both named {name}: rename one of them, or take it away", first.display(),
        second.display()
    )]
    DuplicateName {
        /// The name.
        name: String,
        /// One file.
        first: PathBuf,
        /// The other one.
        second: PathBuf,
    },
    /// Two sources hold a material of the same name.
    #[error(
        "{first} and {second} both hold a material named {name}: take it away from one of them"
    )]
    DuplicateAcrossSources {
        /// The name.
        name: String,
        /// One source.
        first: String,
        /// The other one.
        second: String,
    },
    /// A directory without materials.
    #[error(
        "{} holds no materials: expected MERL (*.binary), RGL (*_rgb.bsdf) or NBRDF (NAME_fc1.npy \
         and its five siblings) in it, or the material.json of a fit", .0.display()
    )]
    Empty(PathBuf),
    /// `procedural:...` with something that is not a number.
    #[error(
        "`{0}` is not understood: write procedural, procedural:COUNT or procedural:COUNT:SEED \
         with a COUNT of 1 to {MOST_PROCEDURAL}"
    )]
    InvalidProcedural(String),
}

/// Why a BRDF cannot be written as a material: it is infinite or no number somewhere.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "the BRDF is {} at theta_h {:.2}, theta_d {:.2} and phi_d {:.2} degrees, and only a finite one \
     can be written; fit it again, or from other readings", .value, .angles[0], .angles[1], .angles[2]
)]
pub struct NotFinite {
    /// What it is there.
    pub value: f32,
    /// theta_h, theta_d and phi_d, in degrees.
    pub angles: [f32; 3],
}

impl NotFinite {
    /// Looks at a BRDF's value at angles in radians.
    pub(super) fn check(angles: Angles<f32>, brdf: [f32; 3]) -> Result<(), Self> {
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

/// What becomes of the operating system's refusal to read a path.
pub(super) fn refused(path: &Path) -> impl Fn(io::Error) -> SourceError {
    move |source| SourceError::Read {
        path: path.into(),
        source,
    }
}
