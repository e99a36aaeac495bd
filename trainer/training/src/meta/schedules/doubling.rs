//! Patterns of many samples, from those of few.

/// Patterns of more samples are doubled from those.
pub(super) const UNDOUBLED: usize = 16;

/// How many samples there are after each doubling, from `first` until there are those `wanted`.
pub(super) fn doubled(first: usize, wanted: usize) -> impl Iterator<Item = usize> {
    std::iter::successors(Some(first), move |n| {
        (*n < wanted).then_some((2 * n).min(wanted))
    })
    .skip(1)
}
