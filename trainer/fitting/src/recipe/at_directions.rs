//! Recipes of readings at given directions, made from a recipe without a pattern, and their fits on the host.

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::fit::{GaussNewton, Ridge, Start};
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::ModelKind;
use glimpse_core::numeric::{Floats, PackedRows, Rows};
use glimpse_core::recipe::{Contents, Pattern};
use glimpse_core::section::MAX_SAMPLES;
use glimpse_kernels::scan::{ReadSample, ScanOutcome, scan_from};
use glimpse_materials::basis::{BasisTable, KernelSum};

use super::file::{RecipeDefect, RecipeFile};
use super::sections::Arena;
use crate::linear::{ComponentsAt, Posterior, bounded_precision};

const CHANNELS: usize = 3;

impl RecipeFile {
    /// Returns the recipe of readings at directions, angles in radians, which this recipe without a pattern fits.
    ///
    /// # Errors
    /// If this recipe is not one without a pattern, a direction is below the horizon, or there are too many.
    pub fn at_directions(
        &self,
        basis: &BasisTable,
        directions: &[Angles<f32>],
    ) -> Result<Self, RecipeDefect> {
        let contents = Contents::read(self.bytes())?;
        let is_any = self.recipe().samples() == 0 && contents.noise.is_some();
        let ridge = contents.ridge.filter(|_| is_any);
        let ridge = ridge.ok_or(RecipeDefect::NotAny)?;
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
            ..contents
        })
    }

    /// Fits the readings of a posterior, with this recipe of their directions. `read` returns them by sample, as for
    /// [`scan_from`].
    ///
    /// The fit of Linear is the expected material: the values are its [coefficients](Posterior::coefficients). The other
    /// models start from it, and their virtual readings are those of the expected material, discrepancy included.
    ///
    /// # Errors
    /// As a scan on a device.
    pub fn fit(
        &self,
        posterior: &Posterior,
        read: &mut ReadSample<'_>,
    ) -> Result<ScanOutcome, Error> {
        let coefficients = posterior.coefficients();
        let components = posterior.basis().components();
        let lists = [0, 1, 2].map(|channel: usize| coefficients[channel].split_at(components));
        let discrepancy = posterior.kernels().sum(lists.map(|(_, weights)| weights));
        let file = self.with_discrepancy(&discrepancy).ok();
        let file = file.ok_or(Error::new(ErrorCode::Diverged))?;
        // The discrepancy of each channel is a component with the coefficient 1.
        let with_discrepancy = [0, 1, 2].map(|channel| {
            let mut list = lists[channel].0.to_vec();
            list.extend((0..CHANNELS).map(|other| f32::from(u8::from(other == channel))));
            list
        });
        let known = with_discrepancy.each_ref().map(Vec::as_slice);
        let mut outcome = scan_from(&file.recipe(), read, Some(known))?;
        if self.recipe().model() == ModelKind::Linear {
            outcome.values = coefficients.concat();
        }
        Ok(outcome)
    }

    /// Returns the recipe with the discrepancy of a material as three more components, one for each channel.
    fn with_discrepancy(&self, discrepancy: &KernelSum) -> Result<Self, RecipeDefect> {
        let contents = Contents::read(self.bytes())?;
        let sections = contents.pattern.zip(contents.ridge);
        let (pattern, ridge) = sections.ok_or(RecipeDefect::NotAny)?;
        let arena = Arena::default();
        let components = ridge.precision.len();
        let extended = |rows: PackedRows<'_>, directions: Floats<'_>| {
            let rows = rows.of(components);
            let entries = directions.triples().enumerate().flat_map(|(row, angles)| {
                let at = HalfDifference::from_angles(Angles::from_array(angles));
                let own = (0..components).map(move |column| rows.entry(row, column));
                own.chain(discrepancy.at(&at))
            });
            PackedRows {
                entries: arena
                    .floats(&entries.collect::<Vec<_>>())
                    .words()
                    .as_flattened(),
                scales: Floats::default(),
            }
        };
        let precision = |floats: Floats<'_>| {
            let list = floats.iter().chain([1.0; CHANNELS]);
            arena.floats(&list.collect::<Vec<_>>())
        };
        let start = contents.start.map(|start| {
            // Units do not depend on the discrepancy.
            let rows = start.hidden.chunks_exact(components);
            let hidden = rows.flat_map(|row| [row, &[0; CHANNELS]].concat());
            Start {
                hidden: arena.bytes(&hidden.collect::<Vec<_>>()),
                ..start
            }
        });
        Self::write(&Contents {
            ridge: Some(Ridge {
                precision: precision(ridge.precision),
                difference_precision: precision(ridge.difference_precision),
                rows: extended(ridge.rows, pattern.directions),
                ..ridge
            }),
            gauss_newton: contents.gauss_newton.map(|steps| GaussNewton {
                rows: extended(steps.rows, steps.directions),
                ..steps
            }),
            start,
            ..contents
        })
    }
}
