//! Judging methods on materials: fit each from a few of its samples, compare with all of it.

use glimpse_core::angles::{Angles, HalfDifference};
use glimpse_core::fit::{Fit, Workspace};
use glimpse_core::model::{Model, ModelKind, ParameterSet, Sample};
use glimpse_core::recipe::{Descent, Recipe};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::material::Material;
use crate::meta::gradient::LaneModel;
use crate::meta::start::random_start;
use crate::metrics::{CompareError, PictureErrors, Scores, mean_log_error};
use crate::render::{Environment, Picture, render_sphere};
use crate::sampling::uniform_valid;
use crate::with_model;

/// Directions at which a fit is compared with its material.
pub const DIRECTIONS: usize = 16_384;
/// Width and height of the rendered spheres, in pixels.
pub const SPHERE: usize = 128;
/// Step size and steps of the method Random, which uses Adam.
const RANDOM_RATE: f32 = 1e-3;

/// Why a method cannot be judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum JudgeError {
    /// Its model is not fitted by descent.
    #[error("the model {0} is not fitted by descent, and only such fits can be evaluated yet")]
    Model(ModelKind),
    /// Pictures cannot be compared: never in practice, all have the same size.
    #[error(transparent)]
    Compare(#[from] CompareError),
}

/// Fitted parameters, flat in the model's order.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// The model.
    pub model: ModelKind,
    /// Its parameters.
    pub parameters: Vec<f32>,
}

impl Fitted {
    /// The model's BRDF, sr^-1 (not times the cosine), at many places. NaN for Linear, whose
    /// coefficients say nothing without their basis.
    pub fn brdf_batch(&self, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]) {
        with_model!(self.model, M => {
            let mut parameters = <M as Model>::Parameters::filled(0.0);
            crate::meta::unflatten(&self.parameters, &mut parameters);
            <M as LaneModel>::evaluate(&parameters, at, brdf);
        }, _ => brdf.fill([f32::NAN; 3]));
    }
}

/// How samples of a material become parameters.
#[derive(Clone, Copy, Debug)]
pub enum Method<'a> {
    /// A recipe's pattern, start and step sizes.
    Ours(&'a Recipe<'a>),
    /// A recipe's start and step sizes, on random samples.
    Meta(&'a Recipe<'a>),
    /// Adam from a random start on random samples.
    Random {
        /// The model.
        model: ModelKind,
        /// n.
        samples: usize,
        /// Adam steps.
        steps: usize,
    },
}

impl Method<'_> {
    /// The name on the command line and in tables.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Ours(_) => "ours",
            Self::Meta(_) => "meta",
            Self::Random { .. } => "random",
        }
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> ModelKind {
        match self {
            Self::Ours(recipe) | Self::Meta(recipe) => recipe.model(),
            Self::Random { model, .. } => *model,
        }
    }

    /// n.
    #[must_use]
    pub fn samples(&self) -> usize {
        match self {
            Self::Ours(recipe) | Self::Meta(recipe) => recipe.samples(),
            Self::Random { samples, .. } => *samples,
        }
    }

    /// True if the outcome depends on a seed.
    #[must_use]
    pub fn is_random(&self) -> bool {
        !matches!(self, Self::Ours(_))
    }

    /// Fits a material, as the device would: in f32, through core's own fit.
    ///
    /// # Errors
    /// [`JudgeError::Model`] if the model is not fitted by descent.
    pub fn fit(&self, material: &dyn Material, seed: u64) -> Result<Fitted, JudgeError> {
        let refused = JudgeError::Model(self.model());
        let angles = match self {
            Self::Ours(recipe) => recipe.pattern().collect(),
            Self::Meta(_) | Self::Random { .. } => uniform_valid(self.samples(), seed),
        };
        let samples = measure(material, &angles);
        let parameters = with_model!(self.model(), M => match self {
            Self::Ours(recipe) | Self::Meta(recipe) => {
                learn::<M>(&recipe.descent().ok_or(refused)?, &samples)
            }
            Self::Random { steps, .. } => adam::<M>(&samples, *steps, seed),
        }, _ => return Err(refused));
        Ok(Fitted {
            model: self.model(),
            parameters,
        })
    }
}

/// Measures a material at some directions.
#[must_use]
pub fn measure(material: &dyn Material, angles: &[Angles<f32>]) -> Vec<Sample<f32>> {
    let weight = 1.0 / (3.0 * angles.len() as f32);
    angles
        .iter()
        .map(|angles| Sample {
            at: HalfDifference::from_angles(*angles),
            measured: material.brdf(*angles),
            weight,
        })
        .collect()
}

fn learn<M: Model>(descent: &Descent<'_>, samples: &[Sample<f32>]) -> Vec<f32> {
    let mut workspace = Workspace::<M>::new();
    let mut fit = Fit::start(
        &mut workspace,
        descent.initial(),
        descent.step_sizes(),
        descent.inner_steps(),
    );
    while !fit
        .advance(&mut workspace, samples, usize::MAX)
        .is_complete()
    {}
    workspace.parameters().iter().copied().collect()
}

