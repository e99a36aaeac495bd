//! The simulated line, and the host at its other end.

use std::collections::VecDeque;

use glimpse_core::error::Error;
use glimpse_core::link::{FRAME_BYTES, HostEnd, PROTOCOL, Reply, Request};
use glimpse_core::scan::Residual;

/// The state of the line.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Line {
    /// A host that listens.
    Host,
    /// Nobody reads: writes and reads wait for ever, as of a USB port without a terminal.
    Unplugged,
    /// Reads fail at once, writes are accepted.
    ReadFails,
    /// Reads return 0 bytes at once.
    ReadZero,
    /// More bytes are always there.
    Flood,
    /// The line returns what is sent: a jumper, or a terminal with echo.
    Echo,
}

/// A host that listens.
#[derive(Debug, Default)]
pub struct Computer {
    end: HostEnd,
    pub(crate) replies: VecDeque<u8>,
    /// The residual of each scan.
    pub finished: Vec<Residual>,
    /// Each failure.
    pub failures: Vec<Error>,
}

impl Computer {
    pub(crate) fn receive(&mut self, bytes: &[u8]) {
        for byte in bytes {
            let mut buffer = [0; FRAME_BYTES];
            let reply = self.end.answer(*byte, &mut buffer, |request| {
                match request {
                    Request::Hello { .. } => return Some(Reply::Welcome { protocol: PROTOCOL }),
                    Request::Finished(residual) => self.finished.push(residual),
                    Request::Failed(error) => self.failures.push(error),
                    _ => {}
                }
                Some(Reply::Accepted)
            });
            self.replies.extend(reply.unwrap_or_default());
        }
    }
}
