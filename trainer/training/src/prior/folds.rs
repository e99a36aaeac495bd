//! The folds of cross-validation.

use glimpse_materials::SourceShare;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use crate::loss_predictor::HeldOutOrigin;

/// The number of folds.
pub(super) const FOLDS: usize = 4;
/// The minimum number of materials of a source that is a fold.
const MIN_SOURCE: usize = 5;
/// The minimum number of materials to form folds.
const MIN_MATERIALS_FOR_FOLDS: usize = 10;

/// The materials of a fold.
pub(super) struct Fold {
    pub(super) materials: Vec<usize>,
    /// [`HeldOutOrigin::Source`] if the fold is a whole source, otherwise [`HeldOutOrigin::Material`].
    pub(super) origin: HeldOutOrigin,
}

/// Returns the folds. The list is empty for too few materials. With several sources, the smallest one is a fold of its own
/// if it has at least [`MIN_SOURCE`] materials and at most a quarter of all: its losses are those of materials of another
/// origin.
pub(super) fn folds(materials: usize, sources: &[SourceShare], seed: u64) -> Vec<Fold> {
    if materials < MIN_MATERIALS_FOR_FOLDS {
        return Vec::new();
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(u64::MAX);
    let smallest = sources.iter().map(|source| source.materials).min();
    let smallest = smallest
        .filter(|count| sources.len() > 1 && (MIN_SOURCE..=materials / FOLDS).contains(count));
    let mut first = 0;
    let mut source = 0..0;
    for each in sources {
        if Some(each.materials) == smallest {
            source = first..first + each.materials;
        }
        first += each.materials;
    }
    let mut order: Vec<usize> = (0..materials)
        .filter(|material| !source.contains(material))
        .collect();
    order.shuffle(&mut random);
    let count = FOLDS - usize::from(!source.is_empty());
    let fold = |first| Fold {
        materials: order.iter().copied().skip(first).step_by(count).collect(),
        origin: HeldOutOrigin::Material,
    };
    let mut folds: Vec<Fold> = (0..count).map(fold).collect();
    if !source.is_empty() {
        folds.push(Fold {
            materials: source.collect(),
            origin: HeldOutOrigin::Source,
        });
    }
    folds
}

#[cfg(test)]
mod tests {
    use glimpse_materials::Source;

    use super::*;

    /// The smallest of several sources is a fold, unless it is too small or too large.
    #[test]
    fn smallest_source_is_a_fold() {
        let sources = |counts: &[usize]| -> Vec<SourceShare> {
            let source = |materials: &usize| SourceShare {
                materials: *materials,
                ..SourceShare::single(&Source("a".to_owned()), 1)
            };
            counts.iter().map(source).collect()
        };
        for (counts, expected) in [
            (&[100, 12][..], Some(100..112)),
            (&[12, 100], Some(0..12)),
            (&[100, 4], None),
            (&[60, 50], None),
            (&[110], None),
            (&[20, 200, 20], Some(220..240)),
        ] {
            let count = counts.iter().sum();
            let folds = folds(count, &sources(counts), 3);
            assert_eq!(folds.len(), FOLDS);
            let source = folds
                .iter()
                .find(|fold| fold.origin == HeldOutOrigin::Source);
            let source = source.map(|fold| fold.materials.clone());
            assert_eq!(source, expected.map(Iterator::collect), "{counts:?}");
            let mut all: Vec<usize> = folds.into_iter().flat_map(|fold| fold.materials).collect();
            all.sort_unstable();
            assert!(all.into_iter().eq(0..count), "{counts:?}");
        }
        assert!(folds(MIN_MATERIALS_FOR_FOLDS - 1, &[], 0).is_empty());
    }
}
