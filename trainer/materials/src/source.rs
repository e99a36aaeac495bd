//! A source of materials: a directory, a file, or the built-in procedural set.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use rayon::prelude::*;

use crate::error::{MAX_PROCEDURAL, SourceError, entries, read_error};
use crate::formats::fitted_material::FittedMaterial;
use crate::formats::{Format, nbrdf, pab};
use crate::{Material, Procedural};

/// A source of materials, as written on the command line:
///
/// - a directory with any mix of MERL tables, RGL measurements, NBRDF networks and fitted materials (`material.json`,
///   also in a subdirectory); other files are ignored;
/// - a single file of these formats, or one PAB-Opto file, which is read with the other files of its set in the
///   directory;
/// - `procedural[:COUNT[:SEED]]`, by default 100 materials and seed 0.
///
/// The format is detected from a file's content; see [`Format`]. Anisotropic `.bsdf` files in a directory are errors, so
/// that no material is skipped silently. `NAME_spec.bsdf` next to `NAME_rgb.bsdf` is skipped: it is the same material.
/// Names must be unique, because results are listed by name.
///
/// A text that continues after `procedural` with anything except a colon is a path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source(pub String);

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl FromStr for Source {
    type Err = SourceError;

    /// Rejects an invalid `procedural:...`. [`Source::load`] checks paths.
    fn from_str(text: &str) -> Result<Self, SourceError> {
        procedural(text)?;
        Ok(Self(text.to_owned()))
    }
}

impl Source {
    /// Returns the last component of the path, so that recipes do not disclose directories.
    #[must_use]
    pub fn label(&self) -> &str {
        let name = Path::new(&self.0).file_name();
        name.and_then(|name| name.to_str()).unwrap_or(&self.0)
    }

    /// Returns true if this is the built-in procedural set.
    #[must_use]
    pub fn is_built_in(&self) -> bool {
        procedural(&self.0).is_ok_and(|set| set.is_some())
    }

    /// Returns the number of materials without reading them.
    ///
    /// # Errors
    /// If the path does not exist, or two materials have the same name.
    pub fn count(&self) -> Result<usize, SourceError> {
        if let Some((count, _)) = procedural(&self.0)? {
            return Ok(count);
        }
        Ok(self.paths()?.len())
    }

    /// Reads all materials, sorted by name. Their BRDFs are known at all directions.
    ///
    /// # Errors
    /// As [`Source::load_measured`], and if a BRDF is unknown at some directions.
    pub fn load(&self) -> Result<Vec<Box<dyn Material>>, SourceError> {
        let materials = self.load_measured()?;
        for material in &materials {
            material.require_complete()?;
        }
        Ok(materials)
    }

    /// Reads all materials, sorted by name. Their BRDFs are NaN at unknown directions.
    ///
    /// # Errors
    /// If the path does not exist, a file is damaged or unsupported, or two materials have the same name.
    pub fn load_measured(&self) -> Result<Vec<Box<dyn Material>>, SourceError> {
        if let Some((count, seed)) = procedural(&self.0)? {
            let set = Procedural::set(count, seed).into_iter();
            return Ok(set
                .map(|material| Box::new(material) as Box<dyn Material>)
                .collect());
        }
        let paths = self.paths()?;
        let materials: Vec<_> = paths.par_iter().map(|path| read(path)).collect();
        // Results are collected in order, so that the error is always that of the first damaged file.
        materials.into_iter().collect()
    }

    /// Returns all files that are read; none for the built-in set.
    ///
    /// # Errors
    /// If the directory cannot be listed, holds no materials, or holds two of the same name.
    pub fn files(&self) -> Result<Vec<PathBuf>, SourceError> {
        let paths = self.paths()?;
        if let [path] = &paths[..]
            && Format::detect(path).is_ok_and(|format| format == Format::Pab)
        {
            return pab::files_of(path);
        }
        let files = paths.into_iter().flat_map(|path| {
            if FittedMaterial::is_json_file(&path) {
                return FittedMaterial::files_of(&path);
            }
            match Format::named(&path) {
                Some((Format::Nbrdf, name)) => nbrdf::files_of(&path, name).to_vec(),
                _ => vec![path],
            }
        });
        Ok(files.collect())
    }

