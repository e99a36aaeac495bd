//! Where materials come from: a directory, a file, or the built-in procedural set.

use std::collections::BTreeSet;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use rayon::prelude::*;

use super::{Material, MerlTable, NeuralBrdf, Procedural};

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
    /// A file is not what its name says.
    #[error("{}: {what}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong with it, and the remedy.
        what: String,
    },
    /// Neither a file nor a directory.
    #[error(
        "{} does not exist: give a directory of materials, a single one (MERL *.binary or NBRDF \
         NAME_fc1.npy), or procedural[:COUNT[:SEED]]", .0.display()
    )]
    Missing(PathBuf),
    /// A file of no known kind.
    #[error(
        "{} is no material: expected MERL (*.binary), NBRDF (NAME_fc1.npy and its five \
         siblings), a directory of those, or procedural[:COUNT[:SEED]]", .0.display()
    )]
    Unknown(PathBuf),
    /// A file or directory of a kind that is not read yet.
    #[error(
        "{} is RGL (*_rgb.bsdf), which is not read yet: give MERL (*.binary) or NBRDF \
         (NAME_fc1.npy and its five siblings) instead", .0.display()
    )]
    Unsupported(PathBuf),
    /// A directory without materials.
    #[error(
        "{} holds no materials: expected MERL (*.binary) or NBRDF (NAME_fc1.npy and its five \
         siblings) in it", .0.display()
    )]
    Empty(PathBuf),
    /// `procedural:...` with something that is not a number.
    #[error(
        "`{0}` is not understood: write procedural, procedural:COUNT or procedural:COUNT:SEED \
         with a COUNT of 1 to {MOST_PROCEDURAL}"
    )]
    Procedural(String),
}

/// The largest COUNT of `procedural:COUNT`.
const MOST_PROCEDURAL: usize = 100_000;

/// Where to take materials from, as written on the command line: a directory with any mix of
/// MERL tables and NBRDF networks (other files in it are passed over), a single one of them, or
/// `procedural[:COUNT[:SEED]]`, 100 materials and seed 0 unless told.
///
/// What begins with `procedural` is a path nevertheless if anything but a colon follows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source(pub String);

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl FromStr for Source {
    type Err = SourceError;

    /// Refuses a misspelt `procedural:...`; paths are looked at by [`Source::load`].
    fn from_str(text: &str) -> Result<Self, SourceError> {
        procedural(text)?;
        Ok(Self(text.to_owned()))
    }
}

impl Source {
    /// Reads all materials, sorted by name.
    ///
    /// # Errors
    /// If nothing is there, or any file is damaged.
    pub fn load(&self) -> Result<Vec<Box<dyn Material>>, SourceError> {
        if let Some((count, seed)) = procedural(&self.0)? {
            let set = Procedural::set(count, seed).into_iter();
            return Ok(set
                .map(|each| Box::new(each) as Box<dyn Material>)
                .collect());
        }
        let path = Path::new(&self.0);
        if !path.try_exists().map_err(refused(path))? {
            return Err(SourceError::Missing(path.into()));
        }
        if !path.is_dir() {
            return Ok(vec![read(path)?]);
        }
        let read: Vec<_> = list(path)?.par_iter().map(|file| read(file)).collect();
        // In order, so that of several damaged files it is always the first that is named.
        read.into_iter().collect()
    }
}

/// COUNT and SEED of `procedural[:COUNT[:SEED]]`; None for a path.
fn procedural(text: &str) -> Result<Option<(usize, u64)>, SourceError> {
    let misunderstood = || SourceError::Procedural(text.to_owned());
    let mut parts = text.split(':');
    if parts.next() != Some("procedural") {
        return Ok(None);
    }
    let (mut count, mut seed) = (100, 0);
    if let Some(part) = parts.next() {
        count = part.parse().map_err(|_| misunderstood())?;
    }
    if let Some(part) = parts.next() {
        seed = part.parse().map_err(|_| misunderstood())?;
    }
    if parts.next().is_some() || !(1..=MOST_PROCEDURAL).contains(&count) {
        return Err(misunderstood());
    }
    Ok(Some((count, seed)))
}

fn refused(path: &Path) -> impl Fn(io::Error) -> SourceError {
    move |source| SourceError::Read {
        path: path.into(),
        source,
    }
}

/// Reads one material.
fn read(path: &Path) -> Result<Box<dyn Material>, SourceError> {
    if NeuralBrdf::name_of(path).is_some() {
        return Ok(Box::new(NeuralBrdf::read(path)?));
    }
    if MerlTable::name_of(path).is_some() {
        return Ok(Box::new(MerlTable::read(path)?));
    }
    Err(match is_rgl(path) {
        true => SourceError::Unsupported(path.into()),
        false => SourceError::Unknown(path.into()),
    })
}

/// One file for each material in a directory, sorted by the materials' names.
fn list(directory: &Path) -> Result<Vec<PathBuf>, SourceError> {
    // A network is found by any of its six files, so that one that lacks a file is not overlooked.
    let mut found = BTreeSet::new();
    let mut rgl = false;
    for entry in directory.read_dir().map_err(refused(directory))? {
        let path = entry.map_err(refused(directory))?.path();
        if !path.is_file() {
            continue;
        }
        rgl |= is_rgl(&path);
        if let Some(name) = NeuralBrdf::name_of(&path) {
            let first = path.with_file_name(format!("{name}_fc1.npy"));
            found.insert((name, first));
        } else if let Some(name) = MerlTable::name_of(&path) {
            found.insert((name, path));
        }
    }
    match found.is_empty() {
        true if rgl => Err(SourceError::Unsupported(directory.into())),
        true => Err(SourceError::Empty(directory.into())),
        false => Ok(found.into_iter().map(|(_, path)| path).collect()),
    }
}

fn is_rgl(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str());
    name.is_some_and(|name| name.ends_with("_rgb.bsdf"))
}
