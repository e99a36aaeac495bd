//! A bad line: bytes that are lost, altered, doubled and swapped, and frames that are cut.

use std::io::{self, Read, Write};

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What may happen to a byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// It does not arrive.
    Lost,
    /// A bit of it flips.
    Altered,
    /// It arrives twice.
    Doubled,
    /// It arrives before the one that was ahead of it.
    Swapped,
    /// Neither it nor what follows it at once arrives.
    Cut,
}

impl Fault {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Lost,
        Self::Altered,
        Self::Doubled,
        Self::Swapped,
        Self::Cut,
    ];
}

/// A stream that spoils bytes in both directions, the same way for the same seed and bytes.
#[derive(Debug)]
pub struct BadLine<S> {
    stream: S,
    random: ChaCha8Rng,
    faults: Vec<Fault>,
    rate: f64,
    /// Bytes that were spoiled so far.
    pub spoiled: usize,
}

impl<S> BadLine<S> {
    /// Spoils each byte with a probability of `rate`, by any fault.
    #[must_use]
    pub fn new(stream: S, rate: f64, seed: u64) -> Self {
        Self::with(stream, &Fault::ALL, rate, seed)
    }

    /// Spoils each byte with a probability of `rate`, by these faults.
    #[must_use]
    pub fn with(stream: S, faults: &[Fault], rate: f64, seed: u64) -> Self {
        Self {
            stream,
            random: ChaCha8Rng::seed_from_u64(seed),
            faults: faults.to_vec(),
            rate,
            spoiled: 0,
        }
    }

    fn spoil(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut spoiled = Vec::with_capacity(bytes.len());
        for byte in bytes {
            if !self.random.random_bool(self.rate) {
                spoiled.push(*byte);
                continue;
            }
            self.spoiled += 1;
            let fault = self.faults[self.random.random_range(0..self.faults.len())];
            match fault {
                Fault::Lost => {}
                Fault::Altered => spoiled.push(byte ^ (1 << self.random.random_range(0..8))),
                Fault::Doubled => spoiled.extend([*byte; 2]),
                Fault::Swapped => spoiled.insert(spoiled.len().saturating_sub(1), *byte),
                Fault::Cut => break,
            }
        }
        spoiled
    }
}
impl<S: Read> Read for BadLine<S> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        // Half, so that there is room if all are doubled.
        let mut bytes = vec![0; buffer.len().div_ceil(2)];
        loop {
            let count = self.stream.read(&mut bytes)?;
            let spoiled = self.spoil(&bytes[..count]);
            // No bytes would mean the end of the stream.
            if count == 0 || !spoiled.is_empty() {
                buffer[..spoiled.len()].copy_from_slice(&spoiled);
                return Ok(spoiled.len());
            }
        }
    }
}

impl<S: Write> Write for BadLine<S> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let spoiled = self.spoil(bytes);
        self.stream.write_all(&spoiled)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}
