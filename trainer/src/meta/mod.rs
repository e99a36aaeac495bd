//! Meta-learning: where to measure, from which parameters to start, and how far to step.

pub mod checkpoint;
pub mod descent;
pub mod evolution;
pub mod gradient;
pub mod outer;
pub mod parameters;
pub mod pattern;
pub mod phase;
pub mod plan;
pub mod pool;
pub mod run;
pub mod start;
pub mod trainee;
pub mod unroll;
pub mod variation;

use glimpse_core::model::ParameterSet;
use glimpse_core::numeric::Entry;

/// Copies a flat list, in the model's order, into a parameter set.
pub fn unflatten<T: Entry, P: ParameterSet<T>>(list: &[T], set: &mut P) {
    for (entry, value) in set.iter_mut().zip(list) {
        *entry = *value;
    }
}
