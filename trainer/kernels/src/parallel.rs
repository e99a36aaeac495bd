//! Sums over samples on all threads. Long lists are split into chunks.
//!
//! Chunks are added in order, so the result does not depend on the number of threads.

use std::ops::Range;

use glimpse_core::model::{ParameterSet, SampleGradient};
use rayon::prelude::*;

use crate::dual::Dual;
use crate::lane_model::LaneModel;
use crate::lanes::{MAX_OCTETS, Octet};
use crate::samples::SampleOctets;

/// The largest number of octets whose gradient is computed on one thread. Waking another thread costs about 20 us,
/// which does not pay off for fewer.
const GRADIENT_CHUNK: usize = 64;
/// The same limit while the other threads are awake.
const GRADIENT_CHUNK_BACK_TO_BACK: usize = 32;
/// The largest number of octets whose Hessian-vector product is computed on one thread.
const PRODUCT_CHUNK: usize = 32;
/// The largest number of chunks of a list.
const MAX_CHUNKS: usize = 16;

/// Returns the number of octets in a chunk. It depends on the length of the list only, and is a multiple of the widest
/// lanes.
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
pub(crate) fn gradient<M: LaneModel>(
    theta: &M::Parameters<f32>,
    samples: &SampleOctets<'_>,
    gradient: &mut M::Parameters<f32>,
) -> f32 {
    let octets = samples.octets();
    let min_size = match samples.back_to_back {
        true => GRADIENT_CHUNK_BACK_TO_BACK,
        false => GRADIENT_CHUNK,
    };
    if octets <= min_size {
        return M::partial_gradient(theta, samples, 0..octets, gradient);
    }
    let partial: Vec<(f32, M::Parameters<f32>)> = chunks(octets, chunk_size(octets, min_size))
        .map(|octets| {
            let mut gradient = M::Parameters::filled(0.0);
            let loss = M::partial_gradient(theta, samples, octets, &mut gradient);
            (loss, gradient)
        })
        .collect();
    sum_in_order(partial.iter().map(|(_, gradient)| gradient), gradient);
    partial.iter().map(|(loss, _)| loss).sum()
}

/// Computes the product of Hessian and tangent over all samples.
pub(crate) fn product<M: LaneModel>(
    theta: &M::Parameters<Dual<f32>>,
    samples: &SampleOctets<'_>,
    product: &mut M::Parameters<f32>,
    derivatives: Option<&mut [SampleGradient<Octet>]>,
) {
    let octets = samples.octets();
    if octets <= PRODUCT_CHUNK {
        return M::partial_product(theta, samples, 0..octets, product, derivatives);
    }
    let compute = |octets, derivatives: Option<&mut [SampleGradient<Octet>]>| {
        let mut product = M::Parameters::filled(0.0);
        M::partial_product(theta, samples, octets, &mut product, derivatives);
        product
    };
    let size = chunk_size(octets, PRODUCT_CHUNK);
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
