//! A noisy serial line: bytes are lost, altered, doubled, swapped and inserted, and frames are truncated.

#[allow(dead_code)] // core's tests use all of it
#[path = "../../core/tests/suite/random.rs"]
mod random;

use std::collections::VecDeque;
use std::io::{self, Read, Write};

use random::Random;

/// A stream that corrupts bytes in both directions. The same seed and bytes give the same errors.
pub struct NoisyLine<S> {
    stream: S,
    random: Random,
    odds: u64,
    /// Received bytes that were not read yet.
    received: VecDeque<u8>,
    /// Number of blocks corrupted until now.
    pub corrupted: usize,
}

impl<S> NoisyLine<S> {
    /// Corrupts one byte in `odds`.
    #[must_use]
    pub fn new(stream: S, odds: u64, seed: u64) -> Self {
        Self {
            stream,
            random: Random(seed),
            odds,
            received: VecDeque::new(),
            corrupted: 0,
        }
    }

    fn corrupt(&mut self, bytes: &[u8]) -> Vec<u8> {
        let corrupted = self.random.corrupt_bytes(bytes, self.odds);
        self.corrupted += usize::from(corrupted != bytes);
        corrupted
    }
}

impl<S: Read> Read for NoisyLine<S> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut bytes = [0; 64];
        // Zero bytes would signal the end of the stream.
        while self.received.is_empty() {
            let count = self.stream.read(&mut bytes)?;
            if count == 0 {
                return Ok(0);
            }
            let corrupted = self.corrupt(&bytes[..count]);
            self.received.extend(corrupted);
        }
        self.received.read(buffer)
    }
}

impl<S: Write> Write for NoisyLine<S> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let corrupted = self.corrupt(bytes);
        self.stream.write_all(&corrupted)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}
