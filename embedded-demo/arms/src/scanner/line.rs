//! The line between driver and host.

use glimpse_core::driver::Driver;
use glimpse_core::fit::Fitter;

use super::Platform;
use super::clock::Clock;

/// A host that listens has so many microseconds to hear what failed.
const COMPLAINT: u32 = 500_000;

/// Carries bytes both ways. Out of line: there are two calls of it.
#[inline(never)]
pub(super) fn exchange<K: Fitter>(driver: &mut Driver<'_, K>, platform: &mut impl Platform) {
    while let Some(byte) = platform.receive() {
        driver.receive(byte);
    }
    while let Some(byte) = driver.outgoing().first()
        && platform.send(*byte)
    {
        driver.sent(1);
    }
}

/// Tells a host what failed.
pub(super) fn complain<K: Fitter>(
    driver: &mut Driver<'_, K>,
    clock: &mut Clock,
    platform: &mut impl Platform,
) {
    let mut left = COMPLAINT;
    while left > 0 {
        let elapsed = platform.elapsed();
        left = left.saturating_sub(elapsed);
        exchange(driver, platform);
        // What it wants to be done is for a scan that goes on.
        let _ = driver.poll(clock.advance(elapsed));
    }
}
