//! Refinement of completed coefficients: Gauss-Newton steps from initial parameters chosen by the StartNet, toward
//! readings of the pattern and virtual ones, which are the completed coefficients at fixed directions.

use glimpse_core::model::linear::unmap;
use glimpse_core::model::{ModelKind, SampleGradient};
use glimpse_fitting::linear::ComponentsAt;
use glimpse_kernels::gauss_newton::{FitGradient, GaussNewtonSteps, OctetAdjoint};
use glimpse_kernels::lanes::{Octet, OctetDirections, WIDTH};
use glimpse_kernels::samples::{OctetRgb, SampleOctets, transpose_rgb};
use glimpse_kernels::{Dual, ModelKernels};
use glimpse_materials::basis::BasisTable;
use glimpse_materials::half_differences;
use glimpse_materials::lists::{add_scaled, dot};
use glimpse_materials::sampling::{sobol_valid, sphere_view_samples};
use rand_chacha::ChaCha8Rng;

use super::hyperparameters::StepParameters;
use crate::initialization::initial_guess;
use crate::outer::MetaValues;
use crate::tasks::samples::WeightedSamples;

/// The number of Gauss-Newton steps.
pub(super) const STEPS: usize = 2;
/// The precision of each parameter before training.
const INITIAL_PRECISION: f32 = 0.02;
/// The error scale before training.
const INITIAL_ERROR_SCALE: f32 = 0.1;
/// The number of draws of initial parameters that are compared.
const INITIAL_DRAWS: usize = 16;
/// The share of virtual readings at directions distributed like those of a rendered sphere, as in the loss.
const SPHERE_SHARE: f32 = 0.25;
/// The seed of these directions.
const SEED: u32 = 7;

/// The principal components at fixed directions. The number of directions is a multiple of eight.
pub struct VirtualReadings {
    /// The components.
    pub at: ComponentsAt,
    /// The directions in octets.
    pub octet_directions: Vec<OctetDirections>,
}

/// The BRDF at the directions, sr⁻¹, and its derivatives with respect to the mapped values.
pub struct VirtualValues {
    /// The BRDF in octets.
    pub octets: Vec<OctetRgb>,
    slopes: Vec<[f32; 3]>,
}

impl VirtualReadings {
    /// Evaluates the components of a basis at `count` directions, rounded up to whole octets.
    #[must_use]
    pub fn new(basis: &BasisTable, count: usize) -> Self {
        let count = count.next_multiple_of(WIDTH);
        let on_sphere = (SPHERE_SHARE * count as f32) as usize;
        let mut angles = sobol_valid(count - on_sphere, SEED);
        angles.extend(sphere_view_samples(on_sphere, SEED.into()));
        let directions = half_differences(&angles);
        Self {
            octet_directions: directions.chunks(WIDTH).map(Octet::transpose).collect(),
            at: ComponentsAt::new(basis, angles),
        }
    }

    /// Evaluates coefficients: those of red, then of green, then of blue.
    #[must_use]
    pub fn values(&self, coefficients: &[f32]) -> VirtualValues {
        let components = self.at.components;
        let rows = self.at.rows.chunks_exact(components);
        let each = rows.zip(&self.at.mean).zip(&self.at.cosines);
        let (values, slopes): (Vec<[f32; 3]>, Vec<[f32; 3]>) = each
            .map(|((row, center), cosines)| {
                let mut values = [0.0; 3];
                let mut slopes = [0.0; 3];
                let channels = coefficients.chunks_exact(components);
                for ((value, slope), channel) in values.iter_mut().zip(&mut slopes).zip(channels) {
                    let mapped = Dual {
                        value: center.value + dot(row, channel),
                        tangent: [1.0],
                    };
                    let brdf = unmap(mapped, Dual::from_value(cosines.value));
                    (*value, [*slope]) = (brdf.value, brdf.tangent);
                }
                (values, slopes)
            })
            .unzip();
        VirtualValues {
            octets: values.chunks(WIDTH).map(transpose_rgb).collect(),
            slopes,
        }
    }
}

