//! Recipe files.

use std::io;
use std::path::{Path, PathBuf};

use glimpse_core::error::Error;
use glimpse_core::recipe::{Contents, FORMAT, METADATA, Recipe};
use glimpse_core::section::{MAX_COMPONENTS, MAX_SAMPLES, Section};
use glimpse_materials::basis::BasisError;
use glimpse_materials::untrusted::read_at_most;
use serde::Serialize;

use super::metadata::{Metadata, MetadataError};

/// An error of a recipe file.
#[derive(Debug, thiserror::Error)]
pub enum RecipeFileError {
    /// The file cannot be read.
    #[error("cannot read the recipe {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
    /// The bytes are not a recipe.
    #[error("{}: {source}; use a recipe written by `trainer train`", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: RecipeDefect,
    },
    /// The basis of the recipe cannot be used.
    #[error(transparent)]
    Basis(#[from] BasisError),
}

/// The maximum size of a recipe file. The largest list of a recipe, the basis of a ridge problem, takes a quarter of
/// it. The rest has room for metadata.
const MAX_BYTES: u64 = 4 * (MAX_SAMPLES * MAX_COMPONENTS * size_of::<f32>()) as u64;

/// A defect of a recipe's bytes.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RecipeDefect {
    /// The bytes are not a recipe.
    #[error(transparent)]
    Recipe(#[from] Error),
    /// The metadata is invalid.
    #[error(transparent)]
    Metadata(#[from] MetadataError),
    /// The recipe has a pattern, or no prior of readings at any directions.
    #[error("the recipe has directions of its own; use one of `train --samples any`")]
    NotAny,
    /// The number of directions exceeds that of a recipe's samples.
    #[error("{0} different directions are too many for a recipe; give at most {MAX_SAMPLES}")]
    TooManyDirections(usize),
}

/// The checked bytes of a recipe, and its metadata.
#[derive(Debug)]
pub struct RecipeFile {
    bytes: Vec<u8>,
    metadata: Metadata,
}

impl RecipeFile {
    /// Reads and checks a recipe file.
    ///
    /// # Errors
    /// Fails if the file cannot be read or is not a recipe.
    pub fn read(path: &Path) -> Result<Self, RecipeFileError> {
        let (bytes, path) = (read_at_most(path, MAX_BYTES), path.to_owned());
        match bytes {
            Ok(bytes) => {
                Self::new(bytes).map_err(|source| RecipeFileError::Damaged { path, source })
            }
            Err(source) => Err(RecipeFileError::Read { path, source }),
        }
    }

    /// Parses a recipe's bytes.
    ///
    /// # Errors
    /// Fails if the bytes are not a recipe, or if its metadata is damaged.
    pub fn new(bytes: Vec<u8>) -> Result<Self, RecipeDefect> {
        let metadata = Metadata::of(&Recipe::parse(&bytes)?)?;
        Ok(Self { bytes, metadata })
    }

    /// Encodes a recipe in memory.
    ///
    /// # Errors
    /// Fails if a list has a wrong length, a number is not finite, or another rule of the format is broken.
    pub fn write(contents: &Contents<'_>) -> Result<Self, RecipeDefect> {
        let (pattern, estimator) = contents.check()?;
        let samples = pattern.directions.len() / 3;
        let mut body = Vec::new();
        // At most MAX_SAMPLES, and words of one computer's memory.
        body.extend((samples as u16).to_le_bytes());
        body.extend((estimator.scan_words(samples) as u32).to_le_bytes());
        put(&mut body, contents.pattern.as_ref());
        put(&mut body, contents.sgd.as_ref());
        put(&mut body, contents.ridge.as_ref());
        put(&mut body, contents.net.as_ref());
        put(&mut body, contents.start.as_ref());
        put(&mut body, contents.gauss_newton.as_ref());
        put(&mut body, contents.noise.as_ref());
        put(&mut body, contents.prediction.as_ref());
        if !contents.metadata.is_empty() {
            put_bytes(&mut body, METADATA, contents.metadata);
        }
        Self::new([&FORMAT.header(&body)[..], &body].concat())
    }

    /// Returns the bytes.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Parses the bytes. A caller keeps the result for several uses.
    #[must_use]
    pub fn recipe(&self) -> Recipe<'_> {
        Recipe::parse(&self.bytes).expect("the bytes were checked")
    }

    /// Returns the metadata of the recipe.
    #[must_use]
    pub fn metadata(&self) -> &Metadata {
        &self.metadata
    }

    /// Returns the recipe with other metadata. Without any, by default, it has the form that is stored in flash.
    ///
    /// # Errors
    /// Fails if the metadata are invalid.
    pub fn with_metadata(&self, metadata: &Metadata) -> Result<Self, RecipeDefect> {
        let contents = Contents::read(self.bytes())?;
        Self::write(&Contents {
            metadata: &metadata.to_bytes(),
            ..contents
        })
    }
}

/// Appends a section, if there is one.
fn put<T: Section + Serialize>(body: &mut Vec<u8>, section: Option<&T>) {
    if let Some(section) = section {
        put_bytes(body, T::KIND, &encoded(section));
    }
}

fn put_bytes(body: &mut Vec<u8>, kind: u16, bytes: &[u8]) {
    body.extend(encoded(&(kind, bytes)));
}

fn encoded(value: &impl Serialize) -> Vec<u8> {
    postcard::to_stdvec(value).expect("lists of known length have an encoding")
}
