//! Damped Gauss-Newton steps, as on the device, and their exact adjoint.
//!
//! Forward: theta_{k+1} = theta_k + delta with M delta = J'W r + P (theta_0 - theta_k) and M = J'WJ + P; see
//! [`glimpse_core::fit::gauss_newton`]. Then the outer loss is computed at theta_K.
//!
//! Reverse: let lambda be the gradient with respect to theta_{k+1}, and M v = lambda on the active parameters. Let
//! L(f) = ln(1 + f c), and let D_u be the derivative along u. The sample j adds the gradient of
//!
//! ```text
//! a_j D_v L(f_j) - b_j D_delta L(f_j) - b_j L(f_j) + b_j L(y_j),   a_j = w_j (r_j - J_j delta),   b_j = w_j J_j v
//! ```
//!
//! for constant a_j, b_j, v and delta. The third and the fourth term have the factor d_j instead of b_j, because w_j
//! depends on r_j: d_j = b_j + w_j'(r_j) (r_j - J_j delta) (J_j v). The first two terms come from dual parameters with the tangents v and delta. The
//! precision p of an active parameter has the derivative v (theta_0 - theta_k - delta), and theta_0 the derivative p v.

use glimpse_core::fit::gauss_newton::{
    MAX_ACTIVE, add_reading, reading_rows, system_length, take_step,
};
use glimpse_core::fit::ldl::{packed_length, solve};
use glimpse_core::model::{Active, Model, Objective, ParameterSet, Sample, SampleGradient};
use glimpse_core::numeric::{Real, Scalar};

use crate::dual::Dual;
use crate::inner_loop::{set, set_mut};
use crate::lanes::{
    Lanes, MAX_OCTETS, Octet, OneRegister, WIDTH, add_totals, coordinates_mut, kernel,
};
use crate::samples::{SampleOctets, entries, entries_mut};
use crate::sums::{add_to_octets, constant_directions};

/// The derivatives of an objective with respect to a sample.
#[derive(Clone, Copy, Debug)]
pub struct ReadingAdjoint<S> {
    /// With respect to the directions and the measured BRDF.
    pub sample: SampleGradient<S>,
    /// With respect to the weight.
    pub weight: S,
}

/// The readings of a fit, with sums over them. The weight of a sample is that of its three channels.
pub trait ReadingList<M: Model, R: Real> {
    /// The derivatives with respect to one or several samples.
    type Derivatives;

    /// Adds the samples to the systems of a step, which are 0 before; see [`add_reading`].
    fn add_to_systems(&self, theta: &[R], error_scale: R, systems: &mut [R]);

    /// Adds the gradient of the terms of all samples, given theta with tangents v and delta, to `gradient` and
    /// `derivatives`. Returns the derivative with respect to the error scale.
    fn adjoint(
        &self,
        tangents: [&[Dual<R>]; 2],
        theta: &[R],
        error_scale: R,
        gradient: &mut [R],
        derivatives: &mut [Self::Derivatives],
    ) -> R;
}

/// Gauss-Newton steps from initial parameters.
#[derive(Clone, Copy, Debug)]
pub struct GaussNewtonSteps<'a, R> {
    /// theta_0, a list in the model's order.
    pub initial: &'a [R],
    /// The precision of each active parameter of a system.
    pub precision: &'a [R],
    /// The error at which the weight of a reading is halved.
    pub error_scale: R,
    /// The number of steps.
    pub steps: usize,
}

/// A step, for its adjoint.
pub struct Step<R> {
    theta: Vec<R>,
    /// For each system: the packed factors, then delta.
    systems: Vec<R>,
}

/// The gradient of a fit.
pub struct FitGradient<R> {
    /// With respect to theta_0. The caller sets it to that with respect to the fitted parameters.
    pub initial: Vec<R>,
    /// With respect to the precisions.
    pub precision: Vec<R>,
    /// With respect to the error scale.
    pub error_scale: R,
}

/// Returns the active parameters, system by system.
fn active<M: Model, R: Real>(parameters: &[R]) -> Vec<R> {
    let count = M::ACTIVE.count();
    let indices = 0..M::ACTIVE.systems() * count;
    indices
        .map(|index| parameters[M::ACTIVE.index(index / count, index % count)])
        .collect()
}

