//! Frames: messages with a checksum and delimiters.

use cobs::{CobsEncoder, DecodeResult, DecoderState, max_encoding_length};
use heapless::Vec;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::message::VALUES_PER_FRAME;
use crate::checksum::crc_32;
use crate::error::{Error, ErrorCode};

/// The largest length of a sequence number and a message, in bytes. `Values` is the longest: sequence number (5 bytes),
/// variant (1), offset and total (3 each), number of values (1), and the values (4 each).
const MESSAGE_BYTES: usize = 5 + 1 + 3 + 3 + 1 + 4 * VALUES_PER_FRAME;
/// The length of the CRC in bytes.
const CHECKSUM_BYTES: usize = 4;
/// The largest length of a frame's content before its COBS encoding, in bytes.
const CONTENT_BYTES: usize = MESSAGE_BYTES + CHECKSUM_BYTES;
/// The length of the longest frame in bytes, with the zeros at both ends.
pub const FRAME_BYTES: usize = 1 + max_encoding_length(CONTENT_BYTES) + 1;

/// The error of a frame that is too long.
const TOO_LONG: Error = Error::new(ErrorCode::FrameTooLong);
const DAMAGED: Error = Error::new(ErrorCode::FrameDamaged);

/// Writes the frame of a message into `buffer` and returns the bytes used.
///
/// # Errors
/// [`ErrorCode::FrameTooLong`] if `buffer` is too small. A [`Request`](super::Request) or a [`Reply`](super::Reply) always
/// fits into [`FRAME_BYTES`].
pub fn encode<'b, T: Serialize>(
    sequence: u32,
    message: &T,
    buffer: &'b mut [u8],
) -> Result<&'b [u8], Error> {
    let mut content = [0; MESSAGE_BYTES];
    let content = postcard::to_slice(&(sequence, message), &mut content).map_err(|_| TOO_LONG)?;
    let checksum = crc_32(content).to_le_bytes();

    let (first, rest) = buffer.split_first_mut().ok_or(TOO_LONG)?;
    *first = 0;
    let mut encoder = CobsEncoder::new(rest);
    encoder.push(content).map_err(|_| TOO_LONG)?;
    encoder.push(&checksum).map_err(|_| TOO_LONG)?;
    let end = encoder.finalize().saturating_add(1);
    *buffer.get_mut(end).ok_or(TOO_LONG)? = 0;
    buffer.get(..=end).ok_or(TOO_LONG)
}

/// Returns the CRC in the frame of a message.
pub(super) fn checksum_of<T: Serialize>(sequence: u32, message: &T) -> u32 {
    let mut content = [0; MESSAGE_BYTES];
    let content = postcard::to_slice(&(sequence, message), &mut content);
    content.map_or(0, |content| crc_32(content))
}

/// A decoder that finds frames in a stream of bytes.
#[derive(Debug)]
pub struct FrameReader {
    /// The decoded part of the current frame, with its checksum.
    content: Vec<u8, CONTENT_BYTES>,
    cobs: DecoderState,
    overflowed: bool,
}

impl Default for FrameReader {
    /// Creates a reader that expects the start of a frame.
    fn default() -> Self {
        Self {
            content: Vec::new(),
            cobs: DecoderState::Idle,
            overflowed: false,
        }
    }
}

impl FrameReader {
    /// Receives a byte. At the end of a frame it returns the sequence number and the message, or the error of the
    /// frame. An error does not affect the next frame.
    pub fn push<T: DeserializeOwned>(&mut self, byte: u8) -> Option<Result<(u32, T), Error>> {
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
            (true, _) => Err(TOO_LONG),
            (false, false) => Err(DAMAGED),
            (false, true) => decode(&self.content),
        };
        self.content.clear();
        self.overflowed = false;
        Some(result)
    }
}

/// Decodes sequence number and message from a frame's content.
fn decode<T: DeserializeOwned>(content: &[u8]) -> Result<(u32, T), Error> {
    let (message, checksum) = content
        .split_last_chunk::<CHECKSUM_BYTES>()
        .ok_or(DAMAGED)?;
    if crc_32(message) != u32::from_le_bytes(*checksum) {
        return Err(DAMAGED);
    }
    match postcard::take_from_bytes(message) {
        Ok((message, [])) => Ok(message),
        _ => Err(Error::new(ErrorCode::FrameUnknown)),
    }
}
