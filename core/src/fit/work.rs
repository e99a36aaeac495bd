//! Units of work, which belong to stages.

use core::ops::Range;

/// Does the units of work of a range, each given its stage, its index there, and true if it is the stage's last one. The
/// stages follow each other, each with its number of units.
#[inline(always)]
pub(super) fn advance<T: Copy>(
    stages: impl Iterator<Item = (T, usize)>,
    range: Range<u32>,
    mut work: impl FnMut(T, usize, bool),
) {
    let mut first = 0;
    for (stage, units) in stages {
        let end = units.saturating_add(first);
        for unit in first.max(range.start as usize)..end.min(range.end as usize) {
            work(stage, unit - first, unit + 1 == end);
        }
        first = end;
    }
}

/// Returns the number of units of all stages.
pub(super) fn total<T>(stages: impl Iterator<Item = (T, usize)>) -> u32 {
    stages.fold(0, |sum, (_, units)| units.saturating_add(sum)) as u32
}