impl<R: Real> GaussNewtonSteps<'_, R> {
    /// Returns the fitted parameters, and the steps.
    pub fn fit<M: Model>(
        &self,
        readings: &(impl ReadingList<M, R> + ?Sized),
    ) -> (Vec<R>, Vec<Step<R>>) {
        let count = M::ACTIVE.count();
        let length = system_length(count);
        let initial = active::<M, R>(self.initial);
        let mut theta = self.initial.to_vec();
        let steps = (0..self.steps).map(|_| {
            let mut systems = vec![R::constant(0.0); M::ACTIVE.systems() * length];
            readings.add_to_systems(&theta, self.error_scale, &mut systems);
            let before = theta.clone();
            let each = systems.chunks_exact_mut(length);
            for (index, (system, initial)) in each.zip(initial.chunks_exact(count)).enumerate() {
                let precision = self.precision.iter().copied();
                take_step(M::ACTIVE, index, precision, initial, system, &mut theta);
            }
            Step {
                theta: before,
                systems,
            }
        });
        let steps = steps.collect();
        (theta, steps)
    }

    /// Propagates a gradient from the fitted parameters to theta_0, the precisions and the readings.
    pub fn adjoint<M: Model, L: ReadingList<M, R> + ?Sized>(
        &self,
        steps: &[Step<R>],
        readings: &L,
        gradient: &mut FitGradient<R>,
        derivatives: &mut [L::Derivatives],
    ) {
        let count = M::ACTIVE.count();
        let length = system_length(count);
        let initial = active::<M, R>(self.initial);
        let mut by_initial = vec![R::constant(0.0); initial.len()];
        for step in steps.iter().rev() {
            let constants = step.theta.iter().map(|value| Dual::from_value(*value));
            let mut along_v: Vec<Dual<R>> = constants.collect();
            let mut along_delta = along_v.clone();
            let lambda = active::<M, R>(&gradient.initial);
            for (index, system) in step.systems.chunks_exact(length).enumerate() {
                let (packed, delta) = system.split_at(packed_length(count));
                let range = index * count..(index + 1) * count;
                let mut v = lambda[range.clone()].to_vec();
                solve(packed, &mut v);
                let (initial, by_initial) = (&initial[range.clone()], &mut by_initial[range]);
                for k in 0..count {
                    let position = M::ACTIVE.index(index, k);
                    along_v[position].tangent = [v[k]];
                    along_delta[position].tangent = [delta[k]];
                    let pulled = initial[k] - step.theta[position] - delta[k];
                    let by_precision = &mut gradient.precision[k];
                    *by_precision = by_precision.plus_product(v[k], pulled);
                    let pull = self.precision[k] * v[k];
                    by_initial[k] = by_initial[k] + pull;
                    let entry = &mut gradient.initial[position];
                    *entry = *entry - pull;
                }
            }
            let by_error_scale = readings.adjoint(
                [&along_v, &along_delta],
                &step.theta,
                self.error_scale,
                &mut gradient.initial,
                derivatives,
            );
            gradient.error_scale = gradient.error_scale + by_error_scale;
        }
        for (index, entry) in by_initial.iter().enumerate() {
            let sum = &mut gradient.initial[M::ACTIVE.index(index / count, index % count)];
            *sum = *sum + *entry;
        }
    }
}

/// The objective sum over channels of factor L(f) with L(f) = ln(1 + f c), c = max(cos(theta_i), 0). It keeps the
/// tangents of L(f) along the parameters.
struct LogBrdf<S> {
    factor: [S; 3],
}

impl<S: Scalar> Objective<S> for LogBrdf<S> {
    const CLAMPED: bool = false;

    #[inline(always)]
    fn derivatives(&mut self, modeled: [S; 3], cos_theta_i: S) -> ([S; 3], S) {
        let (zero, one) = (S::constant(0.0), S::constant(1.0));
        let cosine = cos_theta_i.relu();
        let mut by_modeled = self.factor;
        let mut by_cosine = zero;
        for (entry, f) in by_modeled.iter_mut().zip(modeled) {
            let scaled = *entry / (one + f * cosine);
            by_cosine = by_cosine.plus_product(scaled, f);
            *entry = scaled * cosine;
        }
        (by_modeled, cos_theta_i.if_positive(by_cosine, zero))
    }
}

