//! Scans that choose each direction by the readings so far.

use glimpse_core::geometry::Angles;
use glimpse_fitting::linear::{Candidates, CoefficientPrior, Posterior, PosteriorReading};
use glimpse_fitting::recipe::RecipeFile;
use glimpse_fitting::route::Position;
use glimpse_kernels::scan::scan_with_missing;
use glimpse_materials::basis::Basis;

use super::EvaluationError;
use super::reader::Reader;

/// A recipe for readings at any directions, and a machine that reads where the expected loss decreases most.
#[derive(Clone, Debug)]
pub struct Adaptive<'a> {
    /// The recipe, without a pattern.
    pub file: &'a RecipeFile,
    /// The recipe's basis.
    pub basis: &'a Basis,
    /// The recipe's prior.
    pub prior: CoefficientPrior,
    /// The directions among which a scan chooses.
    pub candidates: Candidates,
    /// The directions that are read first.
    pub begin: Vec<Angles<f32>>,
    /// The number of readings.
    pub samples: usize,
    /// The arms at the start of a scan; None if directions are not chosen by the reduction of the expected loss per second.
    pub position: Option<Position>,
}

/// An adaptive scan of one material.
pub(super) struct AdaptiveScan {
    /// The fitted coefficients or parameters.
    pub(super) values: Vec<f32>,
    /// The posterior of the material.
    pub(super) posterior: Posterior,
    /// The time of motion and readings, in seconds; None without a machine.
    pub(super) seconds: Option<f64>,
}

impl Adaptive<'_> {
    /// Scans a material.
    ///
    /// # Errors
    /// [`EvaluationError::Scan`], or [`EvaluationError::Unreachable`] if no direction is within the limits.
    pub(super) fn scan(&self, reader: &mut Reader<'_>) -> Result<AdaptiveScan, EvaluationError> {
        let mut position = self.position.clone();
        let mut seconds = 0.0;
        let mut readings: Vec<PosteriorReading> = Vec::new();
        let mut directions: Vec<Angles<f32>> = Vec::new();
        let posterior = |readings: &[PosteriorReading]| {
            Posterior::new(&self.prior, readings).ok_or(EvaluationError::Unreachable)
        };
        for index in 0..self.samples {
            let known = [&directions[..], &self.begin];
            let next = posterior(&readings)?.next(&self.candidates, known, 1, &mut position);
            let next = next.first().ok_or(EvaluationError::Unreachable)?;
            let brdf = reader.read(index, next.angles);
            let brdf = brdf.ok_or(EvaluationError::Unreachable)?;
            seconds += next.seconds;
            directions.push(next.angles);
            readings.push(PosteriorReading::new(next.angles, brdf));
        }
        let file = self
            .file
            .at_directions(self.basis, &directions, &[])
            .map_err(|_| EvaluationError::Unreachable)?;
        let mut values = readings.iter().map(|reading| reading.brdf);
        Ok(AdaptiveScan {
            values: scan_with_missing(&file.recipe(), &mut |_, _| values.next())?.values,
            posterior: posterior(&readings)?,
            seconds: self.position.as_ref().map(|_| seconds),
        })
    }
}
