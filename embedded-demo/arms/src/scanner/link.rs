//! The serial link between driver and host.

use glimpse_core::driver::Driver;
use glimpse_core::fit::Fitter;

use super::Platform;
use super::clock::Clock;

/// Time to report a failure to a host, us.
const REPORT_TIMEOUT_US: u32 = 500_000;

/// Transfers bytes in both directions. Not inlined, because there are two calls.
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

/// Reports a failure to the host.
pub(super) fn report_failure<K: Fitter>(
    driver: &mut Driver<'_, K>,
    clock: &mut Clock,
    platform: &mut impl Platform,
) {
    let mut left_us = REPORT_TIMEOUT_US;
    while left_us > 0 {
        let elapsed_us = platform.elapsed_us();
        left_us = left_us.saturating_sub(elapsed_us);
        exchange(driver, platform);
        // The scan has failed, so the driver's actions are ignored.
        let _ = driver.poll(clock.advance(elapsed_us));
    }
}