/// Adds the gradient of a sample's terms with respect to the parameters to `tangents` (the first two terms) and `sums`
/// (the others). Returns the derivatives with respect to the sample and to the error scale.
#[inline(always)]
fn sample_adjoint<M: Model, S: Scalar>(
    along: [&M::Parameters<Dual<S::Parameter>>; 2],
    theta: &M::Parameters<S::Parameter>,
    sample: &Sample<S>,
    error_scale: S,
    tangents: &mut M::Parameters<[S::Sum; 1]>,
    sums: &mut M::Parameters<S::Sum>,
) -> (ReadingAdjoint<S>, S) {
    let (zero, one) = (S::constant(0.0), S::constant(1.0));
    let at = sample.at;
    let dual_at = constant_directions(at);
    // Loops over both tangents, because each copy of the model would take as long to compile.
    let mut brdf = [[Dual::from_value(zero); 3]; 2];
    for (brdf, along) in brdf.iter_mut().zip(along) {
        *brdf = M::unclamped_brdf::<Dual<S>>(along, &dual_at);
    }
    let [by_v, by_delta] = brdf;
    let cosine = at.cos_theta_i().relu();
    // a_j and -b_j.
    let mut factors = [[Dual::from_value(zero); 3]; 2];
    let mut plain = [zero; 3];
    let mut by_measured = [zero; 3];
    let mut by_weight = zero;
    let mut by_error_scale = zero;
    let mut by_cosine = zero;
    for channel in 0..3 {
        let y = sample.measured[channel];
        let f = by_v[channel].value;
        let shifted_f = one + f * cosine;
        let shifted_y = one + y * cosine;
        let slope = cosine / shifted_f;
        let residual = (shifted_y / shifted_f).ln();
        let along_v = slope * by_v[channel].tangent[0];
        let rest = residual - slope * by_delta[channel].tangent[0];
        let magnitude = residual * residual.sign();
        let inverse = one / (error_scale + magnitude);
        let robust = error_scale * inverse;
        let weight = sample.weight * robust;
        let product = rest * along_v;
        let b = weight * along_v;
        factors[0][channel] = Dual::from_value(weight * rest);
        factors[1][channel] = Dual::from_value(-b);
        by_weight = by_weight.plus_product(robust, product);
        // The derivatives of e / (e + |r|) are -e sign(r) / (e + |r|)^2 and |r| / (e + |r|)^2.
        let by_robust = sample.weight * product * inverse;
        by_error_scale = by_error_scale.plus_product(by_robust, magnitude * inverse);
        let d = b - by_robust * robust * residual.sign();
        plain[channel] = -d;
        let scaled = d / shifted_y;
        by_measured[channel] = scaled * cosine;
        by_cosine = by_cosine.plus_product(scaled, y);
    }
    let mut objective = LogBrdf { factor: plain };
    let mut by_at = M::accumulate_objective::<S, _, true>(theta, &at, &mut objective, sums);
    for (index, factor) in factors.iter().enumerate() {
        let mut objective = LogBrdf { factor: *factor };
        let along = along[index];
        let dual_by_at =
            M::accumulate_objective::<Dual<S>, _, true>(along, &dual_at, &mut objective, tangents);
        let sums = coordinates_mut(&mut by_at).into_iter();
        for (sum, dual) in sums.zip(dual_by_at.to_array()) {
            *sum = *sum + dual.tangent[0];
        }
    }
    // cos(theta_i) = hz dz - hx dx.
    let by_cosine = at.cos_theta_i().if_positive(by_cosine, zero);
    by_at.hz = by_at.hz.plus_product(by_cosine, at.dz);
    by_at.dz = by_at.dz.plus_product(by_cosine, at.hz);
    by_at.hx = by_at.hx - by_cosine * at.dx;
    by_at.dx = by_at.dx - by_cosine * at.hx;
    let adjoint = ReadingAdjoint {
        sample: SampleGradient {
            at: by_at,
            measured: by_measured,
        },
        weight: by_weight,
    };
    (adjoint, by_error_scale)
}

/// Sums sample by sample on one thread, for tests in double precision.
impl<M: Model, R: Real> ReadingList<M, R> for [Sample<R>] {
    type Derivatives = ReadingAdjoint<R>;

    fn add_to_systems(&self, theta: &[R], error_scale: R, systems: &mut [R]) {
        for sample in self {
            let weights = [sample.weight, error_scale];
            add_reading::<M, R>(
                set::<M, R>(theta),
                &sample.at,
                sample.measured,
                weights,
                systems,
            );
        }
    }

    fn adjoint(
        &self,
        tangents: [&[Dual<R>]; 2],
        theta: &[R],
        error_scale: R,
        gradient: &mut [R],
        derivatives: &mut [ReadingAdjoint<R>],
    ) -> R {
        let (theta, gradient) = (set::<M, R>(theta), set_mut::<M, R>(gradient));
        let tangents = tangents.map(set::<M, Dual<R>>);
        let mut sums = M::Parameters::filled([R::constant(0.0)]);
        let mut by_error_scale = R::constant(0.0);
        for (sample, sum) in self.iter().zip(derivatives) {
            let (added, by_scale) =
                sample_adjoint::<M, R>(tangents, theta, sample, error_scale, &mut sums, gradient);
            by_error_scale = by_error_scale + by_scale;
            let entries_of_sum = entries_mut(&mut sum.sample).into_iter();
            for (entry, value) in entries_of_sum.zip(entries(added.sample)) {
                *entry = *entry + value;
            }
            sum.weight = sum.weight + added.weight;
        }
        for (entry, [sum]) in gradient.iter_mut().zip(sums.iter()) {
            *entry = *entry + *sum;
        }
        by_error_scale
    }
}

