//! Recipes of readings at given directions, made from a recipe without a pattern.

use glimpse_core::fit::{Noise, Ridge};
use glimpse_core::geometry::Angles;
use glimpse_core::numeric::Floats;
use glimpse_core::recipe::{Contents, Pattern};
use glimpse_core::section::MAX_SAMPLES;
use glimpse_materials::basis::BasisTable;

use super::file::{RecipeDefect, RecipeFile};
use super::sections::Arena;
use crate::linear::{ComponentsAt, bounded_precision};

impl RecipeFile {
    /// Returns the recipe of readings at directions, angles in radians, which this recipe without a pattern fits.
    ///
    /// `scales` are the standard deviations of the prior's noise, each over that of the reading; empty without noise.
    ///
    /// # Errors
    /// If this recipe is not one without a pattern, a direction is below the horizon, or there are too many.
    pub fn at_directions(
        &self,
        basis: &BasisTable,
        directions: &[Angles<f32>],
        scales: &[f32],
    ) -> Result<Self, RecipeDefect> {
        let contents = Contents::read(self.bytes())?;
        let own = contents.ridge.zip(contents.noise);
        let (ridge, noise) = own
            .filter(|_| self.recipe().samples() == 0)
            .ok_or(RecipeDefect::NotAny)?;
        if directions.len() > MAX_SAMPLES {
            return Err(RecipeDefect::TooManyDirections(directions.len()));
        }
        let at = ComponentsAt::new(basis, directions.to_vec());
        let arena = Arena::default();
        let list = |floats: Floats<'_>| floats.iter().collect::<Vec<f32>>();
        let difference = bounded_precision(&at.rows, &list(ridge.difference_precision));
        // Other models have parameters.
        let checksum = match contents.gauss_newton {
            None => ridge.basis_checksum,
            Some(_) => 0,
        };
        Self::write(&Contents {
            pattern: Some(Pattern {
                directions: arena.angles(directions),
                is_path: false,
                expected_loss: None,
            }),
            ridge: Some(Ridge {
                difference_precision: arena.floats(&difference),
                ..arena.ridge(&at, &list(ridge.precision), checksum)
            }),
            noise: Some(Noise {
                variance: noise.variance,
                scales: arena.floats(scales),
            }),
            ..contents
        })
    }
}
