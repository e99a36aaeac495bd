//! Sums over samples on all threads. Long lists are split into chunks.
//!
//! Chunks are added in order, so the result does not depend on the number of threads.

use std::ops::Range;

use glimpse_core::model::{Model, ParameterSet, SampleGradient};
use rayon::prelude::*;

use crate::dual::Dual;
use crate::lanes::{MAX_OCTETS, Octet};
use crate::samples::SampleOctets;
use crate::sums;

/// The least number of octets in a chunk of a gradient. Shorter lists are computed on one thread, because waking
/// another thread takes about 20 us.
const MIN_GRADIENT_CHUNK: usize = 64;
/// The least number of octets in a chunk of a gradient while the other threads are awake: see
/// [`SampleOctets::back_to_back`].
const MIN_GRADIENT_CHUNK_AWAKE: usize = 32;
/// The least number of octets in a chunk of a Hessian-vector product.
const MIN_PRODUCT_CHUNK: usize = 32;
/// The largest number of chunks of a list.
const MAX_CHUNKS: usize = 16;

/// Returns the number of octets in a chunk. It is a multiple of [`MAX_OCTETS`], and does not depend on the number of
/// threads.
fn chunk_size(octets: usize, min_size: usize) -> usize {
    let size = octets.div_ceil(MAX_CHUNKS).next_multiple_of(MAX_OCTETS);
    size.max(min_size)
}

/// Splits a list of octets into chunks.
fn chunks(octets: usize, size: usize) -> impl IndexedParallelIterator<Item = Range<usize>> {
    (0..octets.div_ceil(size))
        .into_par_iter()
        .map(move |chunk| chunk * size..((chunk + 1) * size).min(octets))
}

/// Returns the mean loss over all samples, and computes its gradient.
pub(crate) fn gradient<M: Model>(
    theta: &M::Parameters<f32>,
    samples: &SampleOctets<'_>,
    gradient: &mut M::Parameters<f32>,
) -> f32 {
    let octets = samples.octets();
    let min_size = match samples.back_to_back {
        true => MIN_GRADIENT_CHUNK_AWAKE,
        false => MIN_GRADIENT_CHUNK,
    };
    if octets <= min_size {
        return sums::gradient::<M>(theta, samples, 0..octets, gradient);
    }
    let partial: Vec<(f32, M::Parameters<f32>)> = chunks(octets, chunk_size(octets, min_size))
        .map(|octets| {
            let mut gradient = M::Parameters::filled(0.0);
            let loss = sums::gradient::<M>(theta, samples, octets, &mut gradient);
            (loss, gradient)
        })
        .collect();
    sum_in_order(partial.iter().map(|(_, gradient)| gradient), gradient);
    partial.iter().map(|(loss, _)| loss).sum()
}

/// Computes the product of the mean loss's Hessian and the tangent of `theta`, over all samples; see
/// [`SampleList::product`](crate::inner_loop::SampleList::product).
pub(crate) fn product<M: Model>(
    theta: &M::Parameters<Dual<f32>>,
    samples: &SampleOctets<'_>,
    product: &mut M::Parameters<f32>,
    derivatives: Option<&mut [SampleGradient<Octet>]>,
) {
    let octets = samples.octets();
    if octets <= MIN_PRODUCT_CHUNK {
        return sums::product::<M>(theta, samples, 0..octets, product, derivatives);
    }
    let compute = |octets, derivatives: Option<&mut [SampleGradient<Octet>]>| {
        let mut product = M::Parameters::filled(0.0);
        sums::product::<M>(theta, samples, octets, &mut product, derivatives);
        product
    };
    let size = chunk_size(octets, MIN_PRODUCT_CHUNK);
    let chunks = chunks(octets, size);
    let partial: Vec<M::Parameters<f32>> = match derivatives {
        None => chunks.map(|range| compute(range, None)).collect(),
        Some(derivatives) => chunks
            .zip(derivatives.par_chunks_mut(size))
            .map(|(range, derivatives)| compute(range, Some(derivatives)))
            .collect(),
    };
    sum_in_order(partial.iter(), product);
}

/// Sums parameter sets in their order.
fn sum_in_order<'a, P: ParameterSet<f32> + 'a>(sets: impl Iterator<Item = &'a P>, sum: &mut P) {
    *sum = P::filled(0.0);
    for set in sets {
        for (entry, value) in sum.iter_mut().zip(set.iter()) {
            *entry += value;
        }
    }
}
