//! Sums over samples on this machine's lanes and threads: the trainer's [`SampleList`].
//!
//! A list is worked through on lanes that suit its length; a long one in chunks, on all threads.
//! Chunks are added in their order, so that the outcome does not depend on the number of threads.

use std::cmp::Ordering;
use std::ops::Range;

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::loss::cosine_weighted_log_error;
use glimpse_core::model::{
    CookTorrance, Model, Neural, ParameterSet, Phong, Sample, SampleGradient,
};
use rayon::prelude::*;

use super::pool::OctetRgb;
use super::unroll::{SampleList, constant, subtract_tangent};
use crate::dual::Dual;
use crate::lanes::{
    EvaluateModel, InstructionSet, Kernel, Lanes, MOST_OCTETS, Octet, OctetAt, Total, WIDTH,
    load_at,
};

/// A model whose kernels are compiled here, once, and not in every crate that trains.
pub trait LaneModel: Model {
    /// The loss over some octets, and its gradient.
    fn gradient(
        theta: &Self::Parameters<f32>,
        samples: &SampleOctets<'_>,
        octets: Range<usize>,
        gradient: &mut Self::Parameters<f32>,
    ) -> f32;
    /// The product of Hessian and tangent over some octets; see [`SampleList::product`].
    fn product(
        theta: &Self::Parameters<Dual<f32>>,
        samples: &SampleOctets<'_>,
        octets: Range<usize>,
        product: &mut Self::Parameters<f32>,
        slopes: Option<&mut [SampleGradient<Octet>]>,
    );
    /// The loss over all samples.
    fn loss(theta: &Self::Parameters<f32>, samples: &SampleOctets<'_>) -> f32;
    /// The BRDF in linear RGB, sr^-1 (not times the cosine), at many places.
    fn evaluate(theta: &Self::Parameters<f32>, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]);
}

macro_rules! lane_model {
    ($Model:ty) => {
        impl LaneModel for $Model {
            fn gradient(
                theta: &Self::Parameters<f32>,
                samples: &SampleOctets<'_>,
                octets: Range<usize>,
                gradient: &mut Self::Parameters<f32>,
            ) -> f32 {
                samples.instruction_set.run(Gradient::<$Model> {
                    theta,
                    samples,
                    octets,
                    gradient,
                })
            }
            fn product(
                theta: &Self::Parameters<Dual<f32>>,
                samples: &SampleOctets<'_>,
                octets: Range<usize>,
                product: &mut Self::Parameters<f32>,
                slopes: Option<&mut [SampleGradient<Octet>]>,
            ) {
                samples.instruction_set.run(Product::<$Model> {
                    theta,
                    samples,
                    octets,
                    product,
                    slopes,
                });
            }
            fn loss(theta: &Self::Parameters<f32>, samples: &SampleOctets<'_>) -> f32 {
                samples
                    .instruction_set
                    .run(Loss::<$Model> { theta, samples })
            }
            fn evaluate(
                parameters: &Self::Parameters<f32>,
                at: &[HalfDifference<f32>],
                brdf: &mut [[f32; 3]],
            ) {
                crate::lanes::dispatch(EvaluateModel::<$Model> {
                    parameters,
                    at,
                    brdf,
                });
            }
        }
    };
}
lane_model!(Phong);
lane_model!(Neural);
lane_model!(CookTorrance);

/// Weights in the loss: a mean over n samples and three channels has 1 / (3 n) each.
#[derive(Clone, Copy, Debug)]
pub enum Weights<'a> {
    /// Of every octet.
    Each(&'a [Octet]),
    /// Of all octets but the last, and of the last one, whose lanes past the end have none.
    Mean([Octet; 2]),
}

/// Some samples of a material in octets, as kernels read them.
#[derive(Clone, Copy, Debug)]
pub struct SampleOctets<'a> {
    /// Places to choose from.
    pub at: &'a [OctetAt],
    /// The material's BRDF there, sr^-1.
    pub values: &'a [OctetRgb],
    /// Which of them the samples are, in order; all if there is no list.
    pub order: Option<&'a [u32]>,
    /// Weights, in the order of the samples.
    pub weights: Weights<'a>,
    /// The lanes to compute on.
    pub instruction_set: InstructionSet,
    /// Whether sums over such lists follow one another without a pause, as inner steps do. The
    /// other threads are then still awake, and shorter lists are worth sharing with them.
    pub in_a_row: bool,
}

