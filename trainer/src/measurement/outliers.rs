//! Which readings look wrong: those that the others make improbable.
//!
//! What is looked at is the logarithm u = ln((f w + e) / e) of a reading f, as the model Linear has it,
//! w = cos(theta_i) cos(theta_o). Over many materials the u of a pattern's samples follow a
//! distribution; what the other readings and that distribution say of sample i is a mean and a
//! deviation, and z is how many deviations the reading is away from the mean.
//!
//! The distribution is a mixture of two parts that count alike, so that a material has to be like one
//! of them only:
//! - the built-in procedural materials, whatever the recipe: a normal distribution about each of them,
//!   drawn towards their mean so that together they have the covariance of all of them. A material is
//!   compared with those that are like it, and highlights have no normal distribution. All of them
//!   are moved so that their mean is that of the recipe's training, where the recipe says that;
//! - what the recipe was trained on, where it says so: the components of the model Linear about their
//!   mean, coefficients having the variance 1.
//!
//! On the diagonal of each stands what no material is known better by. A single wrong reading spoils
//! what is said of the others too, but of itself most: so the worst is taken away, and the rest is
//! looked at again.

use glimpse_core::fit::Target;
use glimpse_core::fit::coefficient_net::standardized;
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::unmap;
use glimpse_core::recipe::{FitMethod, Recipe};
use glimpse_materials::basis::widened;
use glimpse_materials::{Material, Procedural};
use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;

/// The most samples that are looked at: the work grows with their cube.
pub const MOST_SAMPLES: usize = 512;
/// At most one in so many readings looks wrong: of more, the others would not be known to be right.
const ONE_IN: usize = 4;
/// The procedural materials that are compared with: how many, and of which set.
const MATERIALS: usize = 500;
const SEED: u64 = 11;
/// The deviation of the normal distribution about each of them, as a share of that of all.
const WIDTH: f64 = 0.7;
/// Deviations of a logarithm that no material is known better by: of the procedural materials, which
/// measured ones are like only, and of the materials of a recipe's training.
const PROCEDURAL_FLOOR: f64 = 0.3;
const TRAINED_FLOOR: f64 = 0.2;

/// How many deviations from what the others say of it one of so many readings looks wrong:
/// sqrt(1 + 2 ln k). The largest of k normal numbers is about sqrt(2 ln k), so that among many readings
/// no more that are right are named than among few.
///
/// The 1 was chosen by networks of MERL's materials: with less, more readings that are right are named;
/// with more, fewer of those that are ten times too large.
#[must_use]
pub fn looks_wrong(readings: usize) -> f64 {
    (1.0 + 2.0 * (readings.max(1) as f64).ln()).sqrt()
}

/// What the other readings say of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// How many deviations it is away: positive where it is larger than expected. Of the channels and
    /// their mean, the one that is furthest away.
    pub z: f64,
    /// The BRDF that is expected, linear RGB, sr^-1, not times the cosine.
    pub expected: [f32; 3],
}

/// A reading that looks wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outlier {
    /// The sample.
    pub sample: usize,
    /// What the others say of it, those left out that look worse.
    pub opinion: Prediction,
}

/// What is found by looking at all readings.
#[derive(Clone, Debug, PartialEq)]
pub struct Examined {
    /// What those that look right say of each sample; None where nothing was read.
    pub opinions: Vec<Option<Prediction>>,
    /// Readings that look wrong, the worst first.
    pub suspects: Vec<Outlier>,
    /// The z from which on they do.
    pub limit: f64,
}

impl Examined {
    /// Where so many samples are not looked at.
    pub(super) fn nothing(samples: usize) -> Self {
        Self {
            opinions: vec![None; samples],
            suspects: Vec::new(),
            limit: f64::INFINITY,
        }
    }

    /// True if a sample's reading looks wrong.
    pub(super) fn suspects(&self, sample: usize) -> bool {
        self.suspects.iter().any(|suspect| suspect.sample == sample)
    }
}

/// How logarithms of readings are distributed at a recipe's pattern.
pub struct Distribution {
    /// cos(theta_i) cos(theta_o) of each sample.
    weights: Vec<f64>,
    parts: Vec<Part>,
}

/// Normal distributions of one covariance about several means, which count alike.
struct Part {
    means: Vec<DVector<f64>>,
    covariance: DMatrix<f64>,
}

/// A part at those samples that are looked at.
struct Conditioned<'a> {
    part: &'a Part,
    /// The inverse of the covariance of those samples.
    precision: DMatrix<f64>,
    /// ln of the covariance's determinant.
    log_determinant: f64,
}

