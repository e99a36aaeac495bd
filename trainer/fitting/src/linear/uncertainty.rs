//! The uncertainty of fits: standard deviations, and expected losses.

use glimpse_materials::half_differences;
use std::f64::consts::FRAC_2_PI;

use glimpse_core::geometry::Angles;
use glimpse_core::model::linear::unmap;
use glimpse_kernels::scan::LossPrediction;
use glimpse_materials::Brdf;
use glimpse_materials::sampling::uniform_valid;

use super::posterior::{Posterior, Predicted};
use super::prior::PriorAt;

/// The ratio of the bound, which is meant to hold for 90 % of materials, to the predicted loss. It was chosen on 16 networks of
/// MERL and RGL's 17 measurements together, which training did not see: it holds for nearly all of the former.
const BOUND: f64 = 2.5;
/// The number of directions of a predicted loss.
const LOSS_DIRECTIONS: usize = 512;
/// The seed of these directions.
const LOSS_SEED: u64 = 9;

impl Posterior {
    /// Returns the standard deviation of the material from a fitted BRDF at some directions (linear RGB, sr^-1, not times the
    /// cosine).
    #[must_use]
    pub fn deviations(&self, fit: &dyn Brdf, directions: Vec<Angles<f32>>) -> Vec<[f32; 3]> {
        let spreads = self.spreads(Some(fit), directions).into_iter();
        let deviations = spreads.map(|spread| {
            let deviation = |channel| spread.difference(channel, 1.0, |brdf| brdf) as f32;
            [0, 1, 2].map(deviation)
        });
        deviations.collect()
    }

    /// Returns the share of directions and channels at which a material is within one standard deviation of a fit.
    #[must_use]
    pub fn coverage(&self, fit: &dyn Brdf, material: &dyn Brdf) -> f64 {
        let truth = material.values_at(&half_differences(loss_directions()));
        let spreads = self.spreads(Some(fit), loss_directions());
        let within = spreads.iter().zip(&truth).flat_map(|(spread, truth)| {
            [0, 1, 2].map(|channel| {
                let error = f64::from(truth[channel]) - spread.fit[channel];
                error.abs() <= spread.difference(channel, 1.0, |brdf| brdf)
            })
        });
        within.filter(|is_within| *is_within).count() as f64 / (3 * truth.len()) as f64
    }

    /// Predicts the loss of a fit: the mean of |ln(1 + f cos(theta_i)) - ln(1 + y cos(theta_i))| over all directions, with
    /// y distributed as the posterior.
    #[must_use]
    pub fn loss(&self, fit: &dyn Brdf) -> LossPrediction {
        prediction(&self.spreads(Some(fit), loss_directions()))
    }

    /// Predicts the loss of the expected material.
    #[must_use]
    pub fn expected_loss(&self) -> LossPrediction {
        prediction(&self.spreads(None, loss_directions()))
    }

    /// Returns the posterior at some directions. Without a fit, it is that of the expected material.
    pub(super) fn spreads(
        &self,
        fit: Option<&dyn Brdf>,
        directions: Vec<Angles<f32>>,
    ) -> Vec<Spread> {
        let fitted = fit.map(|fit| fit.values_at(&half_differences(&directions)));
        let at = self.prior().at(directions);
        let mut spreads = Spread::all(&at, &self.predict(&at));
        for (spread, fitted) in spreads.iter_mut().zip(fitted.into_iter().flatten()) {
            spread.fit = fitted.map(|f| f64::from(f.max(0.0)));
        }
        spreads
    }
}

/// Returns the directions of a predicted loss.
pub(super) fn loss_directions() -> Vec<Angles<f32>> {
    uniform_valid(LOSS_DIRECTIONS, LOSS_SEED)
}

/// Returns the predicted loss of spreads.
pub(super) fn prediction(spreads: &[Spread]) -> LossPrediction {
    let losses = spreads.iter().flat_map(|spread| {
        // The mean magnitude of a normal variable.
        let step = FRAC_2_PI.sqrt();
        (0..3).map(move |channel| spread.difference(channel, step, spread.logarithm()))
    });
    let loss = losses.sum::<f64>() / (3 * spreads.len()) as f64;
    LossPrediction {
        loss: loss as f32,
        bound: Some((BOUND * loss) as f32),
        unlike_training: None,
    }
}

/// The posterior of a BRDF at a direction, and a fit.
pub(super) struct Spread {
    /// cos(theta_i) cos(theta_o).
    weight: f64,
    cos_theta_i: f64,
    /// The mean of the mapped BRDF.
    mean: [f64; 3],
    /// Its standard deviation.
    pub(super) deviation: f64,
    /// The fitted BRDF.
    fit: [f64; 3],
}

impl Spread {
    /// Returns the posterior at directions. The fit is the expected material.
    fn all(at: &PriorAt, predicted: &[Predicted]) -> Vec<Self> {
        let at = &at.components;
        let all = predicted.iter().enumerate().map(|(i, predicted)| {
            let (weight, center) = (f64::from(at.cosines[i].value), f64::from(at.mean[i].value));
            let mean = predicted.expected.map(|mapped| center + mapped);
            Self {
                weight,
                cos_theta_i: f64::from(at.cos_theta_i[i]),
                mean,
                deviation: predicted.variance.sqrt(),
                fit: mean.map(|mapped| unmap(mapped, weight)),
            }
        });
        all.collect()
    }

    /// Returns the change of ln(1 + f cos(theta_i)) over one standard deviation, summed over the channels.
    pub(super) fn change(&self) -> f64 {
        (0..3)
            .map(|channel| self.difference(channel, 1.0, self.logarithm()))
            .sum()
    }

    /// Returns the function ln(1 + f cos(theta_i)) of a BRDF f.
    fn logarithm(&self) -> impl Fn(f64) -> f64 + use<> {
        let cos_theta_i = self.cos_theta_i;
        move |brdf| (brdf * cos_theta_i).ln_1p()
    }

    /// Returns the root of the mean squared difference of a function of the BRDF from that of the fit, for BRDFs that are
    /// `step` standard deviations around the mean.
    fn difference(&self, channel: usize, step: f64, function: impl Fn(f64) -> f64) -> f64 {
        let at = |step: f64| {
            let mapped = self.mean[channel] + step * self.deviation;
            function(unmap(mapped, self.weight).max(0.0))
        };
        let bias = at(0.0) - function(self.fit[channel]);
        bias.hypot(0.5 * (at(step) - at(-step)))
    }
}