/// The inputs of a refinement of one task.
pub(super) struct RefinementInputs<'t> {
    /// theta_0.
    pub(super) initial: Vec<f32>,
    /// The hyperparameters, all positive.
    pub(super) hyperparameters: &'t StepParameters,
    /// The completed coefficients of red, then green, then blue.
    pub(super) coefficients: &'t [f32],
    /// The readings that are present.
    pub(super) readings: WeightedSamples<'t>,
    /// The directions of virtual readings.
    pub(super) virtual_readings: &'t VirtualReadings,
}

/// The loss after a fit, and its gradient.
pub(super) struct RefinementGradient {
    /// The loss.
    pub(super) loss: f32,
    /// The gradient with respect to the initial parameters.
    pub(super) initial: Vec<f32>,
    /// The gradient with respect to the hyperparameters.
    pub(super) hyperparameters: StepParameters,
    /// The gradient with respect to the coefficients, by way of virtual readings.
    pub(super) coefficients: Vec<f32>,
    /// The gradient with respect to each octet of readings.
    pub(super) samples: Vec<SampleGradient<Octet>>,
}

impl RefinementInputs<'_> {
    /// Returns virtual readings, followed by those of the pattern.
    fn all_readings(&self, virtual_values: &[OctetRgb]) -> WeightedSamples<'static> {
        let readings = self.readings.octets();
        let virtual_weight = 1.0 / self.virtual_readings.at.count() as f32;
        let mut weights = vec![Octet([virtual_weight; WIDTH]); virtual_values.len()];
        for octet in 0..readings.octets() {
            // The weight in a loss is 1 / (3 k) for k readings.
            weights.push(Octet(std::array::from_fn(|lane| {
                3.0 * self.hyperparameters.reading_weight * readings.sample(octet, lane).weight
            })));
        }
        let directions = [&self.virtual_readings.octet_directions[..], readings.at].concat();
        WeightedSamples {
            at: directions.into(),
            values: [virtual_values, readings.values].concat(),
            weights,
        }
    }

    fn steps(&self) -> GaussNewtonSteps<'_, f32> {
        GaussNewtonSteps {
            initial: &self.initial,
            precision: &self.hyperparameters.precision,
            error_scale: self.hyperparameters.error_scale,
            steps: STEPS,
        }
    }
}

/// Returns the hyperparameters before training, all positive.
pub(super) fn initial_hyperparameters(kernels: &ModelKernels) -> StepParameters {
    StepParameters {
        precision: vec![INITIAL_PRECISION; kernels.active],
        reading_weight: 1.0,
        error_scale: INITIAL_ERROR_SCALE,
    }
}

/// Returns meta-parameters with the best initial parameters: those of `values`, or one of several draws.
pub(super) fn choose_initial(
    model: ModelKind,
    mut values: MetaValues,
    random: &mut ChaCha8Rng,
    loss: impl Fn(&MetaValues) -> f32,
) -> MetaValues {
    let (mut min_loss, mut best) = (f32::INFINITY, values.initial.clone());
    for draw in 0..INITIAL_DRAWS {
        if draw > 0 {
            values.initial = initial_guess(model, random);
        }
        let loss = loss(&values);
        // Always false for NaN.
        if loss < min_loss {
            (min_loss, best) = (loss, values.initial.clone());
        }
    }
    values.initial = best;
    values
}

/// Returns the loss after the fit on the `outer` samples.
pub(super) fn loss(
    kernels: &ModelKernels,
    inputs: &RefinementInputs<'_>,
    outer: &SampleOctets<'_>,
) -> f32 {
    let values = inputs.virtual_readings.values(inputs.coefficients);
    let readings = inputs.all_readings(&values.octets);
    let (fitted, _) = (kernels.take_steps)(&inputs.steps(), &readings.octets());
    (kernels.loss)(&fitted, outer)
}

