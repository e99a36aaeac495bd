//! Sums over samples in chunks, which threads share.
//!
//! Chunks are added in order, so the result does not depend on the number of threads.

use std::ops::Range;

use glimpse_core::model::{Model, ParameterSet, SampleGradient};

use crate::crew::Crew;
use crate::dual::Dual;
use crate::inner_loop::SampleList;
use crate::lanes::{MAX_OCTETS, Octet};
use crate::samples::SampleOctets;
use crate::sums;

/// The least number of octets in a chunk.
const MIN_CHUNK: usize = 32;
/// The largest number of chunks of a list.
const MAX_CHUNKS: usize = 16;

/// The sum over a chunk: its loss, which is 0 for Hessian-vector products, and its gradient or product.
pub(crate) type Sum<M> = (f32, <M as Model>::Parameters<f32>);

/// Samples whose sums are shared by a crew, if there is one.
pub(crate) struct SharedList<'c, 's, M: Model> {
    pub(crate) samples: &'s SampleOctets<'s>,
    pub(crate) crew: Option<&'c Crew<'s, Sum<M>>>,
}

/// Returns the chunks of samples, as ranges of octets. They do not depend on the number of threads.
pub(crate) fn chunks(samples: &SampleOctets<'_>) -> Vec<Range<usize>> {
    let octets = samples.octets();
    let size = octets.div_ceil(MAX_CHUNKS).next_multiple_of(MAX_OCTETS);
    let size = size.max(MIN_CHUNK);
    let starts = (0..octets).step_by(size);
    starts
        .map(|start| start..(start + size).min(octets))
        .collect()
}

impl<'s, M: Model> SharedList<'_, 's, M> {
    /// Computes the sum over all octets at `theta`, where `compute` is the sum over some. Returns the loss.
    fn sum<T: Clone + Send + Sync + 's>(
        &self,
        theta: &T,
        sum: &mut M::Parameters<f32>,
        compute: fn(&T, &'s SampleOctets<'s>, Range<usize>, &mut M::Parameters<f32>) -> f32,
    ) -> f32 {
        let samples = self.samples;
        let chunks = chunks(samples);
        let count = chunks.len();
        if count <= 1 {
            return compute(theta, samples, 0..samples.octets(), sum);
        }
        let theta = theta.clone();
        let chunk_sum = move |chunk: usize| {
            let mut sum = M::Parameters::filled(0.0);
            (
                compute(&theta, samples, chunks[chunk].clone(), &mut sum),
                sum,
            )
        };
        let sums: Vec<Sum<M>> = match self.crew {
            Some(crew) => crew.map(count, chunk_sum),
            None => (0..count).map(chunk_sum).collect(),
        };
        *sum = M::Parameters::filled(0.0);
        for (_, chunk) in &sums {
            for (entry, value) in sum.iter_mut().zip(chunk.iter()) {
                *entry += value;
            }
        }
        sums.iter().map(|(loss, _)| loss).sum()
    }
}

impl<M: Model> SampleList<M, f32> for SharedList<'_, '_, M> {
    type Derivatives = SampleGradient<Octet>;

    fn gradient(&self, theta: &M::Parameters<f32>, gradient: &mut M::Parameters<f32>) -> f32 {
        self.sum(theta, gradient, sums::gradient::<M>)
    }

    fn product(
        &self,
        theta: &M::Parameters<Dual<f32>>,
        product: &mut M::Parameters<f32>,
        derivatives: Option<&mut [SampleGradient<Octet>]>,
    ) {
        if derivatives.is_some() {
            let octets = 0..self.samples.octets();
            return sums::product::<M>(theta, self.samples, octets, product, derivatives);
        }
        self.sum(theta, product, |theta, samples, octets, product| {
            sums::product::<M>(theta, samples, octets, product, None);
            0.0
        });
    }
}
