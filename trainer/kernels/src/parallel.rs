//! Sums over samples in chunks, which threads share.
//!
//! Chunks are added in order, so the result does not depend on the number of threads.

use std::ops::Range;

use glimpse_core::model::{Model, ParameterSet, SampleGradient};
use glimpse_core::numeric::Value;

use crate::crew::Crew;
use crate::dual::Dual;
use crate::inner_loop::{SampleList, set, set_mut};
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
    /// Returns samples whose sums are computed by this thread.
    pub(crate) fn alone(samples: &'s SampleOctets<'s>) -> Self {
        Self {
            samples,
            crew: None,
        }
    }

    /// Computes the sum over all octets at `theta`, where `compute` is the sum over some. Returns the loss.
    #[expect(
        clippy::type_complexity,
        reason = "the signature of the kernels in `sums`"
    )]
    fn sum<T: Value + Send + Sync>(
        &self,
        theta: &[T],
        sum: &mut [f32],
        compute: fn(
            &M::Parameters<T>,
            &'s SampleOctets<'s>,
            Range<usize>,
            &mut M::Parameters<f32>,
        ) -> f32,
    ) -> f32 {
        let (theta, samples) = (set::<M, T>(theta), self.samples);
        let chunks = chunks(samples);
        let count = chunks.len();
        if count <= 1 {
            return compute(theta, samples, 0..samples.octets(), set_mut::<M, f32>(sum));
        }
        let theta = theta.clone();
        let chunk_sum = move |chunk: usize| {
            let mut sum = M::Parameters::filled(0.0);
            let loss = compute(&theta, samples, chunks[chunk].clone(), &mut sum);
            (loss, sum)
        };
        let sums: Vec<Sum<M>> = match self.crew {
            Some(crew) => crew.map(count, chunk_sum),
            None => (0..count).map(chunk_sum).collect(),
        };
        sum.fill(0.0);
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

    fn gradient(&self, theta: &[f32], gradient: &mut [f32]) -> f32 {
        self.sum(theta, gradient, sums::gradient::<M>)
    }

    fn product(
        &self,
        theta: &[Dual<f32>],
        product: &mut [f32],
        derivatives: Option<&mut [SampleGradient<Octet>]>,
    ) {
        if derivatives.is_some() {
            let octets = 0..self.samples.octets();
            let (theta, product) = (set::<M, _>(theta), set_mut::<M, _>(product));
            return sums::product::<M>(theta, self.samples, octets, product, derivatives);
        }
        self.sum(theta, product, |theta, samples, octets, product| {
            sums::product::<M>(theta, samples, octets, product, None);
            0.0
        });
    }
}
