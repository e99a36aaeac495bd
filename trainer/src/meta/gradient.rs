//! Sums over samples on this machine's lanes and threads: the trainer's [`SampleList`].
//!
//! A list is worked through on lanes that suit its length; a long one in chunks, on all threads.
//! Chunks are added in their order, so that the outcome does not depend on the number of threads.

use std::ops::Range;

use glimpse_core::loss::cosine_weighted_log_error;
use glimpse_core::model::{Model, ParameterSet, Sample, SampleGradient};
use rayon::prelude::*;

use super::unroll::{SampleList, constant, subtract_tangent};
use crate::dual::Dual;
use crate::lanes::{InstructionSet, Kernel, Lanes, MOST_OCTETS, Octet, OctetAt, WIDTH};

/// Samples in octets, which any lanes can read.
pub trait OctetSamples: Sync {
    /// How many octets there are.
    fn octets(&self) -> usize;
    /// So many of them as the lanes hold, from an octet on; weight 0 past the end.
    fn read<L: Lanes>(&self, octet: usize) -> Sample<L>;
    /// The lanes to compute on.
    fn instruction_set(&self) -> InstructionSet {
        InstructionSet::of_this_machine()
    }
}

/// Most octets that stay on one thread: fewer are not worth another thread's waking up.
const GRADIENT_CHUNK: usize = 64;
const PRODUCT_CHUNK: usize = 32;
/// Most chunks of a list.
const CHUNKS: usize = 16;

/// The chunks of a list: its length alone decides, and they begin where the widest lanes do.
fn chunks(octets: usize, least: usize) -> impl IndexedParallelIterator<Item = Range<usize>> {
    let size = octets.div_ceil(CHUNKS).next_multiple_of(MOST_OCTETS);
    let size = size.max(least);
    (0..octets.div_ceil(size))
        .into_par_iter()
        .map(move |chunk| chunk * size..((chunk + 1) * size).min(octets))
}

impl<M: Model, O: OctetSamples> SampleList<M, f32> for O {
    type Slopes = SampleGradient<Octet>;

    fn gradient(&self, theta: &M::Parameters<f32>, gradient: &mut M::Parameters<f32>) -> f32 {
        let octets = self.octets();
        if octets <= GRADIENT_CHUNK {
            return self.instruction_set().run(Gradient::<M, O> {
                theta,
                samples: self,
                octets: 0..octets,
                gradient,
            });
        }
        let found: Vec<(f32, M::Parameters<f32>)> = chunks(octets, GRADIENT_CHUNK)
            .map(|octets| {
                let mut gradient = M::Parameters::filled(0.0);
                let loss = self.instruction_set().run(Gradient::<M, O> {
                    theta,
                    samples: self,
                    octets,
                    gradient: &mut gradient,
                });
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
            self.instruction_set().run(Product::<M, O> {
                theta,
                samples: self,
                octets: 0..octets,
                product,
                slopes,
            });
            return;
        }
        let compute = |octets, slopes: Option<&mut [SampleGradient<Octet>]>| {
            let mut product = M::Parameters::filled(0.0);
            self.instruction_set().run(Product::<M, O> {
                theta,
                samples: self,
                octets,
                product: &mut product,
                slopes,
            });
            product
        };
        let found: Vec<M::Parameters<f32>> = match slopes {
            None => chunks(octets, PRODUCT_CHUNK)
                .map(|range| compute(range, None))
                .collect(),
            Some(slopes) => {
                let size = chunks(octets, PRODUCT_CHUNK)
                    .map(|range| range.len())
                    .max()
                    .unwrap_or(1);
                chunks(octets, PRODUCT_CHUNK)
                    .zip(slopes.par_chunks_mut(size))
                    .map(|(range, slopes)| compute(range, Some(slopes)))
                    .collect()
            }
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
struct Gradient<'a, M: Model, O> {
    theta: &'a M::Parameters<f32>,
    samples: &'a O,
    octets: Range<usize>,
    gradient: &'a mut M::Parameters<f32>,
}

impl<M: Model, O: OctetSamples> Kernel for Gradient<'_, M, O> {
    type Output = f32;

    #[inline(always)]
    fn run<Wide: Lanes>(self) -> f32 {
        with_lanes_for!(self.octets.len(), Wide, L => self.compute::<L<Wide>>())
    }
}

impl<M: Model, O: OctetSamples> Gradient<'_, M, O> {
    #[inline(always)]
    fn compute<L: Lanes>(self) -> f32 {
        let mut loss = L::constant(0.0);
        let mut sums = M::Parameters::filled(L::zero_sum());
        for octet in self.octets.step_by(L::OCTETS) {
            let sample = self.samples.read::<L>(octet);
            let found = M::accumulate_gradient::<L, false>(self.theta, &sample, &mut sums);
            loss = loss + found.loss;
        }
        for (sums, totals) in sums.runs().zip(self.gradient.runs_mut()) {
            L::totals(sums, totals);
        }
        loss.total()
    }
}

/// The product of Hessian and tangent over some octets of the samples.
struct Product<'a, M: Model, O> {
    theta: &'a M::Parameters<Dual<f32>>,
    samples: &'a O,
    octets: Range<usize>,
    product: &'a mut M::Parameters<f32>,
    slopes: Option<&'a mut [SampleGradient<Octet>]>,
}

impl<M: Model, O: OctetSamples> Kernel for Product<'_, M, O> {
    type Output = ();

    #[inline(always)]
    fn run<Wide: Lanes>(self) {
        if self.slopes.is_some() {
            with_lanes_for!(self.octets.len(), Wide, L => self.compute::<L<Wide>, true>());
        } else {
            with_lanes_for!(self.octets.len(), Wide, L => self.compute::<L<Wide>, false>());
        }
    }
}

impl<M: Model, O: OctetSamples> Product<'_, M, O> {
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

/// The mean loss of given parameters over some samples.
pub struct OuterLoss<'a, M: Model, O> {
    /// theta.
    pub parameters: &'a M::Parameters<f32>,
    /// Where.
    pub outer: &'a O,
}

impl<M: Model, O: OctetSamples> Kernel for OuterLoss<'_, M, O> {
    type Output = f32;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f32 {
        let mut loss = L::constant(0.0);
        for octet in (0..self.outer.octets()).step_by(L::OCTETS) {
            let sample = self.outer.read::<L>(octet);
            let modelled = M::brdf::<L>(self.parameters, &sample.at);
            let cosine = sample.at.cos_theta_i();
            let found = cosine_weighted_log_error(sample.measured, modelled, cosine, sample.weight);
            loss = loss + found.value;
        }
        loss.total()
    }
}
