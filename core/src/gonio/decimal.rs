//! Numbers in messages.

/// A number of 0 to four millions, written with three decimals; others as the nearest of those.
///
/// By integers: the formatting of floats in the standard library takes much flash, and has assertions.
pub(super) struct Decimal(pub(super) f32);

impl core::fmt::Display for Decimal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let thousandths = (1000.0 * self.0 + 0.5) as u32; // saturates
        write!(f, "{}.{:03}", thousandths / 1000, thousandths % 1000)
    }
}
