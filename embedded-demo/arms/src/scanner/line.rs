//! The line between driver and host.
//!
//! A driver knows which recipe did not serve, but each scan has a driver of its own; so the line
//! keeps offers of that recipe from it.

use glimpse_core::driver::Driver;
use glimpse_core::fit::Fitter;
use glimpse_core::link::{FRAME_BYTES, Failure, FrameReader, Reply, encode};

use super::milliseconds::Milliseconds;
use super::{Platform, ScannerError};

/// A host that listens has so many microseconds to hear what failed.
const COMPLAINT: u32 = 500_000;

/// The line of one driver.
pub(super) struct Line {
    reader: FrameReader,
    /// The checksum of a recipe that the driver shall not hear of.
    declined: Option<u32>,
    /// The checksum of the recipe that it has heard of last.
    offered: Option<u32>,
}

impl Line {
    pub(super) fn new(declined: Option<u32>) -> Self {
        Self {
            reader: FrameReader::new(),
            declined,
            offered: None,
        }
    }

    /// The checksum of the recipe that the driver has heard of last.
    pub(super) fn offered(&self) -> Option<u32> {
        self.offered
    }

    /// Carries frames one way and bytes the other. Out of line: there are two calls of it.
    #[inline(never)]
    pub(super) fn exchange<K: Fitter, const CAPACITY: usize>(
        &mut self,
        driver: &mut Driver<'_, '_, K, CAPACITY>,
        platform: &mut impl Platform,
    ) {
        while let Some(byte) = platform.receive() {
            if let Some(Ok((sequence, reply))) = self.reader.push(byte) {
                hand_on(sequence, &self.sift(reply), driver);
            }
        }
        while let Some(byte) = driver.outgoing().first()
            && platform.send(*byte)
        {
            driver.sent(1);
        }
    }

    /// What the driver shall hear: of a recipe that was declined, that there is none.
    fn sift(&mut self, reply: Reply) -> Reply {
        let Reply::Recipe { checksum, .. } = reply else {
            return reply;
        };
        if self.declined == Some(checksum) {
            return Reply::Accepted;
        }
        self.offered = Some(checksum);
        reply
    }

    /// Tells a host what failed.
    pub(super) fn complain<K: Fitter, const CAPACITY: usize>(
        &mut self,
        driver: &mut Driver<'_, '_, K, CAPACITY>,
        error: &ScannerError,
        platform: &mut impl Platform,
    ) {
        match error {
            ScannerError::Scan(_) => {} // the driver knows
            _ => driver.fail(Failure::Machine),
        }
        let mut milliseconds = Milliseconds::default();
        let mut left = COMPLAINT;
        while left > 0 {
            let elapsed = platform.elapsed();
            left = left.saturating_sub(elapsed);
            self.exchange(driver, platform);
            // What it wants to be done is for a scan that goes on.
            let _ = driver.poll(milliseconds.of(elapsed));
        }
    }
}

/// Gives a driver a reply, by the bytes of its frame.
fn hand_on<K: Fitter, const CAPACITY: usize>(
    sequence: u32,
    reply: &Reply,
    driver: &mut Driver<'_, '_, K, CAPACITY>,
) {
    let mut frame = [0; FRAME_BYTES];
    // The buffer has room for every reply.
    for byte in encode(sequence, reply, &mut frame).unwrap_or_default() {
        driver.receive(*byte);
    }
}
