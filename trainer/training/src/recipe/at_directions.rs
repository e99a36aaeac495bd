//! Recipes of readings at given directions, made from a recipe without a pattern.

use glimpse_core::fit::{Noise, Ridge};
use glimpse_core::geometry::Angles;
use glimpse_core::numeric::{Floats, PackedRows};
use glimpse_core::recipe::{Contents, Pattern};
use glimpse_materials::basis::Basis;

use super::file::{RecipeDefect, RecipeFile};
use crate::linear::ComponentsAt;
use crate::meta::correction::bounded_precision;

impl RecipeFile {
    /// Returns the recipe of readings at directions, angles in radians, which this recipe without a pattern fits.
    ///
    /// `deviations` are the standard deviations of the readings' noise, each relative to its reading; empty without noise.
    ///
    /// # Errors
    /// If a direction is below the horizon, or there are too many.
    pub fn at_directions(
        &self,
        basis: &Basis,
        directions: &[Angles<f32>],
        deviations: &[f32],
    ) -> Result<Self, RecipeDefect> {
        let contents = Contents::read(self.bytes())?;
        let at = ComponentsAt::new(basis, directions.to_vec());
        let floats = |values: &[f32]| -> Vec<u8> {
            values.iter().copied().flat_map(f32::to_le_bytes).collect()
        };
        let list = |floats: Floats<'_>| floats.iter().collect::<Vec<f32>>();
        let bounded = |precision| floats(&bounded_precision(&at.rows, &list(precision)));
        let triples = directions.iter();
        let triples = triples.flat_map(|each| [each.theta_h, each.theta_d, each.phi_d]);
        let triples = floats(&triples.collect::<Vec<_>>());
        let (center, rows) = (floats(&at.means()), floats(&at.rows));
        let Some((ridge, noise)) = contents.ridge.zip(contents.noise) else {
            return Self::new(self.bytes().to_vec());
        };
        let [precision, difference] = [ridge.precision, ridge.difference_precision].map(bounded);
        let scales = deviations.iter();
        let scales = scales.map(|each| (noise.variance / (noise.variance + each * each)).sqrt());
        let scales = floats(&scales.collect::<Vec<_>>());
        Self::write(&Contents {
            pattern: Some(Pattern {
                directions: Floats::new(&triples),
                is_path: false,
                expected_loss: None,
            }),
            ridge: Some(Ridge {
                precision: Floats::new(&precision),
                difference_precision: Floats::new(&difference),
                center: Floats::new(&center),
                rows: PackedRows {
                    entries: &rows,
                    scales: Floats::default(),
                },
                // Other models have parameters.
                basis_checksum: match contents.gauss_newton {
                    None => ridge.basis_checksum,
                    Some(_) => 0,
                },
            }),
            noise: Some(Noise {
                variance: noise.variance,
                scales: Floats::new(&scales),
            }),
            ..contents
        })
    }
}
