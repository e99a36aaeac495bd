//! Numbers in error messages.

/// A number from 0 to 4 million, formatted with three decimals. Other numbers are clamped.
///
/// The formatting uses integers, because the core library's formatting of floats takes more flash and can panic.
pub(super) struct Decimal(pub(super) f32);

impl core::fmt::Display for Decimal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let thousandths = (1000.0 * self.0 + 0.5) as u32; // saturates
        write!(f, "{}.{:03}", thousandths / 1000, thousandths % 1000)
    }
}
