//! The comparison of fits with their materials.

use std::sync::atomic::{AtomicBool, Ordering};

use glimpse_core::geometry::HalfDifference;
use glimpse_materials::loss::{loss_directions, mean_log_error};
use glimpse_materials::{Brdf, Material};
use rayon::prelude::*;

use super::EvaluationError;
use super::method::Method;
use super::report::{EvaluationReport, FitMetrics};
use crate::metrics::Metrics;
use crate::render::{Picture, render_sphere};

/// The width and height of rendered spheres, in pixels.
///
/// `trainer render sphere` draws the same pictures by default. A size of 256 would make an evaluation five times slower
/// and change a material's color difference by less than 2 %.
pub const SPHERE_SIZE: usize = 128;

/// An evaluator, which compares fits with the BRDF values and the rendered spheres of materials.
pub struct Evaluator<'a> {
    /// The materials.
    pub materials: &'a [Box<dyn Material>],
    at: Vec<HalfDifference<f32>>,
    references: Vec<Reference>,
}

struct Reference {
    values: Vec<[f32; 3]>,
    sphere: Picture,
}

impl Reference {
    fn new(material: &dyn Material, at: &[HalfDifference<f32>]) -> Self {
        let values = material.values_at(at);
        let sphere = render_sphere(material, SPHERE_SIZE).tone_map();
        Self { values, sphere }
    }

    /// Compares a BRDF with the material. Returns the metrics and the sphere of the BRDF.
    fn compare(&self, brdf: &dyn Brdf, at: &[HalfDifference<f32>]) -> (Metrics, Picture) {
        let loss = mean_log_error(brdf, at, &self.values);
        let sphere = render_sphere(brdf, SPHERE_SIZE).tone_map();
        let metrics = Metrics::from_spheres(loss, &self.sphere, &sphere);
        (metrics, sphere)
    }
}

/// Compares a BRDF with a material in the built-in studio.
#[must_use]
pub fn compare(brdf: &dyn Brdf, material: &dyn Material) -> Metrics {
    let at = loss_directions();
    let reference = Reference::new(material, &at);
    reference.compare(brdf, &at).0
}

impl<'a> Evaluator<'a> {
    /// Evaluates and renders the materials in the built-in studio.
    #[must_use]
    pub fn new(materials: &'a [Box<dyn Material>]) -> Self {
        let at = loss_directions();
        let references = materials
            .par_iter()
            .map(|material| Reference::new(&**material, &at))
            .collect();
        Self {
            materials,
            at,
            references,
        }
    }

    /// Returns the rendered sphere of a material.
    #[must_use]
    pub fn reference(&self, material: usize) -> &Picture {
        &self.references[material].sphere
    }

    /// Returns the loss of a BRDF.
    #[must_use]
    pub fn loss(&self, material: usize, fitted: &dyn Brdf) -> f64 {
        mean_log_error(fitted, &self.at, &self.references[material].values)
    }

    /// Compares a BRDF with a material. Returns the metrics and the sphere of the BRDF.
    #[must_use]
    pub fn compare(&self, material: usize, fitted: &dyn Brdf) -> (Metrics, Picture) {
        self.references[material].compare(fitted, &self.at)
    }

    /// Fits every material with a method and compares the fits. A random method runs once per seed.
    ///
    /// # Errors
    /// See [`EvaluationError`].
    pub fn evaluate(
        &self,
        method: &Method<'_>,
        seed: u64,
        seeds: u64,
    ) -> Result<EvaluationReport, EvaluationError> {
        self.evaluate_with_progress(method, seed, seeds, &|| {}, &AtomicBool::new(false))
    }

    /// Evaluates like [`evaluate`](Self::evaluate), and calls `done` after every material, on any thread. No new fit
    /// starts once `stop` is set.
    ///
    /// # Errors
    /// [`EvaluationError::Stopped`]
    pub fn evaluate_with_progress(
        &self,
        method: &Method<'_>,
        seed: u64,
        seeds: u64,
        done: &(dyn Fn() + Sync),
        stop: &AtomicBool,
    ) -> Result<EvaluationReport, EvaluationError> {
        let seeds = if method.is_random() { seeds.max(1) } else { 1 };
        let fit = |material: usize, offset: u64| {
            if stop.load(Ordering::Relaxed) {
                return Err(EvaluationError::Stopped);
            }
            // Each material and each repetition draws different samples.
            let seed = seed.wrapping_add((offset << 32) | material as u64);
            let outcome = method.fit(&*self.materials[material], seed)?;
            let (metrics, _) = self.compare(material, &*outcome.fitted);
            let forecast = outcome.forecast;
            Ok(FitMetrics { metrics, forecast })
        };
        let fits = (0..self.materials.len()).into_par_iter().map(|material| {
            let fits = (0..seeds).map(|offset| fit(material, offset)).collect();
            done();
            fits
        });
        let fits = fits.collect::<Result<Vec<_>, _>>()?;
        let names = self.materials.iter().map(|material| material.name());
        Ok(EvaluationReport::new(
            method,
            &names.collect::<Vec<_>>(),
            &fits,
        ))
    }
}
