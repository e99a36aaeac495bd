//! Seeds of the link's sequence numbers.

/// Number of bits that count drivers. The bits above count boots.
const DRIVER_BITS: u32 = 16;

/// Seeds for [`Config::sequence_seed`](glimpse_core::driver::Config::sequence_seed), a new one for each driver.
///
/// A seed consists of the boot counter in the flash ([`Readings::count_boot`]) and the number of drivers since the
/// boot. Seeds repeat after 65,536 boots. A scanner that waits for a command creates a driver every two seconds, and so
/// reaches the seeds of the next boot after 36 hours.
///
/// [`Readings::count_boot`]: crate::store::readings::Readings::count_boot
#[derive(Clone, Copy, Debug)]
pub struct Seeds {
    next: u32,
}

impl Seeds {
    /// Creates the seeds of a boot. `boots` is the number of boots including this one.
    pub fn new(boots: u32) -> Self {
        Self {
            next: boots.wrapping_shl(DRIVER_BITS),
        }
    }

    /// Returns the seed of the next driver.
    pub(super) fn next(&mut self) -> u32 {
        self.next = self.next.wrapping_add(1);
        self.next
    }
}