/// Returns the loss after the fit, and its gradient.
pub(super) fn gradient(
    kernels: &ModelKernels,
    inputs: &RefinementInputs<'_>,
    outer: &SampleOctets<'_>,
) -> RefinementGradient {
    let values = inputs.virtual_readings.values(inputs.coefficients);
    let readings = inputs.all_readings(&values.octets);
    let readings = readings.octets();
    let fit = inputs.steps();
    let (fitted, steps) = (kernels.take_steps)(&fit, &readings);
    let mut gradient = FitGradient {
        initial: vec![0.0; fitted.len()],
        precision: vec![0.0; kernels.active],
        error_scale: 0.0,
    };
    let loss = (kernels.gradient)(&fitted, outer, &mut gradient.initial);
    let mut derivatives = OctetAdjoint::zeros(&readings);
    (kernels.steps_adjoint)(&fit, &steps, &readings, &mut gradient, &mut derivatives);
    let (by_virtual, by_readings) =
        derivatives.split_at(inputs.virtual_readings.octet_directions.len());
    let mut coefficients = vec![0.0; inputs.coefficients.len()];
    let by_brdf = by_virtual.iter().flat_map(|octet| {
        let measured = octet.sample.measured;
        (0..WIDTH).map(move |lane| measured.map(|by_channel| by_channel.0[lane]))
    });
    let at = &inputs.virtual_readings.at;
    let rows = at.rows.chunks_exact(at.components);
    for ((row, slopes), by_brdf) in rows.zip(&values.slopes).zip(by_brdf) {
        let channels = coefficients.chunks_exact_mut(at.components);
        for ((channel, slope), by_f) in channels.zip(slopes).zip(by_brdf) {
            add_scaled(channel, slope * by_f, row);
        }
    }
    // The weight of a present reading is proportional to the hyperparameter.
    let own = inputs.readings.octets();
    let mut by_weight = 0.0;
    for (octet, by_octet) in by_readings.iter().enumerate() {
        for lane in 0..WIDTH {
            by_weight += 3.0 * own.sample(octet, lane).weight * by_octet.weight.0[lane];
        }
    }
    RefinementGradient {
        loss,
        initial: gradient.initial,
        hyperparameters: StepParameters {
            precision: gradient.precision,
            reading_weight: by_weight,
            error_scale: gradient.error_scale,
        },
        coefficients,
        samples: by_readings.iter().map(|octet| octet.sample).collect(),
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use rand::SeedableRng;

    use super::*;

    /// Draws with loss NaN are not chosen, not even the first one.
    #[test]
    fn initial_parameters_have_the_smallest_loss() {
        let (first, seen) = (vec![7.0], Cell::new(0));
        let values = MetaValues {
            initial: first.clone(),
            ..MetaValues::default()
        };
        let chosen = |losses: [f32; 4]| {
            seen.set(0);
            let loss = |_: &MetaValues| {
                let loss = losses.get(seen.get()).copied().unwrap_or(9.0);
                seen.set(seen.get() + 1);
                loss
            };
            let random = &mut ChaCha8Rng::seed_from_u64(1);
            let chosen = choose_initial(ModelKind::Neural, values.clone(), random, loss);
            assert_eq!(seen.get(), INITIAL_DRAWS);
            chosen.initial
        };
        let random = &mut ChaCha8Rng::seed_from_u64(1);
        let draws = [(); 3].map(|()| initial_guess(ModelKind::Neural, random));
        assert_eq!(chosen([f32::NAN, 3.0, f32::NAN, 2.0]), draws[2]);
        assert_eq!(chosen([-f32::NAN, 3.0, 4.0, 4.0]), draws[0]);
        assert_eq!(chosen([1.0, f32::NAN, 2.0, 3.0]), first);
    }
}
