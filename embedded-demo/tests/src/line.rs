//! The simulated line, and the host at its other end.

use std::collections::VecDeque;
use std::fmt;
use std::future::pending;

use embassy_time::{Duration, Instant, Timer};
use embedded_io_async::{ErrorKind, ErrorType, Read, Write};
use glimpse_core::error::ErrorCode;
use glimpse_core::link::{FRAME_BYTES, HostEnd, PROTOCOL, Reply, Request};
use glimpse_core::scan::Residual;

use crate::Desk;

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
    /// A framing error every 50 ms, as of a wrong baud rate.
    Breaks,
    /// The line returns what is sent: a jumper, or a terminal with echo.
    Echo,
}

/// A host that listens.
#[derive(Debug, Default)]
pub struct Computer {
    end: HostEnd,
    replies: VecDeque<u8>,
    /// The values of the last scan.
    pub values: Vec<f32>,
    /// The residual of each scan.
    pub finished: Vec<Residual>,
    /// What it prints of each failure.
    pub failures: Vec<String>,
    /// True if it refuses progress.
    pub refuses_progress: bool,
}

/// A framing error.
#[derive(Debug)]
pub struct LineError;

impl fmt::Display for LineError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("line")
    }
}

impl std::error::Error for LineError {}

impl embedded_io_async::Error for LineError {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

impl ErrorType for &Desk {
    type Error = LineError;
}

impl Read for &Desk {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, LineError> {
        match self.line.get() {
            Line::Unplugged => pending().await,
            Line::ReadFails => Err(LineError),
            Line::ReadZero => Ok(0),
            Line::Flood => {
                buffer.fill(0x79);
                Ok(buffer.len())
            }
            Line::Breaks => {
                let next = Instant::now() + Duration::from_millis(50);
                Timer::at(self.next_break.get().unwrap_or(next)).await;
                self.next_break.set(Some(next));
                Err(LineError)
            }
            Line::Host | Line::Echo => {
                while self.host.borrow().replies.is_empty() {
                    Timer::after_millis(1).await;
                }
                let mut host = self.host.borrow_mut();
                let count = buffer.len().min(host.replies.len());
                buffer
                    .iter_mut()
                    .zip(host.replies.drain(..count))
                    .for_each(|(to, byte)| *to = byte);
                Ok(count)
            }
        }
    }
}

impl Write for &Desk {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, LineError> {
        let host = &mut *self.host.borrow_mut();
        match self.line.get() {
            Line::Unplugged => pending().await,
            Line::Echo => host.replies.extend(bytes),
            Line::Host => bytes.iter().for_each(|byte| host.receive(*byte)),
            _ => {}
        }
        Ok(bytes.len())
    }

    async fn flush(&mut self) -> Result<(), LineError> {
        Ok(())
    }
}

impl Computer {
    fn receive(&mut self, byte: u8) {
        let mut buffer = [0; FRAME_BYTES];
        let Self {
            end,
            replies,
            values,
            finished,
            failures,
            refuses_progress,
        } = self;
        let reply = end.answer(byte, &mut buffer, |request| {
            match request {
                Request::Hello { .. } => return Some(Reply::Welcome { protocol: PROTOCOL }),
                Request::Values {
                    offset,
                    values: new,
                    ..
                } => {
                    values.truncate(offset.into());
                    values.extend(&new);
                }
                Request::Progress(_) if *refuses_progress => {
                    return Some(Reply::Refused(ErrorCode::RefusedRequest));
                }
                Request::Finished(residual) => finished.push(residual),
                Request::Failed(report) => failures.push(report.to_string()),
                _ => {}
            }
            Some(Reply::Accepted)
        });
        replies.extend(reply.unwrap_or_default());
    }
}
