//! A noisy serial line: bytes are lost, altered, duplicated and swapped, and frames are truncated.

use std::io::{self, Read, Write};

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A transmission error of a byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The byte does not arrive.
    Lost,
    /// One bit of the byte flips.
    Altered,
    /// The byte arrives twice.
    Duplicated,
    /// The byte arrives before its predecessor.
    Swapped,
    /// The byte and the rest of its block do not arrive.
    Truncated,
}

impl Fault {
    /// All faults.
    pub const ALL: [Self; 5] = [
        Self::Lost,
        Self::Altered,
        Self::Duplicated,
        Self::Swapped,
        Self::Truncated,
    ];
}

/// A stream that corrupts bytes in both directions. The same seed and bytes give the same errors.
#[derive(Debug)]
pub struct NoisyLine<S> {
    stream: S,
    random: ChaCha8Rng,
    faults: Vec<Fault>,
    rate: f64,
    /// Number of bytes corrupted until now.
    pub corrupted: usize,
}

impl<S> NoisyLine<S> {
    /// Corrupts each byte with probability `rate`, with any fault.
    #[must_use]
    pub fn new(stream: S, rate: f64, seed: u64) -> Self {
        Self::with(stream, &Fault::ALL, rate, seed)
    }

    /// Corrupts each byte with probability `rate`, with these faults.
    #[must_use]
    pub fn with(stream: S, faults: &[Fault], rate: f64, seed: u64) -> Self {
        Self {
            stream,
            random: ChaCha8Rng::seed_from_u64(seed),
            faults: faults.to_vec(),
            rate,
            corrupted: 0,
        }
    }

    fn corrupt(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut output = Vec::with_capacity(bytes.len());
        for byte in bytes {
            if !self.random.random_bool(self.rate) {
                output.push(*byte);
                continue;
            }
            self.corrupted += 1;
            let fault = self.faults[self.random.random_range(0..self.faults.len())];
            match fault {
                Fault::Lost => {}
                Fault::Altered => output.push(byte ^ (1 << self.random.random_range(0..8))),
                Fault::Duplicated => output.extend([*byte; 2]),
                Fault::Swapped => output.insert(output.len().saturating_sub(1), *byte),
                Fault::Truncated => break,
            }
        }
        output
    }
}

impl<S: Read> Read for NoisyLine<S> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        // Half of the buffer, so that there is room if all bytes are duplicated.
        let mut bytes = vec![0; buffer.len().div_ceil(2)];
        loop {
            let count = self.stream.read(&mut bytes)?;
            let output = self.corrupt(&bytes[..count]);
            // Zero bytes would signal the end of the stream.
            if count == 0 || !output.is_empty() {
                buffer[..output.len()].copy_from_slice(&output);
                return Ok(output.len());
            }
        }
    }
}

impl<S: Write> Write for NoisyLine<S> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let output = self.corrupt(bytes);
        self.stream.write_all(&output)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}