impl SampleOctets<'_> {
    /// How many octets there are.
    #[must_use]
    pub fn octets(&self) -> usize {
        self.order.map_or(self.at.len(), <[u32]>::len)
    }

    /// So many of them as the lanes hold, from an octet on; weight 0 past the end.
    #[inline(always)]
    pub fn read<L: Lanes>(&self, octet: usize) -> Sample<L> {
        const NO_WEIGHTS: Octet = Octet([0.0; WIDTH]);
        let last = self.octets() - 1;
        let mut at = [&self.at[0]; MOST_OCTETS];
        let mut values = [&self.values[0]; MOST_OCTETS];
        let mut weights = [&NO_WEIGHTS; MOST_OCTETS];
        for k in 0..L::OCTETS {
            let position = octet + k;
            let index = match self.order {
                Some(order) => order[position.min(last)] as usize,
                None => position.min(last),
            };
            at[k] = &self.at[index];
            values[k] = &self.values[index];
            weights[k] = match (&self.weights, position.cmp(&last)) {
                (_, Ordering::Greater) => &NO_WEIGHTS,
                (Weights::Each(weights), _) => &weights[position],
                (Weights::Mean([full, _]), Ordering::Less) => full,
                (Weights::Mean([_, partial]), Ordering::Equal) => partial,
            };
        }
        let [a, b, c, d] = values;
        Sample {
            at: load_at(at),
            measured: [0, 1, 2].map(|i| L::load([&a[i], &b[i], &c[i], &d[i]])),
            weight: L::load(weights),
        }
    }

    /// The loss of black, f = 0: how much light there is in the samples.
    #[must_use]
    pub fn loss_of_black(&self) -> f32 {
        self.instruction_set.run(LossOfBlack { samples: self })
    }

    /// The same samples, as one of many sums in a row.
    #[must_use]
    pub fn in_a_row(self) -> Self {
        Self {
            in_a_row: true,
            ..self
        }
    }

    /// Room for the derivatives by the samples, all 0.
    #[must_use]
    pub fn no_slopes(&self) -> Vec<SampleGradient<Octet>> {
        let none = SampleGradient {
            at: OctetAt::default(),
            measured: OctetRgb::default(),
        };
        vec![none; self.octets()]
    }
}

/// Most octets whose gradient stays on one thread: fewer are not worth another thread's waking up,
/// which costs some 20 us.
const GRADIENT_CHUNK: usize = 64;
/// The same while the other threads are awake.
const GRADIENT_CHUNK_IN_A_ROW: usize = 32;
/// Most octets whose product with the Hessian stays on one thread.
const PRODUCT_CHUNK: usize = 32;
/// Most chunks of a list.
const CHUNKS: usize = 16;

/// Octets in a chunk: the length of the list alone decides, and chunks begin where the widest
/// lanes do.
fn chunk_size(octets: usize, least: usize) -> usize {
    let size = octets.div_ceil(CHUNKS).next_multiple_of(MOST_OCTETS);
    size.max(least)
}

/// The chunks of a list.
fn chunks(octets: usize, size: usize) -> impl IndexedParallelIterator<Item = Range<usize>> {
    (0..octets.div_ceil(size))
        .into_par_iter()
        .map(move |chunk| chunk * size..((chunk + 1) * size).min(octets))
}

