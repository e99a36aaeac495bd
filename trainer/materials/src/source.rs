//! Where materials come from: a directory, a file, or the built-in procedural set.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use rayon::prelude::*;

use crate::error::{MOST_PROCEDURAL, SourceError, refused};
use crate::format::Format;
use crate::name::name_by_ending;
use crate::skipped_entries::SkippedEntries;
use crate::{
    FittedMaterial, Material, MerlTable, NeuralBrdf, Procedural, RglMeasurement, pab, read_pab,
};

/// Up to how many materials of a directory MERL's tables are read from end to end when they are opened.
/// They have 33 MiB each: of more of them it would take minutes before anything is done.
pub const MAX_FULLY_CHECKED: usize = 128;

/// Where to take materials from, as written on the command line: a directory with any mix of
/// MERL tables, RGL measurements, NBRDF networks and fitted materials (`material.json`, in a folder of
/// its own too; other files are passed over), a single one of them, or `procedural[:COUNT[:SEED]]`,
/// 100 materials and seed 0 unless told. Which format a file has is told by what is in it: see
/// [`Format`]. A single file of PAB-Opto's text stands for all of its sample that lie beside it.
///
/// Every `.bsdf` of a directory is meant to be read: one that is spectral or anisotropic is an
/// error, so that nobody trains on fewer materials than the directory holds. No two materials may
/// have the same name, since results are told apart by it.
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
    /// Its name without the directories that lead to it: those are nobody's business.
    #[must_use]
    pub fn label(&self) -> &str {
        let name = Path::new(&self.0).file_name();
        name.and_then(|name| name.to_str()).unwrap_or(&self.0)
    }

    /// True of the built-in set, which is read from no file.
    #[must_use]
    pub fn is_built_in(&self) -> bool {
        procedural(&self.0).is_ok_and(|set| set.is_some())
    }

    /// How many materials there are, of which none is read.
    ///
    /// # Errors
    /// If nothing is there, or two have the same name.
    pub fn count(&self) -> Result<usize, SourceError> {
        if let Some((count, _)) = procedural(&self.0)? {
            return Ok(count);
        }
        let path = Path::new(&self.0);
        if !path.try_exists().map_err(refused(path))? {
            return Err(SourceError::NotFound(path.into()));
        }
        match path.is_dir() {
            true => Ok(list(path)?.len()),
            false => Ok(1),
        }
    }

    /// Reads all materials, sorted by name. Of a directory of more than [`MAX_FULLY_CHECKED`] MERL's
    /// tables are only opened.
    ///
    /// # Errors
    /// If nothing is there, any file is damaged or not read, or two have the same name.
    pub fn load(&self) -> Result<Vec<Box<dyn Material>>, SourceError> {
        if let Some((count, seed)) = procedural(&self.0)? {
            let set = Procedural::set(count, seed).into_iter();
            return Ok(set
                .map(|each| Box::new(each) as Box<dyn Material>)
                .collect());
        }
        let path = Path::new(&self.0);
        if !path.try_exists().map_err(refused(path))? {
            return Err(SourceError::NotFound(path.into()));
        }
        if !path.is_dir() {
            return Ok(vec![read(path, MerlTable::read)?]);
        }
        let files = list(path)?;
        let merl = match files.len() > MAX_FULLY_CHECKED {
            true => MerlTable::open,
            false => MerlTable::read,
        };
        let read: Vec<_> = files.par_iter().map(|file| read(file, merl)).collect();
        // In order, so that of several damaged files it is always the first that is named.
        read.into_iter().collect()
    }
}

impl Source {
    /// All files that are read; none for the built-in set.
    ///
    /// # Errors
    /// If the directory cannot be listed, holds no materials, or two of the same name.
    pub fn files(&self) -> Result<Vec<PathBuf>, SourceError> {
        let path = Path::new(&self.0);
        let found = match (procedural(&self.0)?, path.is_dir()) {
            (Some(_), _) => Vec::new(),
            (None, true) => list(path)?,
            (None, false) if Format::detect(path).is_ok_and(|format| format == Format::Pab) => {
                pab::files_of(path)?
            }
            (None, false) => vec![path.to_owned()],
        };
        let all = found
            .into_iter()
            .flat_map(|file| match NeuralBrdf::files_of(&file) {
                Some(six) => six.to_vec(),
                None if FittedMaterial::is_json_file(&file) => FittedMaterial::files_of(&file),
                None => vec![file],
            });
        Ok(all.collect())
    }

