//! The link between a device and its host, without I/O and without a clock.
//!
//! The protocol is stop-and-wait, and the device controls it. The device sends a [`Request`], and retransmits it until
//! the [`Reply`] with the same sequence number arrives. Then it sends the next request. A host answers a repeated
//! request with the same reply as before. Lost, damaged, cut, repeated and spurious bytes therefore only cost time.
//!
//! The document [`docs/link.md`](https://docs.rs/crate/glimpse-core/latest/source/docs/link.md) specifies frames,
//! messages, timeouts, a scan from `Hello` to its end, and error codes, with examples in bytes.
//!
//! | request | reply |
//! |---|---|
//! | [`Request::Hello`] begins a scan | [`Reply::Welcome`] |
//! | [`Request::Restored`], for each reading that survived a reset of the device | [`Reply::Accepted`] |
//! | [`Request::Measure`], for each reading | [`Reply::Measured`], [`Reply::Skip`] or [`Reply::FinishEarly`] |
//! | [`Request::Progress`], after each slice of the fit | [`Reply::Accepted`] |
//! | [`Request::Values`], until all values are sent | [`Reply::Accepted`] |
//! | [`Request::Finished`] ends the scan | [`Reply::Accepted`] |
//! | [`Request::Failed`], at any time: the device ends the scan with a failure | [`Reply::Accepted`] |
//!
//! A host may refuse any request with [`Reply::Refused`].
//!
//! [`DeviceEnd`] and [`HostEnd`] are its two ends; both receive bytes one by one. A
//! [`Driver`](crate::driver::Driver) is a complete device. `examples/host.rs` implements both ends.
//!
//! ```
//! use glimpse_core::error::{Error, ErrorCode};
//! use glimpse_core::link::{DeviceEnd, FRAME_BYTES, Reply, Request, HostEnd};
//!
//! let (mut device, mut host) = (DeviceEnd::new(0), HostEnd::default());
//! let (mut request, mut reply) = ([0; FRAME_BYTES], [0; FRAME_BYTES]);
//!
//! let failed = Request::Failed(Error::new(ErrorCode::Machine));
//! for byte in device.request(&failed, &mut request)? {
//!     // None before the end of the frame.
//!     if let Some(frame) = host.answer(*byte, &mut reply, |_| Some(Reply::Accepted)) {
//!         let mut replies = frame.iter().filter_map(|byte| device.receive(*byte, &failed));
//!         assert_eq!(replies.next(), Some(Reply::Accepted));
//!     }
//! }
//! # Ok::<(), Error>(())
//! ```

mod conversation;
mod frame;
mod message;

pub use conversation::{DeviceEnd, HostEnd, Received};
pub use frame::{FRAME_BYTES, FrameReader, encode};
pub use message::{PROTOCOL, Purpose, Reply, Request, VALUES_PER_FRAME, Values};
