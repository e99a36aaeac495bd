//! Scans that choose each direction by the readings so far.

use std::sync::Arc;

use glimpse_core::geometry::Angles;
use glimpse_core::gonio::Limits;
use glimpse_fitting::linear::{Candidates, CoefficientPrior, Posterior, PosteriorReading};
use glimpse_fitting::recipe::RecipeFile;
use glimpse_fitting::route::Position;
use glimpse_kernels::scan::{ScanOutcome, scan_with_missing};
use glimpse_materials::basis::Basis;

use super::EvaluationError;

/// A recipe for readings at any directions, and a machine that reads where the expected loss decreases most.
#[derive(Clone, Debug)]
pub struct Adaptive<'a> {
    file: &'a RecipeFile,
    basis: &'a Basis,
    prior: CoefficientPrior,
    candidates: Arc<Candidates>,
    /// The directions that are read first.
    begin: Vec<Angles<f32>>,
    /// The number of readings.
    samples: usize,
    /// The arms at the start of a scan, if directions are chosen by seconds.
    position: Option<Position>,
}

/// An adaptive scan of one material.
#[derive(Clone, Debug)]
pub struct AdaptiveScan {
    /// The fit.
    pub outcome: ScanOutcome,
    /// The posterior of the material.
    pub posterior: Posterior,
    /// The time of motion and readings, in seconds; None without a machine.
    pub seconds: Option<f64>,
}

impl<'a> Adaptive<'a> {
    /// Creates scans of `samples` readings with a recipe without a pattern, its basis, and its prior. They begin with the
    /// directions `begin`. With the position of a machine's arms at the start of a scan, a direction is chosen by the
    /// reduction of the expected loss per second.
    #[must_use]
    pub fn new(
        (file, basis, prior): (&'a RecipeFile, &'a Basis, CoefficientPrior),
        begin: Vec<Angles<f32>>,
        samples: usize,
        limits: &Limits,
        position: Option<Position>,
    ) -> Self {
        Self {
            candidates: Arc::new(Candidates::new(basis, limits)),
            file,
            basis,
            prior,
            begin,
            samples,
            position,
        }
    }

    /// The recipe.
    #[must_use]
    pub fn file(&self) -> &'a RecipeFile {
        self.file
    }

    /// The recipe's basis.
    #[must_use]
    pub fn basis(&self) -> &'a Basis {
        self.basis
    }

    /// The number of readings.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Scans a material. `read` takes the index and the direction of a reading, and returns the BRDF (linear RGB, sr^-1,
    /// not times the cosine).
    ///
    /// # Errors
    /// [`EvaluationError::Scan`], or [`EvaluationError::Unreachable`] if no direction is within the limits.
    pub fn scan(
        &self,
        read: &mut dyn FnMut(u16, Angles<f32>) -> Option<[f32; 3]>,
    ) -> Result<AdaptiveScan, EvaluationError> {
        let mut position = self.position.clone();
        let mut seconds = 0.0;
        let mut readings: Vec<PosteriorReading> = Vec::new();
        let posterior = |readings: &[PosteriorReading]| {
            Posterior::new(&self.prior, readings).ok_or(EvaluationError::Unreachable)
        };
        while readings.len() < self.samples {
            let measured: Vec<Angles<f32>> = readings.iter().map(|each| each.angles).collect();
            let known = [&measured[..], &self.begin];
            let next = posterior(&readings)?.next(&self.candidates, known, 1, &mut position);
            let next = next.first().ok_or(EvaluationError::Unreachable)?;
            seconds += next.seconds;
            let angles = next.angles;
            let brdf = read(readings.len() as u16, angles).ok_or(EvaluationError::Unreachable)?;
            readings.push(PosteriorReading::new(angles, brdf));
        }
        let directions: Vec<Angles<f32>> = readings.iter().map(|each| each.angles).collect();
        let file = self
            .file
            .at_directions(self.basis, &directions, &[])
            .map_err(|_| EvaluationError::Unreachable)?;
        let values = |index: u16, _| Some(readings[usize::from(index)].brdf);
        Ok(AdaptiveScan {
            outcome: scan_with_missing(&file.recipe(), &mut { values })?,
            posterior: posterior(&readings)?,
            seconds: self.position.as_ref().map(|_| seconds),
        })
    }
}
