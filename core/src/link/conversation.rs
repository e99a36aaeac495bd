//! Who said what: sequence numbers, repetitions and late replies.

use super::frame::{FrameError, FrameReader, checksum_of, encode};
use super::message::{Reply, Request};

/// The device's side of the link: asks, and knows the reply when it comes.
#[derive(Debug, Default)]
pub struct Client {
    sequence: u32,
    reader: FrameReader,
}

impl Client {
    /// Nothing was asked yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            sequence: 0,
            reader: FrameReader::new(),
        }
    }

    /// Writes the frame of a new request into `buffer`, under the next sequence number. Until
    /// the reply comes the same frame may be sent again and again.
    ///
    /// # Errors
    /// [`FrameError::TooLong`] if `buffer` has fewer than [`FRAME_BYTES`](super::FRAME_BYTES).
    pub fn ask<'b>(
        &mut self,
        request: &Request,
        buffer: &'b mut [u8],
    ) -> Result<&'b [u8], FrameError> {
        self.sequence = self.sequence.wrapping_add(1);
        encode(self.sequence, request, buffer)
    }

    /// Takes a byte; returns the reply to `request`, the last one asked, once it is whole.
    /// Damaged frames and replies to anything else are dropped.
    pub fn receive(&mut self, byte: u8, request: &Request) -> Option<Reply> {
        match self.reader.push::<Reply>(byte)? {
            Ok((sequence, reply)) if sequence == self.sequence && reply.answers(request) => {
                Some(reply)
            }
            _ => None,
        }
    }
}

/// What the host received.
#[derive(Clone, Debug, PartialEq)]
pub enum Received {
    /// A request that was not received before.
    New(Request),
    /// The last request once more, and how it was answered: that reply was lost or is late.
    Duplicate(Reply),
    /// The last request once more, which is not answered yet: what it asks for is under way, and the
    /// device is only being patient.
    Pending,
}

/// The host's side of the link: hears requests, and answers a repeated one as it did before.
#[derive(Debug, Default)]
pub struct Server {
    reader: FrameReader,
    sequence: u32,
    /// The CRC of the last request.
    request: u32,
    /// How it was answered; None before it is.
    reply: Option<Reply>,
    /// A request was received.
    has_received: bool,
}

impl Server {
    /// Nothing was received yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            reader: FrameReader::new(),
            sequence: 0,
            request: 0,
            reply: None,
            has_received: false,
        }
    }

    /// Takes a byte; returns what was received once a frame is whole, or what is wrong with the
    /// frame. A wrong frame needs no answer: the device will ask again.
    pub fn receive(&mut self, byte: u8) -> Option<Result<Received, FrameError>> {
        let (sequence, request) = match self.reader.push::<Request>(byte)? {
            Ok(heard) => heard,
            Err(error) => return Some(Err(error)),
        };
        // What it says is compared too: a device that was reset counts from the start again, and
        // may have been given another recipe.
        let checksum = checksum_of(sequence, &request);
        if self.has_received && sequence == self.sequence && checksum == self.request {
            return Some(Ok(self
                .reply
                .clone()
                .map_or(Received::Pending, Received::Duplicate)));
        }
        self.sequence = sequence;
        self.request = checksum;
        self.reply = None;
        self.has_received = true;
        Some(Ok(Received::New(request)))
    }

    /// Writes the frame of the reply to the last request into `buffer`.
    ///
    /// # Errors
    /// [`FrameError::TooLong`] if `buffer` has fewer than [`FRAME_BYTES`](super::FRAME_BYTES).
    pub fn answer<'b>(
        &mut self,
        reply: Reply,
        buffer: &'b mut [u8],
    ) -> Result<&'b [u8], FrameError> {
        let frame = encode(self.sequence, &reply, buffer);
        self.reply = Some(reply);
        frame
    }
}
