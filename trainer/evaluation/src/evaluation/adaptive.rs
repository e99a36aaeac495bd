//! Scans that choose each direction by the readings so far.

use glimpse_core::geometry::Angles;
use glimpse_fitting::linear::{Candidates, Posterior, PosteriorReading};
use glimpse_fitting::measurement::NamedRecipe;
use glimpse_fitting::route::Position;

use super::EvaluationError;
use super::outcome::Outcome;
use super::reader::Reader;

/// A recipe for readings at any directions, and a machine that reads where the expected loss decreases most.
#[derive(Clone, Debug)]
pub struct Adaptive<'a> {
    /// The recipe, without a pattern.
    pub recipe: &'a NamedRecipe,
    /// The directions among which a scan chooses.
    pub candidates: Candidates,
    /// The directions that are read first.
    pub begin: Vec<Angles<f32>>,
    /// The number of readings.
    pub samples: usize,
    /// The arms at the start of a scan; None if directions are not chosen by the reduction of the expected loss per second.
    pub position: Option<Position>,
}

impl Adaptive<'_> {
    /// Scans a material.
    ///
    /// # Errors
    /// [`EvaluationError::Scan`], or [`EvaluationError::Unreachable`] if no direction is within the limits.
    pub(super) fn scan(&self, reader: &mut Reader<'_>) -> Result<Outcome, EvaluationError> {
        let mut position = self.position.clone();
        let mut seconds = 0.0;
        let mut readings: Vec<PosteriorReading> = Vec::new();
        let mut directions: Vec<Angles<f32>> = Vec::new();
        let posterior = |readings: &[PosteriorReading]| {
            Posterior::new(&self.recipe.prior, readings).ok_or(EvaluationError::Unreachable)
        };
        for index in 0..self.samples {
            let known = [&directions[..], &self.begin];
            let next = posterior(&readings)?.next(&self.candidates, known, 1, &mut position);
            let next = next.first().ok_or(EvaluationError::Unreachable)?;
            let reading = reader.posterior_reading(index, next.angles);
            readings.push(reading.ok_or(EvaluationError::Unreachable)?);
            seconds += next.seconds;
            directions.push(next.angles);
        }
        let recipe = self.recipe.at(&directions);
        let recipe = recipe.map_err(|_| EvaluationError::Unreachable)?;
        let samples = readings.into_iter().map(Some).collect::<Vec<_>>();
        let mut outcome = Outcome::of_readings(&recipe, &samples, reader.material)?;
        outcome.forecast.seconds = self.position.as_ref().map(|_| seconds);
        Ok(outcome)
    }
}
