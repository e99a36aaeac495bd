//! Large patterns, built by doubling small ones.

/// The maximum number of samples that is trained without doubling.
pub(super) const MAX_UNDOUBLED: usize = 16;

/// Returns the number of samples after each doubling, from `first` up to `target`.
pub(super) fn doubled(first: usize, target: usize) -> impl Iterator<Item = usize> {
    std::iter::successors(Some(first), move |n| {
        (*n < target).then_some((2 * n).min(target))
    })
    .skip(1)
}
