//! The link between a device and its scanner, free of I/O and of time.
//!
//! The device leads, stop and wait: it sends a [`Request`], again and again until the [`Reply`] with
//! the same sequence number comes; only then does it send the next. Every request may be repeated:
//! the host answers a repetition with the reply it gave before. Lost, damaged, cut, repeated and
//! invented bytes therefore cost time and nothing else.
//!
//! The protocol is written down in `core/docs/link.md`: frames, messages, times, a scan from hello to
//! end, and four frames in bytes.
//!
//! | request | reply |
//! |---|---|
//! | [`Request::Hello`] begins a scan | [`Reply::Welcome`] |
//! | [`Request::Saved`], for each reading that outlasted a reset of the device | [`Reply::Accepted`] |
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
//! [`Client`] is the device's side and [`Server`] the host's; both take bytes one by one. A
//! [`Driver`](crate::driver::Driver) is a whole device; `examples/host.rs` is both ends.
//!
//! ```
//! use glimpse_core::link::{Server, Client, FRAME_BYTES, Received, Reply, Request};
//!
//! let (mut device, mut host) = (Client::new(), Server::new());
//! let (mut request, mut reply) = ([0; FRAME_BYTES], [0; FRAME_BYTES]);
//!
//! let frame = device.ask(&Request::Update, &mut request)?;
//! for byte in frame {
//!     match host.receive(*byte) {
//!         None => {} // there is more to come
//!         Some(Ok(Received::New(heard))) => assert_eq!(heard, Request::Update),
//!         Some(Ok(Received::Duplicate(_) | Received::Pending)) => unreachable!("it was said once"),
//!         Some(Err(error)) => println!("{error}"), // the device will say it again
//!     }
//! }
//! let frame = host.answer(Reply::Accepted, &mut reply)?;
//! let mut heard = frame.iter().filter_map(|byte| device.receive(*byte, &Request::Update));
//! assert_eq!(heard.next(), Some(Reply::Accepted));
//! # Ok::<(), glimpse_core::link::FrameError>(())
//! ```

mod conversation;
mod frame;
mod message;

pub use conversation::{Client, Received, Server};
pub use frame::{FRAME_BYTES, FrameError, FrameReader, encode};
pub use message::{BYTES_PER_FRAME, Failure, PROTOCOL, Refusal, Reply, Request, VALUES_PER_FRAME};
