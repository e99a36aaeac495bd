//! Where materials come from: a directory, a file, or the built-in procedural set.

use std::io;
use std::path::{Path, PathBuf};

use super::{Material, NeuralBrdf, Procedural};

/// Why materials cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// The operating system refuses.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file or directory.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A file is not what its name says.
    #[error("{}: {what}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong with it, and the remedy.
        what: String,
    },
    /// A file of no known kind.
    #[error(
        "{} is no material: expected MERL (*.binary), NBRDF (NAME_fc1.npy and its five \
         siblings), a directory of those, or procedural[:COUNT[:SEED]]", .0.display()
    )]
    Unknown(PathBuf),
    /// A directory without materials.
    #[error(
        "{} holds no materials: expected MERL (*.binary) or NBRDF (NAME_fc1.npy and its five \
         siblings) in it", .0.display()
    )]
    Empty(PathBuf),
    /// `procedural:...` with something that is not a number.
    #[error("`{0}` is not understood: write procedural, procedural:COUNT or procedural:COUNT:SEED")]
    Procedural(String),
}

/// Where to take materials from, as written on the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source(pub String);

impl std::str::FromStr for Source {
    type Err = std::convert::Infallible;
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(Self(text.to_owned()))
    }
}

impl std::fmt::Display for Source {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl Source {
    /// Reads all materials, sorted by name.
    ///
    /// # Errors
    /// If nothing is there, or any file is damaged.
    pub fn load(&self) -> Result<Vec<Box<dyn Material>>, SourceError> {
        if let Some(rest) = self.0.strip_prefix("procedural") {
            return self.procedural(rest);
        }
        let path = Path::new(&self.0);
        let mut files: Vec<PathBuf> = std::fs::read_dir(path)
            .map_err(|source| SourceError::Read {
                path: path.into(),
                source,
            })?
            .filter_map(|entry| Some(entry.ok()?.path()))
            .collect();
        files.sort();
        files
            .iter()
            .filter(|f| NeuralBrdf::name_of(f).is_some())
            .map(|f| Ok(Box::new(NeuralBrdf::read(f)?) as Box<dyn Material>))
            .collect()
    }

    /// `procedural`, `procedural:COUNT` or `procedural:COUNT:SEED`; `rest` is what follows the word.
    fn procedural(&self, rest: &str) -> Result<Vec<Box<dyn Material>>, SourceError> {
        let misunderstood = || SourceError::Procedural(self.0.clone());
        let mut parts = rest.split(':');
        let (mut count, mut seed) = (100, 0);
        if parts.next() != Some("") {
            return Err(misunderstood());
        }
        if let Some(part) = parts.next() {
            count = part.parse().map_err(|_| misunderstood())?;
        }
        if let Some(part) = parts.next() {
            seed = part.parse().map_err(|_| misunderstood())?;
        }
        if parts.next().is_some() || !(1..=100_000).contains(&count) {
            return Err(misunderstood());
        }
        Ok(Procedural::set(count, seed)
            .into_iter()
            .map(|material| Box::new(material) as Box<dyn Material>)
            .collect())
    }
}
