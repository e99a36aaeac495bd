//! Pseudo-random numbers, the same in every run.

/// A SplitMix64 generator.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number from -1 to 1.
    pub(crate) fn number(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1 << 23) as f32 - 1.0
    }

    /// A number from 0 to 1.
    pub(crate) fn uniform(&mut self) -> f64 {
        self.bits() as f64 / u64::MAX as f64
    }

    /// A nearly normal number of mean 0 and standard deviation 1: a sum of twelve uniform numbers.
    pub(crate) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }

    /// `count` numbers from `-size` to `size`.
    pub(crate) fn numbers(&mut self, count: usize, size: f32) -> Vec<f32> {
        (0..count).map(|_| size * self.number()).collect()
    }

    /// Corrupts a block of bytes on a line: one in ten is lost or doubled, and bytes are [altered](Self::corrupt_bytes).
    pub(crate) fn corrupt(&mut self, bytes: Vec<u8>, odds: u64) -> Vec<u8> {
        match self.bits() % 20 {
            0 => Vec::new(),
            1 => self.corrupt_bytes(&bytes.repeat(2), odds),
            _ => self.corrupt_bytes(&bytes, odds),
        }
    }

    /// Corrupts one byte in `odds`: it is lost, altered, doubled, swapped with the previous one, or preceded by a random
    /// byte, or the rest is cut.
    pub(crate) fn corrupt_bytes(&mut self, bytes: &[u8], odds: u64) -> Vec<u8> {
        let mut below = |bound: u64| self.bits() % bound;
        let mut corrupted = Vec::new();
        for byte in bytes.iter().copied() {
            if below(odds) > 0 {
                corrupted.push(byte);
                continue;
            }
            match below(6) {
                0 => {}
                1 => corrupted.push(byte ^ (1 << below(8))),
                2 => corrupted.extend([byte; 2]),
                3 => corrupted.insert(corrupted.len().saturating_sub(1), byte),
                4 => corrupted.extend([below(256) as u8, byte]),
                _ => break,
            }
        }
        corrupted
    }
}
