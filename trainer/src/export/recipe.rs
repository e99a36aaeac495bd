//! Recipes as files.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use glimpse_core::recipe::{Field, HEADER_BYTES, Ingredients, Provenance, Recipe, RecipeError};

use crate::meta::run::Learned;

/// Why a recipe file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum RecipeFileError {
    /// The operating system refuses.
    #[error("cannot read the recipe {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The bytes are not a recipe.
    #[error("{}: {source}; make one with `trainer train`", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Why.
        source: RecipeError,
    },
}

/// A recipe's bytes, checked.
#[derive(Clone, Debug)]
pub struct RecipeFile {
    bytes: Vec<u8>,
}

impl RecipeFile {
    /// Reads and checks a recipe file.
    ///
    /// # Errors
    /// If it cannot be read or is no recipe.
    pub fn read(path: &Path) -> Result<Self, RecipeFileError> {
        let bytes = fs::read(path).map_err(|source| RecipeFileError::Read {
            path: path.into(),
            source,
        })?;
        Self::new(bytes).map_err(|source| RecipeFileError::Damaged {
            path: path.into(),
            source,
        })
    }

    /// Checks a recipe's bytes.
    ///
    /// # Errors
    /// If they are no recipe.
    pub fn new(bytes: Vec<u8>) -> Result<Self, RecipeError> {
        Recipe::parse(&bytes)?;
        Ok(Self { bytes })
    }

    /// The bytes.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The recipe.
    ///
    /// # Errors
    /// None: the bytes were checked when they came. (They are parsed again, since a recipe
    /// borrows them.)
    pub fn recipe(&self) -> Result<Recipe<'_>, RecipeError> {
        Recipe::parse(&self.bytes)
    }
}

/// Writes down what was learned.
///
/// # Errors
/// If a number is not finite, or another rule of the format is broken.
pub fn to_recipe(
    learned: &Learned,
    provenance: &Provenance<'_>,
) -> Result<RecipeFile, RecipeError> {
    let coordinates = learned
        .pattern
        .iter()
        .flat_map(|angles| [angles.theta_h, angles.theta_d, angles.phi_d]);
    let pattern = packed(coordinates);
    let initial = packed(learned.initial.iter().copied());
    let step_sizes = packed(learned.step_sizes.iter().copied());
    let ingredients = Ingredients {
        model: learned.model,
        inner_steps: u16::try_from(learned.inner_steps)
            .map_err(|_| RecipeError::Count(Field::InnerSteps))?,
        pattern: &pattern,
        initial: &initial,
        step_sizes: &step_sizes,
        expected_loss: learned.expected_loss,
        provenance: *provenance,
    };
    let text = provenance.trainer.len() + provenance.data.len() + provenance.schedule.len();
    let room = HEADER_BYTES + pattern.len() + initial.len() + step_sizes.len() + text + 128;
    let mut buffer = vec![0; room];
    let bytes = Recipe::write(&ingredients, &mut buffer)?.to_vec();
    Ok(RecipeFile { bytes })
}

fn packed(values: impl Iterator<Item = f32>) -> Vec<u8> {
    values.flat_map(f32::to_le_bytes).collect()
}
