//! Samples of a scan in memory.

use crate::geometry::HalfDifference;

/// One measured sample of a BRDF.
#[derive(Clone, Copy, Debug)]
pub struct Sample<S> {
    /// The half and difference vectors of the measurement.
    pub at: HalfDifference<S>,
    /// The measured value: the BRDF y in linear RGB, sr^-1, not times the cosine.
    pub measured: [S; 3],
    /// Its weight in the loss: 1 / (3 n) for the mean over n samples and three channels.
    pub weight: S,
}

/// Words of one sample.
pub const SLOT_WORDS: usize = 10;
/// One sample in memory: hx, hz, dx, dy, dz, the measured red, green and blue (BRDF, sr^-1, not times the cosine), the
/// smallest value that the fit accepts in their place, and a word whose bits are flags.
pub type Slot = [f32; SLOT_WORDS];
/// Flag of a sample that counts in the loss.
pub(crate) const COUNTED: u32 = 1;

/// Returns the memory form of a sample that counts in the loss. The fit does not clamp its values.
#[must_use]
pub fn slot_of(at: &HalfDifference<f32>, [red, green, blue]: [f32; 3]) -> Slot {
    let HalfDifference { hx, hz, dx, dy, dz } = *at;
    let flags = f32::from_bits(COUNTED);
    [hx, hz, dx, dy, dz, red, green, blue, f32::MIN, flags]
}

/// Measured samples in memory. Values below the smallest that the fit accepts are clamped when they are used.
#[derive(Clone, Copy, Debug)]
pub struct Samples<'a> {
    slots: &'a [Slot],
    weight: f32,
}

impl<'a> Samples<'a> {
    /// Creates a list of samples. Each sample that counts has the weight `weight` in the loss: 1 / (3 n) for the mean
    /// over n samples and three channels.
    #[must_use]
    pub fn new(slots: &'a [Slot], weight: f32) -> Self {
        Self { slots, weight }
    }

    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.slots.len()
    }

    /// Returns true if the list is empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.slots.is_empty()
    }

    /// The first samples, up to `count`.
    #[must_use]
    pub fn take(&self, count: usize) -> Self {
        let first = self.slots.get(..count).unwrap_or(self.slots);
        Self::new(first, self.weight)
    }

    /// The samples from index `first` on.
    #[must_use]
    pub fn skip(&self, first: usize) -> Self {
        Self::new(self.slots.get(first..).unwrap_or_default(), self.weight)
    }

    /// The sample with this index.
    #[must_use]
    pub fn get(&self, index: usize) -> Option<Sample<f32>> {
        self.slots.get(index).map(|slot| unpack(slot, self.weight))
    }

    /// The samples, in order.
    #[inline(always)]
    pub fn iter(&self) -> impl ExactSizeIterator<Item = Sample<f32>> + Clone + 'a {
        let weight = self.weight;
        self.slots.iter().map(move |slot| unpack(slot, weight))
    }
}

#[inline(always)]
pub(crate) fn unpack(slot: &Slot, weight: f32) -> Sample<f32> {
    let [hx, hz, dx, dy, dz, measured @ .., min, flags] = *slot;
    Sample {
        at: HalfDifference { hx, hz, dx, dy, dz },
        measured: measured.map(|value| if value < min { min } else { value }),
        weight: match flags.to_bits() & COUNTED {
            0 => 0.0,
            _ => weight,
        },
    }
}
