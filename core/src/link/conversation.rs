//! The ends of a link: sequence numbers, repeated requests and late replies.

use super::frame::{FRAME_BYTES, FrameReader, checksum_of, encode};
use super::message::{Reply, Request};
use crate::error::Error;

/// The distance between the first sequence numbers of consecutive seeds: 2^32 divided by the golden ratio. It keeps the
/// numbers of consecutive seeds far apart.
const SEED_STEP: u32 = 0x9E37_79B1;

/// The device's side of the link. It sends requests and recognizes their replies.
#[derive(Debug, Default)]
pub struct DeviceEnd {
    sequence: u32,
    reader: FrameReader,
}

impl DeviceEnd {
    /// Creates an end whose first sequence number depends on the seed.
    ///
    /// A late reply from before a reset has an old sequence number. It drops the reply only if it has not used
    /// this number again. Therefore, give every end of a device a different seed: a boot counter, a random number,
    /// or the value of a free-running timer. With a boot counter, the numbers of 1,000 boots are more than a million
    /// requests apart. With random seeds, one in 4 billion requests has an old number. With a constant seed, the device
    /// may accept a late reply as the reply to a new request with the same number, if both requests are of the same
    /// kind.
    #[must_use]
    pub fn new(seed: u32) -> Self {
        Self {
            sequence: seed.wrapping_mul(SEED_STEP),
            reader: FrameReader::default(),
        }
    }

    /// Writes the frame of a new request into `buffer`, with the next sequence number. Retransmit this frame until the
    /// reply arrives.
    ///
    /// # Errors
    /// [`ErrorCode::FrameTooLong`](crate::error::ErrorCode::FrameTooLong) if the frame does not fit into `buffer`.
    /// [`FRAME_BYTES`] suffice.
    pub fn request<'b>(
        &mut self,
        request: &Request,
        buffer: &'b mut [u8],
    ) -> Result<&'b [u8], Error> {
        self.sequence = self.sequence.wrapping_add(1);
        encode(self.sequence, request, buffer)
    }

    /// Receives a byte. Returns the reply when it is complete. `request` must be the last request sent. Drops damaged
    /// frames and replies to other requests.
    pub fn receive(&mut self, byte: u8, request: &Request) -> Option<Reply> {
        match self.reader.push::<Reply>(byte)? {
            Ok((sequence, reply)) if sequence == self.sequence && reply.answers(request) => {
                Some(reply)
            }
            _ => None,
        }
    }
}

/// A request that the host received.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Received {
    /// A request that was not received before.
    New(Request),
    /// The last request again, and its reply. The first copy of the reply is lost or late.
    Duplicate(Reply),
    /// The last request again. It has no reply yet, because the host is still working on it.
    Pending,
}

/// The host's side of the link. It receives requests, and answers a repeated request with the same reply.
#[derive(Debug, Default)]
pub struct HostEnd {
    reader: FrameReader,
    /// The sequence number and the CRC of the last request.
    request: Option<(u32, u32)>,
    /// The reply to the last request, if there is one yet.
    reply: Option<Reply>,
}

impl HostEnd {
    /// Receives a byte. At the end of a request, it writes the frame to send into `buffer`: the reply of `respond`, or to
    /// a repeated request the same reply again. Without a reply the request is pending until [`reply`](Self::reply).
    pub fn answer<'b>(
        &mut self,
        byte: u8,
        buffer: &'b mut [u8; FRAME_BYTES],
        respond: impl FnOnce(Request) -> Option<Reply>,
    ) -> Option<&'b [u8]> {
        let reply = match self.receive(byte)? {
            Ok(Received::New(request)) => respond(request)?,
            Ok(Received::Duplicate(reply)) => reply,
            // The host is still working on it, or it is damaged and the device repeats it.
            Ok(Received::Pending) | Err(_) => return None,
        };
        self.reply(reply, buffer).ok()
    }

    /// Receives a byte. At the end of a frame, it returns the request, or the error of the frame. An invalid frame
    /// needs no reply: the device sends it again.
    pub fn receive(&mut self, byte: u8) -> Option<Result<Received, Error>> {
        let (sequence, request) = match self.reader.push::<Request>(byte)? {
            Ok(received) => received,
            Err(error) => return Some(Err(error)),
        };
        // The message is compared too: a device without a source of seeds repeats its sequence numbers after a reset.
        // A request with an old number may then be a different one, for example `Hello` with another recipe.
        let received = Some((sequence, checksum_of(sequence, &request)));
        if received == self.request {
            let reply = self.reply.clone();
            return Some(Ok(reply.map_or(Received::Pending, Received::Duplicate)));
        }
        (self.request, self.reply) = (received, None);
        Some(Ok(Received::New(request)))
    }

    /// Writes the frame of the reply to the last request into `buffer`.
    ///
    /// # Errors
    /// [`ErrorCode::FrameTooLong`](crate::error::ErrorCode::FrameTooLong) if the frame does not fit into `buffer`.
    /// [`FRAME_BYTES`] suffice.
    pub fn reply<'b>(&mut self, reply: Reply, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        let (sequence, _) = self.request.unwrap_or_default();
        let frame = encode(sequence, &reply, buffer);
        self.reply = Some(reply);
        frame
    }
}