impl Distribution {
    /// At a recipe's pattern; None if it has more samples than [`MOST_SAMPLES`].
    #[must_use]
    pub fn new(recipe: &Recipe<'_>) -> Option<Self> {
        if recipe.samples() > MOST_SAMPLES {
            return None;
        }
        let pattern: Vec<Angles<f32>> = recipe.pattern().collect();
        let weights: Vec<f64> = pattern
            .iter()
            .map(|angles| {
                let at = HalfDifference::from_angles(widened(angles));
                at.cos_theta_i() * at.cos_theta_o()
            })
            .collect();
        let parts = [
            Some(Part::procedural(&pattern, &weights, center(recipe))),
            Part::trained(recipe),
        ];
        Some(Self {
            weights,
            parts: parts.into_iter().flatten().collect(),
        })
    }

    /// Looks at readings, BRDFs in linear RGB and sr^-1: one for each sample of the pattern, None
    /// where there is none to be looked at.
    #[must_use]
    pub fn examine(&self, readings: &[Option<[f32; 3]>]) -> Examined {
        let mut there: Vec<usize> = (0..self.weights.len())
            .filter(|sample| readings.get(*sample).copied().flatten().is_some())
            .collect();
        let reading = |sample: usize| readings.get(sample).copied().flatten().unwrap_or_default();
        let logarithms: Vec<[f64; 3]> = (0..self.weights.len())
            .map(|sample| reading(sample).map(|f| logarithm(f, self.weights[sample])))
            .collect();
        let most = there.len() / ONE_IN;
        let limit = looks_wrong(there.len());
        let mut suspects: Vec<Outlier> = Vec::new();
        loop {
            let opinions = self.opinions(&there, &logarithms);
            let worst = there.iter().copied().zip(&opinions).enumerate();
            let worst = worst.max_by(|(_, (_, a)), (_, (_, b))| a.z.abs().total_cmp(&b.z.abs()));
            let found = worst.filter(|(_, (_, opinion))| opinion.z.abs() > limit);
            match found {
                Some((place, (sample, opinion))) if suspects.len() < most => {
                    suspects.push(Outlier {
                        sample,
                        opinion: *opinion,
                    });
                    there.remove(place);
                }
                _ => {
                    let mut all = vec![None; self.weights.len()];
                    for (sample, opinion) in there.into_iter().zip(opinions) {
                        all[sample] = Some(opinion);
                    }
                    for suspect in &suspects {
                        all[suspect.sample] = Some(suspect.opinion);
                    }
                    return Examined {
                        opinions: all,
                        suspects,
                        limit,
                    };
                }
            }
        }
    }

    /// What is said of each of some samples by the others of them.
    fn opinions(&self, there: &[usize], logarithms: &[[f64; 3]]) -> Vec<Prediction> {
        let parts: Option<Vec<Conditioned<'_>>> =
            self.parts.iter().map(|part| part.at(there)).collect();
        // A covariance with a floor has an inverse.
        let parts = parts.unwrap_or_default();
        let list = |value: fn(&[f64; 3]) -> f64| {
            let values = there.iter().map(|sample| value(&logarithms[*sample]));
            DVector::from_iterator(there.len(), values)
        };
        let lists = [
            list(|[red, ..]| *red),
            list(|[_, green, _]| *green),
            list(|[.., blue]| *blue),
            list(|channels| channels.iter().sum::<f64>() / 3.0),
        ];
        let said = lists.each_ref().map(|list| moments(&parts, there, list));
        let opinion = |(place, sample): (usize, &usize)| {
            let distances = lists.iter().zip(&said).map(|(list, said)| {
                let (mean, deviation) = said[place];
                (list[place] - mean) / deviation
            });
            let z = distances.max_by(|a, b| a.abs().total_cmp(&b.abs()));
            let weight = self.weights[*sample];
            let expected = [0, 1, 2].map(|channel: usize| {
                let (mean, _) = said[channel][place];
                unmap(mean, 0.0, weight) as f32
            });
            Prediction {
                z: z.unwrap_or_default(),
                expected,
            }
        };
        there.iter().enumerate().map(opinion).collect()
    }
}

