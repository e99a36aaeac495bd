//! Sums over samples on this machine's threads: a long list is worked through in chunks.
//!
//! Chunks are added in their order, so that the outcome does not depend on the number of threads.

use std::ops::Range;

use glimpse_core::model::{ParameterSet, SampleGradient};
use rayon::prelude::*;

use crate::dual::Dual;
use crate::lane_model::LaneModel;
use crate::lanes::{MOST_OCTETS, Octet};
use crate::samples::SampleOctets;

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

/// The mean loss over all samples, and its gradient.
pub(crate) fn gradient<M: LaneModel>(
    theta: &M::Parameters<f32>,
    samples: &SampleOctets<'_>,
    gradient: &mut M::Parameters<f32>,
) -> f32 {
    let octets = samples.octets();
    let least = match samples.in_a_row {
        true => GRADIENT_CHUNK_IN_A_ROW,
        false => GRADIENT_CHUNK,
    };
    if octets <= least {
        return M::gradient_of(theta, samples, 0..octets, gradient);
    }
    let found: Vec<(f32, M::Parameters<f32>)> = chunks(octets, chunk_size(octets, least))
        .map(|octets| {
            let mut gradient = M::Parameters::filled(0.0);
            let loss = M::gradient_of(theta, samples, octets, &mut gradient);
            (loss, gradient)
        })
        .collect();
    add_up(found.iter().map(|(_, gradient)| gradient), gradient);
    found.iter().map(|(loss, _)| loss).sum()
}

/// The product of Hessian and tangent over all samples.
pub(crate) fn product<M: LaneModel>(
    theta: &M::Parameters<Dual<f32>>,
    samples: &SampleOctets<'_>,
    product: &mut M::Parameters<f32>,
    derivatives: Option<&mut [SampleGradient<Octet>]>,
) {
    let octets = samples.octets();
    if octets <= PRODUCT_CHUNK {
        return M::product_of(theta, samples, 0..octets, product, derivatives);
    }
    let compute = |octets, derivatives: Option<&mut [SampleGradient<Octet>]>| {
        let mut product = M::Parameters::filled(0.0);
        M::product_of(theta, samples, octets, &mut product, derivatives);
        product
    };
    let size = chunk_size(octets, PRODUCT_CHUNK);
    let chunks = chunks(octets, size);
    let found: Vec<M::Parameters<f32>> = match derivatives {
        None => chunks.map(|range| compute(range, None)).collect(),
        Some(derivatives) => chunks
            .zip(derivatives.par_chunks_mut(size))
            .map(|(range, derivatives)| compute(range, Some(derivatives)))
            .collect(),
    };
    add_up(found.iter(), product);
}

/// The sum of parameter sets, in their order.
fn add_up<'a, P: ParameterSet<f32> + 'a>(sets: impl Iterator<Item = &'a P>, sum: &mut P) {
    *sum = P::filled(0.0);
    for set in sets {
        for (entry, value) in sum.iter_mut().zip(set.iter()) {
            *entry += value;
        }
    }
}
