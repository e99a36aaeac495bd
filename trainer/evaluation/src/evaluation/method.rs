//! Methods: the directions that they measure and the way they fit.

use std::sync::Arc;

use glimpse_core::fit::{AnyModel, Channels, Estimator, ScanModel, Sgd};
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{ModelKind, Sample, Samples, Slot, slot_of};
use glimpse_core::recipe::Recipe;
use glimpse_fitting::linear::{Aperture, ComponentsAt};
use glimpse_fitting::measurement::{Geometry, NamedRecipe};
use glimpse_kernels::ModelKernels;
use glimpse_kernels::scan::scan_with_missing;
use glimpse_materials::Material;
use glimpse_materials::basis::BasisTable;
use glimpse_materials::sampling::uniform_valid;

use super::adaptive::Adaptive;
use super::ggx::Ggx;
use super::outcome::{Forecast, Outcome};
use super::reader::{Degradation, Reader};
use super::{EvaluationError, adam};

/// Names of methods in tables, pictures and reports.
pub mod names {
    /// Random directions, and a fit from a random start.
    pub const RANDOM: &str = "Random";
    /// Random directions, and a learned start (paper).
    pub const META: &str = "Meta";
    /// The directions of Nielsen, Jensen and Ramamoorthi 2015.
    pub const NJR15: &str = "NJR15";
    /// The paper's method: a recipe of schedule `paper`.
    pub const PAPER: &str = "the paper's";
    /// A recipe of schedule `prior`, which completes the readings.
    pub const GLIMPSE: &str = "Glimpse";
    /// A diffuse and a GGX lobe.
    pub const GGX: &str = "GGX";
    /// The best fit with unlimited samples.
    pub const OPTIMUM: &str = "Optimum";
}

/// The directions that a method measures.
#[derive(Clone, Debug, PartialEq)]
pub enum SampleDirections {
    /// These angles, in radians.
    Pattern(Vec<Angles<f32>>),
    /// A number of uniform valid directions, drawn again for each material and seed.
    Random(usize),
    /// A number of directions that a scan chooses.
    Chosen(usize),
    /// A number of uniform valid directions that is large enough for the result to converge. It is 0 if the method
    /// draws directions during the fit.
    Converged(usize),
}

/// A function that fits readings at the method's directions, with a seed. The directions are empty if it chooses them.
type Run<'a> = dyn Fn(&mut Reader<'_>, &[Angles<f32>], u64) -> Result<Outcome, EvaluationError>
    + Send
    + Sync
    + 'a;

/// A method: directions to measure a material at, and an algorithm that fits the readings.
pub struct Method<'a> {
    /// The name in tables, pictures and reports.
    pub(super) name: &'static str,
    /// The model.
    pub model: ModelKind,
    directions: SampleDirections,
    /// The degradation of readings.
    pub degradation: Degradation,
    /// The directions that the readings really have, by sample; empty for those of the method.
    displaced: Vec<Angles<f32>>,
    /// The apertures of samples; empty for exact directions.
    apertures: Vec<Option<Arc<Aperture>>>,
    run: Box<Run<'a>>,
}

/// The number of directions at which the method Optimum for the model Linear has converged.
pub const LINEAR_OPTIMUM_DIRECTIONS: usize = 8_192;

