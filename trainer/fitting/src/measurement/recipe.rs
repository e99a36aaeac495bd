//! A recipe with its basis: bundled, from a file, or made for given directions.

use std::borrow::Cow;
use std::io::{self, ErrorKind::NotFound};
use std::path::Path;
use std::sync::{Arc, LazyLock};

use super::instrument::Geometry;
use crate::linear::{Aperture, MaterialPrior, Posterior};
use crate::recipe::{RecipeDefect, RecipeFile, RecipeFileError};
use glimpse_core::error::Error;
use glimpse_core::geometry::Angles;
use glimpse_core::model::ModelKind;
use glimpse_kernels::scan::{ReadSample, ScanOutcome, scan_with_missing};
use glimpse_materials::basis::BasisTable;

use crate::bundled::{self, BundledRecipe};

/// The reason that a bundled recipe can be parsed.
const TESTED: &str = "a test parses all bundled recipes";

/// The basis of the bundled recipes without a pattern.
static ANY_BASIS: LazyLock<Arc<BasisTable>> =
    LazyLock::new(|| Arc::new(BasisTable::parse(bundled::ANY_BASIS).expect(TESTED)));

/// The prior of the bundled recipe `linear-any`.
static LINEAR_PRIOR: LazyLock<MaterialPrior> =
    LazyLock::new(|| NamedRecipe::any(ModelKind::Linear).prior);

/// A recipe with its basis.
#[derive(Clone, Debug)]
pub struct NamedRecipe {
    /// The file's name, or that of a bundled recipe.
    pub name: String,
    /// The recipe.
    pub file: Arc<RecipeFile>,
    /// The basis of the model Linear, and of recipes without a pattern.
    pub basis: Option<Arc<BasisTable>>,
    /// The prior of materials, for predictions: its own, or else that of `linear-any`.
    pub prior: MaterialPrior,
    /// The apertures of its samples; empty for exact directions.
    pub apertures: Vec<Option<Arc<Aperture>>>,
    /// True if it was made for the directions of readings, so that a fit is the expected material.
    is_of_directions: bool,
}

impl NamedRecipe {
    /// Combines a recipe with its basis.
    #[must_use]
    pub fn new(name: String, file: Arc<RecipeFile>, basis: Option<Arc<BasisTable>>) -> Self {
        let own = |basis: &Arc<BasisTable>| MaterialPrior::new(&file.recipe(), basis.clone());
        Self {
            prior: basis
                .as_ref()
                .and_then(own)
                .unwrap_or_else(|| LINEAR_PRIOR.clone()),
            name,
            file,
            basis,
            apertures: Vec::new(),
            is_of_directions: false,
        }
    }

    /// Parses a bundled recipe.
    #[must_use]
    pub fn bundled(bundled: &BundledRecipe) -> Self {
        let file = RecipeFile::new(bundled.bytes.to_vec()).expect(TESTED);
        let basis = match file.recipe().samples() {
            0 => Some(ANY_BASIS.clone()),
            _ => bundled
                .basis()
                .map(|bytes| Arc::new(BasisTable::parse(bytes).expect(TESTED))),
        };
        Self::new(bundled.name.to_owned(), Arc::new(file), basis)
    }

    /// Returns the bundled recipe of a model for readings at any directions.
    #[must_use]
    pub fn any(model: ModelKind) -> Self {
        let name = format!("{}-any", model.name());
        Self::bundled(bundled::find(&name).expect("each model has such a recipe"))
    }

    /// Reads a recipe's file, and its basis next to it. Without such a file, the name of a bundled recipe is accepted.
    ///
    /// # Errors
    /// If a file is missing or damaged.
    pub fn read(path: &Path) -> Result<Self, RecipeFileError> {
        if let Some(bundled) = bundled_without_file(path) {
            return Ok(Self::bundled(bundled));
        }
        let file = Arc::new(read_or_list(path)?);
        let checksum = file.recipe().basis_checksum();
        let basis =
            checksum.map(|checksum| BasisTable::read(&BasisTable::path_for(path), checksum));
        let basis = basis.transpose()?.map(Arc::new);
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        Ok(Self::new(name.into_owned(), file, basis))
    }