/// The derivatives with respect to eight samples.
pub type OctetAdjoint = ReadingAdjoint<Octet>;

impl OctetAdjoint {
    /// Returns zeros for the samples of a list.
    #[must_use]
    pub fn zeros(samples: &SampleOctets<'_>) -> Vec<Self> {
        let zero = |sample| Self {
            sample,
            weight: Octet::default(),
        };
        samples.zero_derivatives().into_iter().map(zero).collect()
    }
}

impl<M: Model> ReadingList<M, f32> for SampleOctets<'_> {
    type Derivatives = OctetAdjoint;

    fn add_to_systems(&self, theta: &[f32], error_scale: f32, systems: &mut [f32]) {
        octet_systems::<M>(self, set::<M, f32>(theta), error_scale, systems);
    }

    fn adjoint(
        &self,
        tangents: [&[Dual<f32>]; 2],
        theta: &[f32],
        error_scale: f32,
        gradient: &mut [f32],
        derivatives: &mut [OctetAdjoint],
    ) -> f32 {
        let (theta, gradient) = (set::<M, f32>(theta), set_mut::<M, f32>(gradient));
        let tangents = tangents.map(set::<M, Dual<f32>>);
        octet_adjoint::<M>(self, tangents, theta, error_scale, gradient, derivatives)
    }
}

kernel! {
    on samples.instruction_set;
    /// Computes [`ReadingList::add_to_systems`].
    fn octet_systems<'a, L: OneRegister, M: Model>(
        samples: &'a SampleOctets<'a>,
        theta: &'a M::Parameters<f32>,
        error_scale: f32,
        systems: &'a mut [f32],
    ) {
        const MAX_SYSTEMS: usize = 3 * system_length(MAX_ACTIVE);
        let count = M::ACTIVE.count();
        let error_scale = L::broadcast(error_scale);
        let mut rows = [[L::constant(0.0); MAX_ACTIVE]; 3];
        let mut sums = [L::zero_sum(); MAX_SYSTEMS];
        for octet in (0..samples.octets()).step_by(L::OCTETS) {
            let sample = samples.read::<L>(octet);
            let weights = [sample.weight, error_scale];
            let factors = reading_rows::<M, L>(theta, &sample.at, sample.measured, weights, &mut rows);
            let mut entry = 0;
            for channel in 0..3 {
                if !matches!(M::ACTIVE, Active::PerChannel { .. }) {
                    entry = 0;
                }
                let row = &rows[channel][..count];
                let [scaled, slope, residual] = factors[channel];
                let (by_row, by_residual) = (scaled * slope, scaled * residual);
                for k in 0..count {
                    let left = by_row * row[k];
                    for right in &row[..=k] {
                        L::add_product(&mut sums[entry], left, *right);
                        entry += 1;
                    }
                }
                for value in row {
                    L::add_product(&mut sums[entry], by_residual, *value);
                    entry += 1;
                }
            }
        }
        L::totals(&sums[..systems.len()], systems);
    }
}

kernel! {
    on samples.instruction_set;
    /// Computes [`ReadingList::adjoint`].
    fn octet_adjoint<'a, L: Lanes, M: Model>(
        samples: &'a SampleOctets<'a>,
        tangents: [&'a M::Parameters<Dual<f32>>; 2],
        theta: &'a M::Parameters<f32>,
        error_scale: f32,
        gradient: &'a mut M::Parameters<f32>,
        derivatives: &'a mut [OctetAdjoint],
    ) -> f32 {
        let error_scale = L::broadcast(error_scale);
        let mut by_error_scale = L::constant(0.0);
        let mut tangent_sums = M::Parameters::filled([L::zero_sum()]);
        let mut sums = M::Parameters::filled(L::zero_sum());
        let octets = (0..samples.octets()).step_by(L::OCTETS);
        for (octet, derivatives) in octets.zip(derivatives.chunks_mut(L::OCTETS)) {
            let sample = samples.read::<L>(octet);
            let (adjoint, by_scale) = sample_adjoint::<M, L>(
                tangents,
                theta,
                &sample,
                error_scale,
                &mut tangent_sums,
                &mut sums,
            );
            by_error_scale = by_error_scale + by_scale;
            let mut weights = [Octet::default(); MAX_OCTETS];
            adjoint.weight.store(&mut weights);
            for (sum, weight) in derivatives.iter_mut().zip(&weights) {
                for lane in 0..WIDTH {
                    sum.weight.0[lane] += weight.0[lane];
                }
            }
            add_to_octets(adjoint.sample, derivatives.iter_mut().map(|sum| &mut sum.sample));
        }
        add_totals::<L>(tangent_sums.as_ref().as_flattened(), gradient.as_mut());
        add_totals::<L>(sums.as_ref(), gradient.as_mut());
        by_error_scale.total()
    }
}
