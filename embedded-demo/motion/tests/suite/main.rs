//! Tests of motion and storage on a host.

mod flash;
mod machine;
mod motion;
mod route;
mod store;

/// A generator of random numbers.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// Returns an integer from 0 to `n` - 1.
    pub(crate) fn below(&mut self, n: u32) -> u32 {
        let product = self.0.wrapping_mul(6_364_136_223_846_793_005);
        self.0 = product.wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 32) as u32 % n
    }

    /// Returns a number from 0 to 1.
    pub(crate) fn unit(&mut self) -> f32 {
        self.below(1 << 24) as f32 / (1 << 24) as f32
    }
}