    /// Reads a recipe's file without its basis, or takes the name of a bundled recipe.
    ///
    /// # Errors
    /// If the file is missing or damaged.
    pub fn read_file(path: &Path) -> Result<Arc<RecipeFile>, RecipeFileError> {
        match bundled_without_file(path) {
            Some(bundled) => Ok(Self::bundled(bundled).file),
            None => read_or_list(path).map(Arc::new),
        }
    }

    /// Returns true if readings may be at any directions.
    #[must_use]
    pub fn is_any(&self) -> bool {
        self.file.recipe().samples() == 0
    }

    /// Returns the recipe for readings at any directions that continues after this recipe's samples: this one, or the
    /// bundled one of its model.
    #[must_use]
    pub fn continuing(&self) -> Self {
        if self.is_any() {
            self.clone()
        } else {
            Self::any(self.file.recipe().model())
        }
    }

    /// Returns the recipe of readings at directions, which this one without a pattern fits.
    ///
    /// # Errors
    /// If this recipe has a pattern, there are too many directions, or one is below the horizon.
    pub fn at(&self, directions: &[Angles<f32>]) -> Result<Self, RecipeDefect> {
        let basis = self.basis.clone().ok_or(RecipeDefect::NotAny)?;
        let file = self.file.at_directions(&basis, directions)?;
        let needs_basis = file.recipe().basis_checksum().is_some();
        Ok(Self {
            name: self.name.clone(),
            file: Arc::new(file),
            basis: needs_basis.then_some(basis),
            prior: self.prior.clone(),
            apertures: Vec::new(),
            is_of_directions: true,
        })
    }

    /// Returns the recipe of readings at directions or with apertures, which this one without a pattern fits.
    ///
    /// # Errors
    /// As [`at`](Self::at).
    pub fn at_geometries(&self, geometries: &[Geometry]) -> Result<Self, RecipeDefect> {
        let directions = geometries.iter().map(|geometry| geometry.angles);
        let apertures = geometries.iter().map(|geometry| geometry.aperture.clone());
        Ok(Self {
            apertures: apertures.collect(),
            ..self.at(&directions.collect::<Vec<_>>())?
        })
    }

    /// Fits the readings of a posterior, which `read` returns by sample: at any directions to the expected material, and
    /// with a pattern as a device does.
    ///
    /// # Errors
    /// As a scan on a device.
    pub fn scan(
        &self,
        posterior: &Posterior,
        read: &mut ReadSample<'_>,
    ) -> Result<ScanOutcome, Error> {
        if self.is_of_directions {
            self.file.fit(posterior, read)
        } else {
            scan_with_missing(&self.file.recipe(), read)
        }
    }

    /// Returns the basis of such a fit, if the model is Linear.
    #[must_use]
    pub fn basis_of(&self, posterior: &Posterior) -> Option<Cow<'_, BasisTable>> {
        let basis = self.basis.as_deref()?;
        Some(if self.is_of_directions {
            Cow::Owned(basis.with_kernels(posterior.kernels()))
        } else {
            Cow::Borrowed(basis)
        })
    }
}

/// Returns the bundled recipe of a name, unless there is such a file.
fn bundled_without_file(path: &Path) -> Option<&'static BundledRecipe> {
    let bundled = path.to_str().and_then(bundled::find);
    bundled.filter(|_| !path.exists())
}

/// Reads a recipe's file. The error for a missing file whose name has no extension lists the bundled recipes.
fn read_or_list(path: &Path) -> Result<RecipeFile, RecipeFileError> {
    let mut file = RecipeFile::read(path);
    if let Err(RecipeFileError::Read { path, source }) = &mut file
        && (source.kind(), path.extension()) == (NotFound, None)
    {
        let names: Vec<&str> = bundled::ALL.iter().map(|bundled| bundled.name).collect();
        let names = format!(
            "{source}; give a file, or a bundled recipe: {}",
            names.join(", ")
        );
        *source = io::Error::new(NotFound, names);
    }
    file
}
