//! Frames: messages with a checksum and delimiters.

use cobs::{CobsEncoder, DecodeResult, DecoderState, max_encoding_length};
use heapless::Vec;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::VALUES_PER_FRAME;
use crate::checksum::crc_32;

/// The largest length of a sequence number and a message, in bytes. `Values` is the longest: sequence number (5 bytes),
/// variant (1), offset and total (3 each), number of values (1), and the values (4 each). `RecipePart` takes 72 bytes.
const MESSAGE_BYTES: usize = 5 + 1 + 3 + 3 + 1 + 4 * VALUES_PER_FRAME;
/// The length of the CRC in bytes.
const CHECKSUM_BYTES: usize = 4;
/// The largest length of a frame's content before its COBS encoding, in bytes.
const CONTENT_BYTES: usize = MESSAGE_BYTES + CHECKSUM_BYTES;
/// The length of the longest frame in bytes, with the zeros at both ends.
pub const FRAME_BYTES: usize = 1 + max_encoding_length(CONTENT_BYTES) + 1;

/// An error in encoding or decoding a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FrameError {
    /// The frame, or a list in it, is too long.
    TooLong,
    /// The bytes were cut or altered in transit.
    Damaged,
    /// The frame is intact, but this version of the protocol has no such message.
    Unknown,
}

impl core::fmt::Display for FrameError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::TooLong => "the frame, or a list in it, is too long",
            Self::Damaged => "the frame was cut or altered in transit",
            Self::Unknown => "the frame holds an unknown message: compare the protocol versions",
        })
    }
}

impl core::error::Error for FrameError {}

/// Writes the frame of a message into `buffer` and returns the bytes used.
///
/// # Errors
/// [`FrameError::TooLong`] if `buffer` is too small. A [`Request`](super::Request) or a [`Reply`](super::Reply) always
/// fits into [`FRAME_BYTES`].
pub fn encode<'b, T: Serialize>(
    sequence: u32,
    message: &T,
    buffer: &'b mut [u8],
) -> Result<&'b [u8], FrameError> {
    let mut content = [0; MESSAGE_BYTES];
    let content =
        postcard::to_slice(&(sequence, message), &mut content).map_err(|_| FrameError::TooLong)?;
    let checksum = crc_32(content).to_le_bytes();

    let (first, rest) = buffer.split_first_mut().ok_or(FrameError::TooLong)?;
    *first = 0;
    let mut encoder = CobsEncoder::new(rest);
    encoder.push(content).map_err(|_| FrameError::TooLong)?;
    encoder.push(&checksum).map_err(|_| FrameError::TooLong)?;
    let end = encoder.finalize().saturating_add(1);
    *buffer.get_mut(end).ok_or(FrameError::TooLong)? = 0;
    buffer.get(..=end).ok_or(FrameError::TooLong)
}

/// Returns the CRC in the frame of a message.
pub(super) fn checksum_of<T: Serialize>(sequence: u32, message: &T) -> u32 {
    let mut content = [0; MESSAGE_BYTES];
    let content = postcard::to_slice(&(sequence, message), &mut content);
    content.map_or(0, |content| crc_32(content))
}

/// A decoder that finds frames in a stream of bytes.
#[derive(Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FrameReader {
    /// The decoded part of the current frame, with its checksum.
    content: Vec<u8, CONTENT_BYTES>,
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    cobs: DecoderState,
    overflowed: bool,
}

impl Default for FrameReader {
    fn default() -> Self {
        Self::new()
    }
}

impl FrameReader {
    /// Creates a reader that expects the start of a frame.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            content: Vec::new(),
            cobs: DecoderState::Idle,
            overflowed: false,
        }
    }

    /// Receives a byte. At the end of a frame it returns the sequence number and the message, or the error of the
    /// frame. An error does not affect the next frame.
    pub fn push<T: DeserializeOwned>(&mut self, byte: u8) -> Option<Result<(u32, T), FrameError>> {
        let is_valid_cobs = match self.cobs.feed(byte) {
            Ok(DecodeResult::NoData) => return None,
            Ok(DecodeResult::DataContinue(byte)) => {
                self.overflowed |= self.content.push(byte).is_err();
                return None;
            }
            Ok(DecodeResult::DataComplete) => true,
            Err(_) => false,
        };
        let result = match (self.overflowed, is_valid_cobs) {
            (true, _) => Err(FrameError::TooLong),
            (false, false) => Err(FrameError::Damaged),
            (false, true) => decode(&self.content),
        };
        self.content.clear();
        self.overflowed = false;
        Some(result)
    }
}

/// Decodes sequence number and message from a frame's content.
fn decode<T: DeserializeOwned>(content: &[u8]) -> Result<(u32, T), FrameError> {
    let (message, checksum) = content
        .split_last_chunk::<CHECKSUM_BYTES>()
        .ok_or(FrameError::Damaged)?;
    if crc_32(message) != u32::from_le_bytes(*checksum) {
        return Err(FrameError::Damaged);
    }
    match postcard::take_from_bytes(message) {
        Ok((message, [])) => Ok(message),
        _ => Err(FrameError::Unknown),
    }
}