impl<M: LaneModel> SampleList<M, f32> for SampleOctets<'_> {
    type Slopes = SampleGradient<Octet>;

    fn gradient(&self, theta: &M::Parameters<f32>, gradient: &mut M::Parameters<f32>) -> f32 {
        let octets = self.octets();
        let least = match self.in_a_row {
            true => GRADIENT_CHUNK_IN_A_ROW,
            false => GRADIENT_CHUNK,
        };
        if octets <= least {
            return M::gradient(theta, self, 0..octets, gradient);
        }
        let found: Vec<(f32, M::Parameters<f32>)> = chunks(octets, chunk_size(octets, least))
            .map(|octets| {
                let mut gradient = M::Parameters::filled(0.0);
                let loss = M::gradient(theta, self, octets, &mut gradient);
                (loss, gradient)
            })
            .collect();
        add_up(found.iter().map(|(_, gradient)| gradient), gradient);
        found.iter().map(|(loss, _)| loss).sum()
    }

    fn product(
        &self,
        theta: &M::Parameters<Dual<f32>>,
        product: &mut M::Parameters<f32>,
        slopes: Option<&mut [SampleGradient<Octet>]>,
    ) {
        let octets = self.octets();
        if octets <= PRODUCT_CHUNK {
            return M::product(theta, self, 0..octets, product, slopes);
        }
        let compute = |octets, slopes: Option<&mut [SampleGradient<Octet>]>| {
            let mut product = M::Parameters::filled(0.0);
            M::product(theta, self, octets, &mut product, slopes);
            product
        };
        let size = chunk_size(octets, PRODUCT_CHUNK);
        let chunks = chunks(octets, size);
        let found: Vec<M::Parameters<f32>> = match slopes {
            None => chunks.map(|range| compute(range, None)).collect(),
            Some(slopes) => chunks
                .zip(slopes.par_chunks_mut(size))
                .map(|(range, slopes)| compute(range, Some(slopes)))
                .collect(),
        };
        add_up(found.iter(), product);
    }
}

/// The sum of parameter sets, in their order.
fn add_up<'a, P: ParameterSet<f32> + 'a>(sets: impl Iterator<Item = &'a P>, sum: &mut P) {
    *sum = P::filled(0.0);
    for set in sets {
        for (sum, values) in sum.runs_mut().zip(set.runs()) {
            for (entry, value) in sum.iter_mut().zip(values) {
                *entry += value;
            }
        }
    }
}

type Narrowest<L> = <<L as Lanes>::Narrow as Lanes>::Narrow;

/// Whether the lanes are added up at once: if one register holds all samples, and there are so many
/// parameters that sums on lanes would fill the cache.
fn sums_are_totals<M: Model, Wide: Lanes>(octets: usize) -> bool {
    octets <= Narrowest::<Wide>::OCTETS && M::PARAMETERS > 64
}

/// Runs `$body` with `$L` standing for the narrowest lanes, `$Wide` or below, that hold `$octets`.
macro_rules! with_lanes_for {
    ($octets:expr, $Wide:ident, $L:ident => $body:expr) => {{
        let octets = $octets;
        if octets <= <<$Wide::Narrow as Lanes>::Narrow as Lanes>::OCTETS {
            type $L<T> = <<T as Lanes>::Narrow as Lanes>::Narrow;
            $body
        } else if octets <= <$Wide::Narrow as Lanes>::OCTETS {
            type $L<T> = <T as Lanes>::Narrow;
            $body
        } else {
            type $L<T> = T;
            $body
        }
    }};
}

/// The loss over some octets of the samples, and its gradient.
struct Gradient<'a, M: Model> {
    theta: &'a M::Parameters<f32>,
    samples: &'a SampleOctets<'a>,
    octets: Range<usize>,
    gradient: &'a mut M::Parameters<f32>,
}

impl<M: Model> Kernel for Gradient<'_, M> {
    type Output = f32;

    #[inline(always)]
    fn run<Wide: Lanes>(self) -> f32 {
        if sums_are_totals::<M, Wide>(self.octets.len()) {
            return self.compute::<Total<Narrowest<Wide>>>();
        }
        with_lanes_for!(self.octets.len(), Wide, L => self.compute::<L<Wide>>())
    }
}

impl<M: Model> Gradient<'_, M> {
    #[inline(always)]
    fn compute<L: Lanes>(self) -> f32 {
        let mut loss = L::constant(0.0);
        let mut sums = M::Parameters::filled(L::zero_sum());
        for octet in self.octets.step_by(L::OCTETS) {
            let sample = self.samples.read::<L>(octet);
            let found = M::accumulate_gradient::<L, false>(self.theta, &sample, &mut sums);
            loss = loss + found.loss();
        }
        for (sums, totals) in sums.runs().zip(self.gradient.runs_mut()) {
            L::totals(sums, totals);
        }
        loss.total()
    }
}

