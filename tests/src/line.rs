//! A bad line: bytes that are lost, altered, doubled and swapped.

use std::io::{self, Read, Write};

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A stream that spoils bytes in both directions, the same way for the same seed and bytes.
#[derive(Debug)]
pub struct BadLine<S> {
    stream: S,
    random: ChaCha8Rng,
    rate: f64,
    /// Bytes that were spoiled so far.
    pub spoiled: usize,
}

impl<S> BadLine<S> {
    /// Spoils each byte with a probability of `rate`.
    #[must_use]
    pub fn new(stream: S, rate: f64, seed: u64) -> Self {
        Self {
            stream,
            random: ChaCha8Rng::seed_from_u64(seed),
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
            match self.random.random_range(0..4) {
                0 => {}
                1 => spoiled.push(byte ^ (1 << self.random.random_range(0..8))),
                2 => spoiled.extend([*byte; 2]),
                // Before the one that was ahead of it.
                _ => spoiled.insert(spoiled.len().saturating_sub(1), *byte),
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
