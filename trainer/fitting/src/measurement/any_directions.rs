//! The recipe that fits readings: a given one at its own directions, or one without a pattern at any others.

use std::path::Path;
use std::sync::{Arc, LazyLock};

use glimpse_core::geometry::Angles;
use glimpse_core::model::ModelKind;
use glimpse_materials::basis::Basis;
use glimpse_training::linear::CoefficientPrior;
use glimpse_training::recipe::{RecipeFile, RecipeFileError};

use super::rows::Rows;
use super::table::TableError;
use crate::bundled::{self, BundledRecipe};

/// The basis of the bundled recipes without a pattern.
static ANY_BASIS: LazyLock<Option<Arc<Basis>>> = LazyLock::new(|| {
    Basis::from_compact_bytes(bundled::ANY_BASIS)
        .ok()
        .map(Arc::new)
});

/// A recipe with its basis.
#[derive(Clone, Debug)]
pub struct NamedRecipe {
    /// The file's name, or that of a bundled recipe.
    pub name: String,
    /// The recipe.
    pub file: Arc<RecipeFile>,
    /// The basis of the model Linear, and of recipes without a pattern.
    pub basis: Option<Arc<Basis>>,
}

/// The recipe that fits some readings.
#[derive(Clone, Debug)]
pub struct ChosenRecipe {
    /// The recipe, whose pattern has the directions of the readings.
    pub recipe: NamedRecipe,
    /// The prior of the coefficients, for predictions.
    pub prior: CoefficientPrior,
    /// The reason that the given recipe does not fit the readings.
    pub off_pattern: Option<String>,
}

impl NamedRecipe {
    /// Returns the bundled recipe of a model for readings at any directions. None never happens: a test reads all.
    #[must_use]
    pub fn bundled(model: ModelKind) -> Option<Self> {
        Self::of_bundled(bundled::find(&format!("{}-any", model.name()))?)
    }

    fn of_bundled(bundled: &BundledRecipe) -> Option<Self> {
        let file = RecipeFile::new(bundled.bytes.to_vec()).ok()?;
        let basis = match file.recipe().samples() {
            0 => ANY_BASIS.clone(),
            _ => bundled
                .basis()
                .and_then(|bytes| Basis::from_compact_bytes(bytes).ok())
                .map(Arc::new),
        };
        Some(Self {
            name: bundled.name.to_owned(),
            file: Arc::new(file),
            basis,
        })
    }

    /// Reads a recipe's file, and its basis next to it. Without such a file, the name of a bundled recipe is accepted.
    ///
    /// # Errors
    /// If a file is missing or damaged.
    pub fn read(path: &Path) -> Result<Self, RecipeFileError> {
        if let Some(recipe) = Self::by_name(path) {
            return Ok(recipe);
        }
        let (file, basis) = RecipeFile::read_with_basis(path)?;
        let name = path.file_name().unwrap_or_default();
        Ok(Self {
            name: name.to_string_lossy().into_owned(),
            file: Arc::new(file),
            basis: basis.map(Arc::new),
        })
    }

    /// Reads a recipe's file without its basis, or takes the name of a bundled recipe.
    ///
    /// # Errors
    /// If the file is missing or damaged.
    pub fn read_file(path: &Path) -> Result<Arc<RecipeFile>, RecipeFileError> {
        match Self::by_name(path) {
            Some(recipe) => Ok(recipe.file),
            None => RecipeFile::read(path).map(Arc::new),
        }
    }

    /// Returns the bundled recipe of a name, unless there is such a file.
    fn by_name(path: &Path) -> Option<Self> {
        let bundled = path.to_str().and_then(bundled::find);
        Self::of_bundled(bundled.filter(|_| !path.exists())?)
    }

    /// Returns true if readings may be at any directions.
    #[must_use]
    pub fn is_any(&self) -> bool {
        self.file.recipe().samples() == 0
    }

    fn prior(&self) -> Option<CoefficientPrior> {
        CoefficientPrior::new(&self.file.recipe(), self.basis.clone()?)
    }

    /// Returns the recipe of directions, which this one without a pattern fits, with a deviation for each. None if there
    /// are too many.
    #[must_use]
    pub fn at(&self, directions: &[Angles<f32>], deviations: &[f32]) -> Option<ChosenRecipe> {
        let file = self
            .file
            .at_directions(self.basis.as_deref()?, directions, deviations)
            .ok()?;
        Some(ChosenRecipe {
            prior: self.prior()?,
            recipe: Self {
                name: self.name.clone(),
                basis: self
                    .basis
                    .clone()
                    .filter(|_| file.recipe().basis_checksum().is_some()),
                file: Arc::new(file),
            },
            off_pattern: None,
        })
    }

    /// Chooses the recipe for readings. If this one has a pattern with other directions, that is the bundled one of its
    /// model without a pattern.
    ///
    /// # Errors
    /// A row without directions above the horizon, or with directions whose likely cause is another convention.
    pub fn choose(&self, rows: &mut Rows) -> Result<ChosenRecipe, TableError> {
        let recipe = self.file.recipe();
        if self.is_any() {
            return self.at_rows(rows);
        }
        rows.refuse_noise()?;
        let pattern: Vec<Angles<f32>> = recipe.pattern().collect();
        match rows.match_to_pattern(&pattern) {
            Ok(_) => self
                .itself()
                .ok_or_else(|| rows.file_error(DEFECT.to_owned())),
            Err(TableError::OffPattern { message, .. }) => {
                let any = Self::bundled(recipe.model());
                let any = any.ok_or_else(|| rows.file_error(DEFECT.to_owned()))?;
                Ok(ChosenRecipe {
                    off_pattern: Some(message),
                    ..any.at_rows(rows)?
                })
            }
            Err(error) => Err(error),
        }
    }

    /// Chooses the recipe for readings at directions, one of each: of the pattern, or any others.
    #[must_use]
    pub fn choose_at(&self, directions: &[Angles<f32>]) -> Option<ChosenRecipe> {
        let recipe = self.file.recipe();
        match self.is_any() {
            true => self.at(directions, &[]),
            false if recipe.pattern().eq(directions.iter().copied()) => self.itself(),
            false => Self::bundled(recipe.model())?.at(directions, &[]),
        }
    }

    /// Returns this recipe with a pattern, and its prior, or else the bundled one.
    #[must_use]
    pub fn itself(&self) -> Option<ChosenRecipe> {
        Some(ChosenRecipe {
            recipe: self.clone(),
            prior: self
                .prior()
                .or_else(|| Self::bundled(ModelKind::Linear)?.prior())?,
            off_pattern: None,
        })
    }

    fn at_rows(&self, rows: &mut Rows) -> Result<ChosenRecipe, TableError> {
        rows.forget_indices();
        let (directions, deviations): (Vec<_>, Vec<_>) = rows.directions()?.into_iter().unzip();
        if directions.is_empty() {
            return Err(rows.file_error("no row has a reading; fill in r, g, b".to_owned()));
        }
        self.at(&directions, &deviations).ok_or_else(|| {
            rows.file_error(format!(
                "it has {} different directions, more than a recipe has samples; give at most 4096",
                directions.len()
            ))
        })
    }
}

/// The message of a defect of the program.
const DEFECT: &str = "the program lacks its recipes without a pattern; build it again";