    /// Returns the path of each material, in the order of [`Source::load`]. The path of a network is the first of its
    /// six files. The list is empty for the built-in set.
    ///
    /// # Errors
    /// If the path does not exist, or the directory cannot be listed, holds no materials, or holds two of the same name.
    pub fn paths(&self) -> Result<Vec<PathBuf>, SourceError> {
        if procedural(&self.0)?.is_some() {
            return Ok(Vec::new());
        }
        let path = Path::new(&self.0);
        match path.try_exists().map_err(read_error(path))? {
            true if path.is_dir() => Listing::of(path)?.into_files(path),
            true => Ok(vec![path.to_owned()]),
            false => Err(SourceError::NotFound(path.into())),
        }
    }

    /// Returns the sorted names of entries of a directory that look like materials and that [`Source::load`] skips. They
    /// are directories without the `material.json` of a fit, files with a material's extension whose names are not UTF-8,
    /// have capital letters in the extension, or do not fit the format, and `NAME_spec.bsdf` next to `NAME_rgb.bsdf`.
    /// Other kinds of files, such as a README, are not listed.
    ///
    /// # Errors
    /// If the directory cannot be listed.
    pub fn skipped_entries(&self) -> Result<Vec<String>, SourceError> {
        let path = Path::new(&self.0);
        match (procedural(&self.0)?, path.is_dir()) {
            (None, true) => Ok(Listing::of(path)?.skipped),
            _ => Ok(Vec::new()),
        }
    }
}

/// Parses COUNT and SEED of `procedural[:COUNT[:SEED]]`. Returns None for a path.
fn procedural(text: &str) -> Result<Option<(usize, u64)>, SourceError> {
    let invalid = || SourceError::InvalidProcedural(text.to_owned());
    let mut parts = text.split(':');
    if parts.next() != Some("procedural") {
        return Ok(None);
    }
    let (mut count, mut seed) = (100, 0);
    if let Some(part) = parts.next() {
        count = part.parse().map_err(|_| invalid())?;
    }
    if let Some(part) = parts.next() {
        seed = part.parse().map_err(|_| invalid())?;
    }
    if parts.next().is_some() || !(1..=MAX_PROCEDURAL).contains(&count) {
        return Err(invalid());
    }
    Ok(Some((count, seed)))
}

/// Reads one material.
fn read(path: &Path) -> Result<Box<dyn Material>, SourceError> {
    if FittedMaterial::is_json_file(path) {
        return Ok(Box::new(FittedMaterial::read(path)?));
    }
    Format::read(path)
}

/// The entries of a directory.
#[derive(Default)]
struct Listing {
    /// One file for each material, sorted. A network has all of its files.
    files: Vec<PathBuf>,
    skipped: Vec<String>,
}

impl Listing {
    fn of(directory: &Path) -> Result<Self, SourceError> {
        let mut listing = Self::default();
        listing.files.extend(FittedMaterial::find_in(directory));
        for path in entries(directory)? {
            let is_read = Format::named(&path).is_some() && !is_second_form(&path);
            let file = match path.is_dir() {
                true => FittedMaterial::find_in(&path),
                false => is_read.then(|| path.clone()),
            };
            if file.is_none() && (path.is_dir() || Format::is_similar(&path)) {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                listing.skipped.push(name.into_owned());
            }
            listing.files.extend(file);
        }
        // Sorted, so that error messages do not depend on the order of the file system.
        listing.files.sort();
        listing.skipped.sort();
        Ok(listing)
    }

    /// Returns one file for each material, sorted by the materials' names.
    fn into_files(self, directory: &Path) -> Result<Vec<PathBuf>, SourceError> {
        let mut by_name = BTreeMap::new();
        for path in self.files {
            let (name, file) = match Format::named(&path) {
                // Any of the six files identifies a network, so that an incomplete network is an error.
                Some((Format::Nbrdf, name)) => {
                    let [first, ..] = nbrdf::files_of(&path, name);
                    (name.to_owned(), first)
                }
                Some((_, name)) => (name.to_owned(), path.clone()),
                None => (FittedMaterial::read_name(&path)?, path.clone()),
            };
            let earlier = by_name.insert(name.clone(), file.clone());
            if let Some(first) = earlier.filter(|first| *first != file) {
                return Err(SourceError::DuplicateName {
                    name,
                    first,
                    second: file,
                });
            }
        }
        match by_name.is_empty() {
            true => Err(SourceError::Empty(directory.into())),
            false => Ok(by_name.into_values().collect()),
        }
    }
}

/// Returns true for a file `NAME_spec.bsdf` next to `NAME_rgb.bsdf`. RGL publishes each material in both forms.
fn is_second_form(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str());
    let name = name.and_then(|name| name.strip_suffix("_spec.bsdf"));
    name.is_some_and(|name| path.with_file_name(format!("{name}_rgb.bsdf")).is_file())
}