/// The product of Hessian and tangent over some octets of the samples.
struct Product<'a, M: Model> {
    theta: &'a M::Parameters<Dual<f32>>,
    samples: &'a SampleOctets<'a>,
    octets: Range<usize>,
    product: &'a mut M::Parameters<f32>,
    slopes: Option<&'a mut [SampleGradient<Octet>]>,
}

impl<M: Model> Kernel for Product<'_, M> {
    type Output = ();

    #[inline(always)]
    fn run<Wide: Lanes>(self) {
        let octets = self.octets.len();
        // On few samples their derivatives cost next to nothing.
        if sums_are_totals::<M, Wide>(octets) {
            self.compute::<Total<Narrowest<Wide>>, true>();
        } else if octets <= Narrowest::<Wide>::OCTETS {
            self.compute::<Narrowest<Wide>, true>();
        } else if self.slopes.is_some() {
            self.compute::<Wide, true>();
        } else {
            self.compute::<Wide, false>();
        }
    }
}

impl<M: Model> Product<'_, M> {
    #[inline(always)]
    fn compute<L: Lanes, const SAMPLES: bool>(self) {
        let mut sums = M::Parameters::filled([L::zero_sum()]);
        let slopes = self.slopes.unwrap_or_default();
        let mut slopes = slopes.chunks_mut(L::OCTETS);
        for octet in self.octets.step_by(L::OCTETS) {
            let sample = constant(self.samples.read::<L>(octet));
            let found = M::accumulate_gradient::<Dual<L>, SAMPLES>(self.theta, &sample, &mut sums);
            if let (true, Some(slopes)) = (SAMPLES, slopes.next()) {
                let mut by_samples = SampleGradient::zero();
                subtract_tangent(&mut by_samples, &found.gradient);
                add(&by_samples, slopes);
            }
        }
        for (sums, totals) in sums.runs().zip(self.product.runs_mut()) {
            L::totals(sums.as_flattened(), totals);
        }
    }
}

/// Adds the derivatives by a batch of samples to those by its octets.
#[inline(always)]
fn add<L: Lanes>(found: &SampleGradient<L>, octets: &mut [SampleGradient<Octet>]) {
    let at = &found.at;
    let [red, green, blue] = found.measured;
    let registers = [at.hx, at.hz, at.dx, at.dy, at.dz, red, green, blue];
    for (index, register) in registers.into_iter().enumerate() {
        let mut values = [Octet::default(); MOST_OCTETS];
        register.store(&mut values);
        for (octet, values) in octets.iter_mut().zip(&values) {
            let OctetAt { hx, hz, dx, dy, dz } = &mut octet.at;
            let [red, green, blue] = &mut octet.measured;
            let entries = [hx, hz, dx, dy, dz, red, green, blue];
            for lane in 0..WIDTH {
                entries[index].0[lane] += values.0[lane];
            }
        }
    }
}

/// The loss over all samples.
struct Loss<'a, M: Model> {
    theta: &'a M::Parameters<f32>,
    samples: &'a SampleOctets<'a>,
}

impl<M: Model> Kernel for Loss<'_, M> {
    type Output = f32;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f32 {
        let mut loss = L::constant(0.0);
        for octet in (0..self.samples.octets()).step_by(L::OCTETS) {
            let sample = self.samples.read::<L>(octet);
            let modelled = M::brdf::<L>(self.theta, &sample.at);
            let cosine = sample.at.cos_theta_i();
            let found = cosine_weighted_log_error(sample.measured, modelled, cosine, sample.weight);
            loss = loss + found.error.value();
        }
        loss.total()
    }
}

/// The loss of f = 0 over all samples.
struct LossOfBlack<'a> {
    samples: &'a SampleOctets<'a>,
}

impl Kernel for LossOfBlack<'_> {
    type Output = f32;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f32 {
        let black = [L::constant(0.0); 3];
        let mut loss = L::constant(0.0);
        for octet in (0..self.samples.octets()).step_by(L::OCTETS) {
            let sample = self.samples.read::<L>(octet);
            let cosine = sample.at.cos_theta_i();
            let found = cosine_weighted_log_error(sample.measured, black, cosine, sample.weight);
            loss = loss + found.error.value();
        }
        loss.total()
    }
}