/// The method Random: Adam with its usual constants, on all samples at every step.
fn adam<M: Model>(samples: &[Sample<f32>], steps: usize, seed: u64) -> Vec<f32> {
    const DECAYS: [f32; 2] = [0.9, 0.999];
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(1);
    let mut parameters = M::Parameters::filled(0.0);
    crate::meta::unflatten(&random_start(M::KIND, &mut random), &mut parameters);
    let mut moments = vec![[0.0_f32; 2]; M::PARAMETERS];
    for step in 1..=steps {
        let mut gradient = M::Parameters::filled(0.0);
        for sample in samples {
            M::accumulate_gradient::<f32, false>(&parameters, sample, &mut gradient);
        }
        let bias = DECAYS.map(|decay| 1.0 - decay.powi(step as i32));
        let entries = parameters.iter_mut().zip(gradient.iter());
        for ((parameter, g), [mean, square]) in entries.zip(&mut moments) {
            *mean += (1.0 - DECAYS[0]) * (g - *mean);
            *square += (1.0 - DECAYS[1]) * (g * g - *square);
            *parameter -= RANDOM_RATE * (*mean / bias[0]) / ((*square / bias[1]).sqrt() + 1e-8);
        }
    }
    parameters.iter().copied().collect()
}

/// Materials, their values and their spheres: all that fits are compared with.
pub struct Judge<'a> {
    materials: &'a [Box<dyn Material>],
    at: Vec<HalfDifference<f32>>,
    environment: Environment,
    references: Vec<Reference>,
}

struct Reference {
    values: Vec<[f32; 3]>,
    sphere: Picture,
}

/// A material's name and how well it was fitted.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct MaterialScores {
    /// Its name.
    pub name: String,
    /// Its scores, averaged over the seeds.
    #[serde(flatten)]
    pub scores: Scores,
}

/// How well a method does.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Verdict {
    /// The method.
    pub method: &'static str,
    /// The model.
    pub model: &'static str,
    /// n.
    pub samples: usize,
    /// Means over the materials.
    #[serde(flatten)]
    pub scores: Scores,
    /// How many seeds were averaged over.
    pub seeds: u64,
    /// Standard deviation of the mean loss from seed to seed.
    pub loss_spread: f64,
    /// Each material.
    pub materials: Vec<MaterialScores>,
}

impl<'a> Judge<'a> {
    /// Evaluates and renders the materials; `seed` chooses the directions of the loss.
    #[must_use]
    pub fn new(materials: &'a [Box<dyn Material>], seed: u64) -> Self {
        let angles = uniform_valid(DIRECTIONS, seed);
        let at: Vec<_> = angles
            .into_iter()
            .map(HalfDifference::from_angles)
            .collect();
        let environment = Environment::studio();
        let references = materials
            .par_iter()
            .map(|material| {
                let mut values = vec![[0.0; 3]; at.len()];
                material.brdf_batch(&at, &mut values);
                let brdf = |at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]| {
                    material.brdf_batch(at, brdf);
                };
                let sphere = render_sphere(&brdf, &environment, SPHERE).tone_map();
                Reference { values, sphere }
            })
            .collect();
        Self {
            materials,
            at,
            environment,
            references,
        }
    }

    /// The materials.
    #[must_use]
    pub fn materials(&self) -> &'a [Box<dyn Material>] {
        self.materials
    }

    /// The rendered sphere of a material.
    #[must_use]
    pub fn reference(&self, material: usize) -> &Picture {
        &self.references[material].sphere
    }

    /// Renders a fit.
    #[must_use]
    pub fn render(&self, fitted: &Fitted) -> Picture {
        let brdf = |at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]| fitted.brdf_batch(at, brdf);
        render_sphere(&brdf, &self.environment, SPHERE).tone_map()
    }

    /// Compares a fit of a material with it.
    ///
    /// # Errors
    /// None in practice: all pictures have the same size.
    pub fn score(
        &self,
        material: usize,
        fitted: &Fitted,
    ) -> Result<(Scores, Picture), CompareError> {
        let reference = &self.references[material];
        let brdf = |at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]| fitted.brdf_batch(at, brdf);
        let loss = mean_log_error(&brdf, &self.at, &reference.values);
        let sphere = self.render(fitted);
        let errors = PictureErrors::between(&reference.sphere, &sphere)?;
        Ok((Scores::new(loss, errors), sphere))
    }

    /// Fits every material by a method, with so many seeds if it is random, and compares.
    ///
    /// # Errors
    /// [`JudgeError::Model`] if the model is not fitted by descent.
    pub fn judge(&self, method: Method<'_>, seed: u64, seeds: u64) -> Result<Verdict, JudgeError> {
        let seeds = if method.is_random() { seeds.max(1) } else { 1 };
        let all: Vec<Vec<Scores>> = (0..self.materials.len())
            .into_par_iter()
            .map(|material| {
                (0..seeds)
                    .map(|offset| {
                        // Each material and each repetition draws samples of its own.
                        let seed = seed.wrapping_add((offset << 32) | material as u64);
                        let fitted = method.fit(&*self.materials[material], seed)?;
                        Ok(self.score(material, &fitted)?.0)
                    })
                    .collect()
            })
            .collect::<Result<_, JudgeError>>()?;
        let materials = self
            .materials
            .iter()
            .zip(&all)
            .map(|(material, scores)| MaterialScores {
                name: material.name().to_owned(),
                scores: Scores::mean(scores.iter().copied()).unwrap_or_default(),
            })
            .collect();
        let by_seed: Vec<f64> = (0..seeds as usize)
            .map(|seed| all.iter().map(|scores| scores[seed].loss).sum::<f64>() / all.len() as f64)
            .collect();
        Ok(Verdict {
            method: method.name(),
            model: method.model().name(),
            samples: method.samples(),
            scores: Scores::mean(all.into_iter().flatten()).unwrap_or_default(),
            seeds,
            loss_spread: deviation(&by_seed),
            materials,
        })
    }
}

/// Standard deviation of a sample; 0 of a single number.
fn deviation(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (squares / (values.len().max(2) - 1) as f64).sqrt()
}