impl<'a> Method<'a> {
    fn new(
        (name, model): (&'static str, ModelKind),
        directions: SampleDirections,
        run: impl Fn(&mut Reader<'_>, &[Angles<f32>], u64) -> Result<Outcome, EvaluationError>
        + Send
        + Sync
        + 'a,
    ) -> Self {
        Self {
            name,
            model,
            directions,
            degradation: Degradation::default(),
            displaced: Vec::new(),
            apertures: Vec::new(),
            run: Box::new(run),
        }
    }

    /// Creates a scan with a recipe: its pattern and its fit, as on a device. Linear needs the recipe's basis.
    ///
    /// # Errors
    /// [`EvaluationError::Basis`]
    pub fn with_recipe(
        recipe: &Recipe<'a>,
        basis: Option<&'a BasisTable>,
    ) -> Result<Self, EvaluationError> {
        let (recipe, model) = (*recipe, recipe.model());
        if recipe.basis_checksum() != basis.map(BasisTable::checksum) {
            return Err(EvaluationError::Basis);
        }
        let name = match recipe.estimator() {
            Estimator::Ridge { coefficients, .. }
                if coefficients.net.is_some() || coefficients.noise.is_some() =>
            {
                names::GLIMPSE
            }
            _ => names::PAPER,
        };
        let pattern = SampleDirections::Pattern(recipe.pattern().collect());
        Ok(Self::new((name, model), pattern, move |reader, _, _| {
            let scan = scan_with_missing(&recipe, &mut |index, angles| {
                reader.read(usize::from(index), angles)
            })?;
            let mut outcome = Outcome::new(model, scan.values, basis)?;
            outcome.forecast.prediction = scan.prediction;
            Ok(outcome)
        }))
    }

    /// Creates a scan with a recipe, and the fit of the host: at any directions the expected material, and with a pattern
    /// that of a device. The recipe's prior predicts losses if the recipe does not.
    ///
    /// # Errors
    /// [`EvaluationError::Basis`]
    pub fn on_host(named: &'a NamedRecipe) -> Result<Self, EvaluationError> {
        let recipe = named.file.recipe();
        let on_device = Self::with_recipe(&recipe, named.basis.as_deref())?;
        let run = move |reader: &mut Reader<'_>, pattern: &[Angles<f32>], _| {
            let samples = pattern.iter().enumerate();
            let samples = samples.map(|(index, angles)| reader.posterior_reading(index, *angles));
            Outcome::of_readings(named, &samples.collect::<Vec<_>>(), reader.material)
        };
        let names = (on_device.name, on_device.model);
        Ok(Self {
            apertures: named.apertures.clone(),
            ..Self::new(names, on_device.directions, run)
        })
    }

    /// Creates scans that choose each direction by the readings so far.
    #[must_use]
    pub fn adaptive(adaptive: Adaptive<'a>) -> Self {
        let model = adaptive.recipe.file.recipe().model();
        let directions = SampleDirections::Chosen(adaptive.samples);
        Self::new((names::GLIMPSE, model), directions, move |reader, _, _| {
            adaptive.scan(reader)
        })
    }

    /// Creates a recipe's fit (start and step sizes, or precisions) at other directions than its own, with a name.
    ///
    /// # Errors
    /// [`EvaluationError::Basis`], [`EvaluationError::OtherDirections`]
    pub fn at_directions(
        name: &'static str,
        recipe: &Recipe<'a>,
        basis: Option<&'a BasisTable>,
        directions: SampleDirections,
    ) -> Result<Self, EvaluationError> {
        match (recipe.estimator(), basis) {
            (Estimator::Sgd(sgd), _) => {
                let sgd = *sgd;
                let run = move |samples: &[Sample<f32>], _| descend(sgd, samples);
                Ok(Self::descent((name, sgd.model), directions, run))
            }
            (estimator, _) if estimator.net().is_some() => Err(EvaluationError::OtherDirections),
            // The rows in the recipe are only valid at the recipe's own directions.
            (Estimator::Ridge { coefficients, .. }, Some(basis)) => {
                let precision = coefficients.ridge.precision.iter().collect();
                Ok(Self::ridge(name, basis, precision, directions))
            }
            (Estimator::Ridge { .. }, None) => Err(EvaluationError::Basis),
        }
    }

    /// Creates a recipe's fit at random directions. Their number is that of the recipe's pattern.
    ///
    /// # Errors
    /// See [`Method::at_directions`].
    pub fn meta(
        recipe: &Recipe<'a>,
        basis: Option<&'a BasisTable>,
    ) -> Result<Self, EvaluationError> {
        let directions = SampleDirections::Random(recipe.samples());
        Self::at_directions(names::META, recipe, basis, directions)
    }

    /// Reads at other directions than the fit assumes, one for each sample.
    #[must_use]
    pub fn measured_at(self, displaced: Vec<Angles<f32>>) -> Self {
        Self { displaced, ..self }
    }

    /// Creates a fit by steps on all samples. `run` takes the samples and a seed.
    fn descent(
        (name, model): (&'static str, ModelKind),
        directions: SampleDirections,
        run: impl Fn(&[Sample<f32>], u64) -> Vec<f32> + Send + Sync + 'a,
    ) -> Self {
        Self::new((name, model), directions, move |reader, angles, seed| {
            let readings = reader.read_all(angles);
            let weight = 1.0 / (3.0 * readings.len() as f32);
            let samples = readings.into_iter().map(|(angles, measured)| Sample {
                at: HalfDifference::from_angles(angles),
                measured,
                weight,
            });
            Outcome::new(model, run(&samples.collect::<Vec<_>>(), seed), None)
        })
    }

    fn ridge(
        name: &'static str,
        basis: &'a BasisTable,
        precision: Vec<f32>,
        directions: SampleDirections,
    ) -> Self {
        let model = ModelKind::Linear;
        Self::new((name, model), directions, move |reader, angles, _| {
            let (angles, readings): (Vec<_>, Vec<_>) = reader.read_all(angles).into_iter().unzip();
            let values = ComponentsAt::new(basis, angles).fit(&precision, &readings);
            Outcome::new(model, values, Some(basis))
        })
    }

    /// Creates a fit of a diffuse and a GGX lobe to readings at these directions or with these apertures.
    #[must_use]
    pub fn ggx(geometries: Vec<Geometry>) -> Self {
        let name = (names::GGX, ModelKind::CookTorrance);
        let (pattern, apertures): (_, Vec<_>) = geometries
            .into_iter()
            .map(|geometry| (geometry.angles, geometry.aperture))
            .unzip();
        let pattern = SampleDirections::Pattern(pattern);
        let method = Self::new(name, pattern, |reader, angles, _| {
            let readings = angles.iter().enumerate();
            let readings =
                readings.filter_map(|(index, angles)| reader.posterior_reading(index, *angles));
            Ok(Outcome {
                fitted: Box::new(Ggx::fit(&readings.collect::<Vec<_>>())),
                values: Vec::new(),
                forecast: Forecast::default(),
            })
        });
        Self {
            apertures,
            ..method
        }
    }

    /// Creates the method Random: Adam from a random start on random samples.
    #[must_use]
    pub fn random(model: ModelKind, samples: usize, steps: usize) -> Self {
        let directions = SampleDirections::Random(samples);
        let run = move |samples: &[Sample<f32>], seed| {
            let kernels = ModelKernels::of(model);
            kernels.map_or_else(Vec::new, |kernels| {
                adam::random(kernels, samples, steps, seed)
            })
        };
        Self::descent((names::RANDOM, model), directions, run)
    }

    /// Creates the method Optimum: an estimate of the best fit of a model that is fitted by descent. It has converged
    /// after [`OPTIMUM_STEPS`](super::OPTIMUM_STEPS). Fewer steps give an approximation.
    #[must_use]
    pub fn optimum(model: ModelKind, steps: usize) -> Self {
        let directions = SampleDirections::Converged(0);
        Self::new(
            (names::OPTIMUM, model),
            directions,
            move |reader, _, seed| {
                let values = ModelKernels::of(model)
                    .and_then(|kernels| adam::optimum(kernels, reader.material, steps, seed));
                Outcome::new(model, values.ok_or(EvaluationError::Diverged)?, None)
            },
        )
    }

    /// Creates a ridge solve of the model Linear with precision `eta` for all coefficients, such as the methods Random, NJR15
    /// (Nielsen et al. 2015) and Optimum.
    #[must_use]
    pub fn linear(
        name: &'static str,
        basis: &'a BasisTable,
        eta: f32,
        directions: SampleDirections,
    ) -> Self {
        Self::ridge(name, basis, vec![eta; basis.components()], directions)
    }

    /// Adds steps of Adam after the fit, with a learning rate of 1e-3 and 512 fresh samples each. A closed-form solution,
    /// such as that of Linear, is not refined.
    #[must_use]
    pub fn with_refinement(self, steps: usize) -> Self {
        let (model, run) = (self.model, self.run);
        let refined = move |reader: &mut Reader<'_>, angles: &[Angles<f32>], seed: u64| {
            let outcome = run(reader, angles, seed)?;
            let Some(kernels) = ModelKernels::of(model) else {
                return Ok(outcome);
            };
            let values = adam::refine(kernels, outcome.values, reader.material, steps, seed);
            Outcome::new(model, values, None)
        };
        Self {
            run: Box::new(refined),
            ..self
        }
    }

    /// Returns the number of samples, n; 0 for the method Optimum.
    #[must_use]
    pub fn samples(&self) -> usize {
        match &self.directions {
            SampleDirections::Pattern(pattern) => pattern.len(),
            SampleDirections::Random(samples) | SampleDirections::Chosen(samples) => *samples,
            SampleDirections::Converged(_) => 0,
        }
    }

    /// Returns the measured directions; empty if they differ between materials.
    #[must_use]
    pub fn pattern(&self) -> &[Angles<f32>] {
        match &self.directions {
            SampleDirections::Pattern(pattern) => pattern,
            _ => &[],
        }
    }

    /// Returns true if the result depends on a seed.
    #[must_use]
    pub fn is_random(&self) -> bool {
        matches!(self.directions, SampleDirections::Random(_)) || self.degradation.is_random()
    }

    /// Fits a material. Recipes run as on a device: in f32, with the code of glimpse-core.
    ///
    /// # Errors
    /// See [`EvaluationError`].
    pub fn fit(&self, material: &dyn Material, seed: u64) -> Result<Outcome, EvaluationError> {
        self.fit_degraded(&self.degradation, material, seed)
    }

    /// Fits a material to readings with another degradation.
    pub(super) fn fit_degraded(
        &self,
        degradation: &Degradation,
        material: &dyn Material,
        seed: u64,
    ) -> Result<Outcome, EvaluationError> {
        let drawn;
        let (angles, samples): (&[Angles<f32>], usize) = match &self.directions {
            SampleDirections::Pattern(pattern) => (pattern, pattern.len()),
            SampleDirections::Chosen(samples) => (&[], *samples),
            SampleDirections::Random(samples) | SampleDirections::Converged(samples) => {
                drawn = uniform_valid(*samples, seed);
                (&drawn, *samples)
            }
        };
        let mut reader = degradation.reader(material, samples, seed);
        reader.displaced = &self.displaced;
        reader.apertures = &self.apertures;
        (self.run)(&mut reader, angles, seed)
    }
}

/// Runs a recipe's SGD at other directions than its own, with the code of glimpse-core but without a scan.
fn descend(sgd: Sgd<'_>, samples: &[Sample<f32>]) -> Vec<f32> {
    let Ok(functions) = AnyModel::functions(sgd.model) else {
        return Vec::new();
    };
    let estimator = Estimator::Sgd(sgd);
    let mut words = vec![0.0; estimator.words(samples.len())];
    estimator.start(&mut words, Channels::Color);
    let slots: Vec<Slot> = samples
        .iter()
        .map(|sample| slot_of(&sample.at, sample.measured))
        .collect();
    let inputs = (
        Samples::new(&slots, 1.0 / (3.0 * samples.len() as f32)),
        Channels::Color,
    );
    estimator.advance(
        functions,
        &mut words,
        inputs,
        0,
        estimator.units(samples.len()),
    );
    estimator.values_of(&words).concat()
}