    /// The path of each material, in the order of [`Source::load`]: of a network the first of its six
    /// files. None for the built-in set.
    ///
    /// # Errors
    /// If the directory cannot be listed, holds no materials, or two of the same name.
    pub fn paths(&self) -> Result<Vec<PathBuf>, SourceError> {
        let path = Path::new(&self.0);
        match (procedural(&self.0)?, path.is_dir()) {
            (Some(_), _) => Ok(Vec::new()),
            (None, true) => list(path),
            (None, false) => Ok(vec![path.to_owned()]),
        }
    }

    /// What [`Source::load`] passes over in silence though somebody may have meant it to be read;
    /// nothing for a single file and for the built-in set.
    ///
    /// # Errors
    /// If the directory cannot be listed.
    pub fn skipped_entries(&self) -> Result<SkippedEntries, SourceError> {
        let path = Path::new(&self.0);
        match (procedural(&self.0)?, path.is_dir()) {
            (None, true) => SkippedEntries::scan(path),
            _ => Ok(SkippedEntries::default()),
        }
    }
}

/// COUNT and SEED of `procedural[:COUNT[:SEED]]`; None for a path.
fn procedural(text: &str) -> Result<Option<(usize, u64)>, SourceError> {
    let misunderstood = || SourceError::InvalidProcedural(text.to_owned());
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

/// Reads one material, a table of MERL's in one of two ways.
fn read(
    path: &Path,
    merl: fn(&Path) -> Result<MerlTable, SourceError>,
) -> Result<Box<dyn Material>, SourceError> {
    if FittedMaterial::is_json_file(path) {
        return Ok(Box::new(FittedMaterial::read(path)?));
    }
    Ok(match Format::detect(path)? {
        Format::Nbrdf => Box::new(NeuralBrdf::read(path)?),
        Format::Merl => Box::new(merl(path)?),
        Format::Rgl => Box::new(RglMeasurement::read(path)?),
        Format::Pab => Box::new(read_pab(path)?),
    })
}

/// One file for each material in a directory, sorted by the materials' names.
fn list(directory: &Path) -> Result<Vec<PathBuf>, SourceError> {
    let mut files: Vec<PathBuf> = FittedMaterial::within(directory).into_iter().collect();
    for entry in directory.read_dir().map_err(refused(directory))? {
        let path = entry.map_err(refused(directory))?.path();
        if path.is_file() && !FittedMaterial::is_json_file(&path) {
            files.push(path);
        } else if path.is_dir() {
            files.extend(FittedMaterial::within(&path));
        }
    }
    // In order, so that messages do not depend on the file system's.
    files.sort();

    let mut found = BTreeMap::new();
    for path in files {
        // A network is found by any of its six files, so that one that lacks a file is not
        // overlooked.
        let (name, file) = if let Some(name) = NeuralBrdf::name_of(&path) {
            let first = path.with_file_name(format!("{name}_fc1.npy"));
            (name, first)
        } else if let Some(name) = name_by_ending(&path) {
            (name, path)
        } else if FittedMaterial::is_json_file(&path) {
            (FittedMaterial::name_in(&path)?, path)
        } else {
            continue;
        };
        match found.entry(name) {
            Entry::Vacant(place) => {
                place.insert(file);
            }
            Entry::Occupied(place) if *place.get() == file => {}
            Entry::Occupied(place) => {
                return Err(SourceError::DuplicateName {
                    name: place.key().clone(),
                    first: place.get().clone(),
                    second: file,
                });
            }
        }
    }
    match found.is_empty() {
        true => Err(SourceError::Empty(directory.into())),
        false => Ok(found.into_values().collect()),
    }
}
