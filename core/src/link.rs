//! The link between a device and its scanner, free of I/O and of time.
//!
//! The device leads, stop and wait: it sends a [`Request`] and waits for the [`Reply`] with the
//! same sequence number; only then does it send the next. If nothing comes in time it sends the
//! same frame again. Every request may be repeated: the host answers a repetition with the reply
//! it gave before, and a reply that comes late or twice is known by its sequence number and
//! dropped. Lost, damaged, cut, repeated and invented bytes therefore cost time and nothing else.
//!
//! | request | reply |
//! |---|---|
//! | [`Request::Hello`] begins a scan | [`Reply::Welcome`] |
//! | [`Request::Kept`], for each reading that outlasted a reset of the device | [`Reply::Accepted`] |
//! | [`Request::Measure`], for each sample of the recipe's pattern | [`Reply::Measured`] |
//! | [`Request::Progress`], after each slice of the fit | [`Reply::Accepted`] |
//! | [`Request::Values`], until all are told | [`Reply::Accepted`] |
//! | [`Request::Finished`] ends the scan | [`Reply::Accepted`] |
//! | [`Request::Update`], after the hello of a device that can store a recipe | [`Reply::Recipe`] or [`Reply::Accepted`] |
//! | [`Request::RecipePart`], until it has all of it | [`Reply::RecipePart`] |
//! | [`Request::Failed`], any time: the device gives up and begins anew | [`Reply::Accepted`] |
//!
//! Any request may be answered by [`Reply::Refused`] too.
//!
//! A device that was reset in the middle of a scan may have kept what was measured. It cannot know
//! whether the material is still the same, so it asks: a host that knows of a scan by the same
//! recipe, in which it gave that very measurement, accepts it. If it refuses one the device measures
//! all of them again. A host that knows nothing of this refuses always, and loses nothing but time.
//!
//! # Frames
//!
//! ```text
//! 0x00  COBS( postcard( sequence: u32, message )  CRC-32 )  0x00
//! ```
//!
//! The CRC is ISO-HDLC over the postcard bytes, little-endian. COBS leaves no zero inside, so a
//! zero always ends a frame: a reader finds its place again at the next one, and the zero in
//! front keeps a frame apart from noise before it. A frame has at most [`FRAME_BYTES`].
//!
//! [`Asker`] is the device's side and [`Answerer`] the host's; both take bytes one by one.

mod conversation;
mod frame;
mod message;

pub use conversation::{Answerer, Asker, Heard};
pub use frame::{FRAME_BYTES, FrameError, FrameReader, encode};
pub use message::{BYTES_PER_FRAME, Failure, PROTOCOL, Refusal, Reply, Request, VALUES_PER_FRAME};