/// Of each sample the mean and the deviation that the others' logarithms leave it.
fn moments(parts: &[Conditioned<'_>], there: &[usize], list: &DVector<f64>) -> Vec<(f64, f64)> {
    // By parts and by their means: how probable the other samples are, in logarithms, and where the
    // sample is expected.
    let each: Vec<(DVector<f64>, DVector<f64>)> = parts
        .iter()
        .flat_map(|part| part.part.means.iter().map(move |mean| (part, mean)))
        .map(|(part, mean)| {
            let apart = list - mean.select_rows(there);
            let weighed = &part.precision * &apart;
            let all = -0.5 * (apart.dot(&weighed) + part.log_determinant)
                - (part.part.means.len() as f64).ln();
            let diagonal = part.precision.diagonal();
            let without = weighed.zip_map(&diagonal, |weighed, precision| {
                all + 0.5 * (weighed * weighed / precision - precision.ln())
            });
            let expected = list - weighed.component_div(&diagonal);
            (without, expected)
        })
        .collect();
    let variances = parts.iter().flat_map(|part| {
        let variances = part.precision.diagonal().map(f64::recip);
        std::iter::repeat_n(variances, part.part.means.len())
    });
    let variances: Vec<DVector<f64>> = variances.collect();
    (0..there.len())
        .map(|place| {
            let most = each.iter().map(|(without, _)| without[place]);
            let most = most.fold(f64::NEG_INFINITY, f64::max);
            let (mut sum, mut mean, mut square) = (0.0, 0.0, 0.0);
            for ((without, expected), variance) in each.iter().zip(&variances) {
                let share = (without[place] - most).exp();
                // About the first, so that nothing cancels.
                let expected = expected[place] - list[place];
                sum += share;
                mean += share * expected;
                square += share * (variance[place] + expected * expected);
            }
            let mean = mean / sum;
            let variance = (square / sum - mean * mean).max(f64::MIN_POSITIVE);
            (list[place] + mean, variance.sqrt())
        })
        .collect()
}

impl Part {
    /// The built-in materials, their channels' mean, as of a gray material; about `center`, if there is
    /// one.
    fn procedural(pattern: &[Angles<f32>], weights: &[f64], center: Option<DVector<f64>>) -> Self {
        let set = Procedural::set(MATERIALS, SEED);
        let points: Vec<DVector<f64>> = set
            .par_iter()
            .map(|material| {
                let samples = pattern.iter().zip(weights).map(|(angles, weight)| {
                    let channels = material.brdf(*angles).map(|f| logarithm(f, *weight));
                    channels.iter().sum::<f64>() / 3.0
                });
                DVector::from_iterator(pattern.len(), samples)
            })
            .collect();
        let mean = points.iter().sum::<DVector<f64>>() / points.len() as f64;
        let mut covariance = DMatrix::zeros(pattern.len(), pattern.len());
        for point in &points {
            let apart = point - &mean;
            covariance.ger(1.0 / points.len() as f64, &apart, &apart, 1.0);
        }
        let drawn = (1.0 - WIDTH * WIDTH).sqrt();
        let center = center.as_ref().unwrap_or(&mean);
        let means = points.iter().map(|point| center + (point - &mean) * drawn);
        Self {
            means: means.collect(),
            covariance: with_floor(covariance * (WIDTH * WIDTH), PROCEDURAL_FLOOR),
        }
    }

    /// The materials of a recipe's training, where the recipe holds their components.
    fn trained(recipe: &Recipe<'_>) -> Option<Self> {
        let FitMethod::Completed(completed) = recipe.method() else {
            return None;
        };
        let Target::Linear(components) = completed.target() else {
            return None;
        };
        let scales: Vec<f64> = components.scales().iter().map(f64::from).collect();
        let entry = |sample: usize, component: usize| {
            let byte = components.rows().get(sample * scales.len() + component);
            f64::from(byte.copied().unwrap_or_default().cast_signed()) * scales[component]
        };
        let rows = DMatrix::from_fn(recipe.samples(), scales.len(), entry);
        Some(Self {
            means: vec![center(recipe)?],
            covariance: with_floor(&rows * rows.transpose(), TRAINED_FLOOR),
        })
    }

    /// At some of the samples.
    fn at(&self, there: &[usize]) -> Option<Conditioned<'_>> {
        let covariance = self.covariance.select_rows(there).select_columns(there);
        let factors = Cholesky::new(covariance)?;
        Some(Conditioned {
            part: self,
            precision: factors.inverse(),
            log_determinant: factors.ln_determinant(),
        })
    }
}

/// The mean logarithms of a recipe's training, where it says them.
fn center(recipe: &Recipe<'_>) -> Option<DVector<f64>> {
    let FitMethod::Completed(completed) = recipe.method() else {
        return None;
    };
    let center = completed.center().iter().map(f64::from);
    Some(DVector::from_iterator(recipe.samples(), center))
}

fn with_floor(mut covariance: DMatrix<f64>, floor: f64) -> DMatrix<f64> {
    for index in 0..covariance.nrows() {
        covariance[(index, index)] += floor * floor;
    }
    covariance
}

/// ln((f w + e) / e); what noise has brought below 0 is black.
fn logarithm(brdf: f32, weight: f64) -> f64 {
    standardized(f64::from(brdf).max(0.0), weight.max(0.0), 0.0, 1.0)
}
