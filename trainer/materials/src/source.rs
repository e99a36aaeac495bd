//! Sources of materials: directories, files, and the built-in procedural set; and the share of each in a training.

use std::collections::{BTreeMap, HashMap};
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::error::{MAX_PROCEDURAL, SourceError, entries, read_error};
use crate::formats::fitted_material::FittedMaterial;
use crate::formats::{Format, nbrdf, pab};
use crate::setting::Name;
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
    let numbers = parts.map(|part| part.parse().ok());
    let (count, seed) = match numbers.collect::<Option<Vec<u64>>>().as_deref() {
        Some([]) => (100, 0),
        Some([count]) => (*count, 0),
        Some([count, seed]) => (*count, *seed),
        _ => return Err(invalid()),
    };
    if !(1..=MAX_PROCEDURAL).contains(&count) {
        return Err(invalid());
    }
    Ok(Some((count as usize, seed)))
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

/// Sources of materials, and the share of training tasks that each gets.
#[derive(Clone, Debug, PartialEq)]
pub struct Sources {
    /// The sources.
    pub sources: Vec<Source>,
    /// One share for each source, with sum 1. None if all materials have equal weight.
    shares: Option<Vec<f32>>,
}

/// The origin of materials.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Origin {
    /// Files of the user, or materials that a program defines.
    Files,
    /// Procedural materials of the trainer.
    BuiltIn,
}

/// The materials of one source and their share of the training tasks. They are consecutive in the list of all
/// materials.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SourceShare {
    /// The source's label.
    pub label: String,
    /// The origin of the materials.
    pub origin: Origin,
    /// The number of materials.
    pub materials: usize,
    /// The source's share of the training tasks. Tasks of added procedural materials do not count. The shares of all
    /// sources have sum 1.
    pub share: f32,
}

impl SourceShare {
    /// Returns the share of a single source: all tasks.
    #[must_use]
    pub fn single(source: &Source, materials: usize) -> Self {
        Self {
            label: source.label().to_owned(),
            origin: if source.is_built_in() {
                Origin::BuiltIn
            } else {
                Origin::Files
            },
            materials,
            share: 1.0,
        }
    }
}

/// Materials of several sources, and the share of each source.
pub type MaterialsAndShares = (Vec<Box<dyn Material>>, Vec<SourceShare>);

/// Shares that do not fit the sources.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShareError {
    /// The number of shares differs from that of sources.
    #[error(
        "the number of values of {share} is {shares}, and that of {materials} is {sources}; give one share for each source",
        share = Name("share"), materials = Name("materials")
    )]
    Count {
        /// The number of sources.
        sources: usize,
        /// The number of shares.
        shares: usize,
    },
    /// A share, or the sum of all shares, is not a positive finite number.
    #[error(
        "a value or the sum of {share} is {0}, and both must be finite and above 0; give smaller positive numbers, or \
         remove the source from {materials}", share = Name("share"), materials = Name("materials")
    )]
    NotPositive(f32),
    /// There is a share, but a single source.
    #[error(
        "{share} has no effect with a single source: remove it, or give several {materials}",
        share = Name("share"), materials = Name("materials")
    )]
    Single,
}

impl Sources {
    /// Combines sources in proportion to `shares`. Without shares, each source is weighted by its number of materials.
    ///
    /// # Errors
    /// If `shares` is neither empty nor a list of one positive finite number for each source, with a finite sum.
    pub fn new(sources: Vec<Source>, shares: &[f32]) -> Result<Self, ShareError> {
        let sum: f32 = shares.iter().sum();
        let mut numbers = shares.iter().chain(shares.first().map(|_| &sum));
        if let Some(number) = numbers.find(|number| !(**number > 0.0 && number.is_finite())) {
            return Err(ShareError::NotPositive(*number));
        }
        let shares = match shares {
            [] => None,
            [_] if sources.len() == 1 => return Err(ShareError::Single),
            shares if shares.len() == sources.len() => {
                Some(shares.iter().map(|share| share / sum).collect())
            }
            _ => {
                return Err(ShareError::Count {
                    sources: sources.len(),
                    shares: shares.len(),
                });
            }
        };
        Ok(Self { sources, shares })
    }

    /// Returns the labels of the sources, with their shares if any were given.
    #[must_use]
    pub fn label(&self) -> String {
        let indexed = self.sources.iter().enumerate();
        let labels = indexed.map(|(index, source)| match &self.shares {
            Some(shares) => format!("{} ({:.3})", source.label(), shares[index]),
            None => source.label().to_owned(),
        });
        labels.collect::<Vec<_>>().join(" and ")
    }

    /// Reads the materials of all sources.
    ///
    /// # Errors
    /// If a source cannot be read, or two sources hold a material of the same name.
    pub fn load(&self) -> Result<MaterialsAndShares, SourceError> {
        let lists = self.sources.iter().map(Source::load);
        self.join(lists.collect::<Result<_, _>>()?)
    }

    /// Joins the materials of each source.
    ///
    /// # Errors
    /// If two sources hold a material of the same name.
    pub fn join(
        &self,
        lists: Vec<Vec<Box<dyn Material>>>,
    ) -> Result<MaterialsAndShares, SourceError> {
        let mut source_by_name: HashMap<String, &Source> = HashMap::new();
        for (source, list) in self.sources.iter().zip(&lists) {
            for material in list {
                if let Some(first) = source_by_name.insert(material.name().to_owned(), source) {
                    return Err(SourceError::DuplicateName {
                        name: material.name().to_owned(),
                        first: first.0.as_str().into(),
                        second: source.0.as_str().into(),
                    });
                }
            }
        }
        let total: usize = lists.iter().map(Vec::len).sum();
        let indexed = self.sources.iter().zip(&lists).enumerate();
        let source_shares = indexed.map(|(index, (source, list))| SourceShare {
            share: match &self.shares {
                Some(shares) => shares[index],
                None => list.len() as f32 / total as f32,
            },
            ..SourceShare::single(source, list.len())
        });
        let source_shares = source_shares.collect();
        Ok((lists.into_iter().flatten().collect(), source_shares))
    }
}
