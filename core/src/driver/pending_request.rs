//! The pending request: its frame, its retransmissions and its timeout.

use super::{Config, Host};
use crate::link::{DeviceEnd, FRAME_BYTES, Reply, Request};

/// A byte after a part of a frame, so that it can never be completed.
const DAMAGING_BYTE: u8 = 0xFF;

/// State of the request after [`PendingRequest::poll`].
pub(super) enum PollResult {
    /// No request is pending.
    Idle,
    /// No reply yet.
    Waiting,
    /// The request and its reply.
    Reply(Request, Reply),
    /// No reply before the timeout.
    TimedOut,
}

/// The state of the current exchange: no request, a request without a reply, or both.
#[derive(Default)]
enum Exchange {
    #[default]
    Idle,
    Waiting(Request),
    Answered(Request, Reply),
}

/// The pending request. There is at most one.
pub(super) struct PendingRequest {
    device: DeviceEnd,
    exchange: Exchange,
    frame: [u8; FRAME_BYTES + 1],
    /// Length of the frame in bytes.
    frame_length: usize,
    /// Number of the frame's bytes that have been sent.
    sent: usize,
    /// True if the line has a part of a canceled frame, and [`DAMAGING_BYTE`] is not sent yet.
    is_line_open: bool,
    /// Interval of retransmissions, in ms.
    interval: u64,
    /// Time of the next retransmission, in ms.
    retransmit_at: u64,
    /// Time of the timeout, in ms; `u64::MAX` for no timeout.
    timeout_at: u64,
}

impl PendingRequest {
    pub(super) fn new(seed: u32) -> Self {
        Self {
            device: DeviceEnd::new(seed),
            exchange: Exchange::Idle,
            frame: [0; FRAME_BYTES + 1],
            frame_length: 0,
            sent: 0,
            is_line_open: false,
            interval: 0,
            retransmit_at: 0,
            timeout_at: u64::MAX,
        }
    }

    /// Begins a request. The driver sends its frame through [`PendingRequest::outgoing`].
    pub(super) fn begin(&mut self, request: Request, now: u64, config: &Config) {
        // The byte after a part of an earlier frame goes first. The buffer has room for it and for every request.
        self.cancel();
        let start = usize::from(self.is_line_open);
        let buffer = self.frame.get_mut(start..).unwrap_or_default();
        let frame = self.device.request(&request, buffer);
        self.frame_length = frame.map_or(0, <[u8]>::len).saturating_add(start);
        self.sent = 0;
        self.interval = config.retransmit_interval_ms.max(1).into();
        self.retransmit_at = now.saturating_add(self.interval);
        self.timeout_at = match &request {
            Request::Hello { .. } if config.host == Host::Measures => u64::MAX,
            Request::Measure { .. } => now.saturating_add(config.measure_timeout_ms.into()),
            _ => now.saturating_add(config.reply_timeout_ms.into()),
        };
        self.exchange = Exchange::Waiting(request);
    }

    /// Drops the request and the unsent rest of its frame, so that no host carries it out later. If a part was sent, one
    /// more byte damages it: a zero alone, such as that of the next frame, may complete it.
    pub(super) fn cancel(&mut self) {
        self.exchange = Exchange::Idle;
        self.is_line_open |= self.sent > 0 && !self.outgoing().is_empty();
        let [first, ..] = &mut self.frame;
        *first = DAMAGING_BYTE;
        self.frame_length = usize::from(self.is_line_open);
        self.sent = 0;
    }

    /// Returns the request if it has no reply yet.
    pub(super) fn request(&self) -> Option<&Request> {
        match &self.exchange {
            Exchange::Waiting(request) => Some(request),
            _ => None,
        }
    }

    /// Receives a byte from the host. Returns true if it completes the reply.
    pub(super) fn receive(&mut self, byte: u8) -> bool {
        if let Exchange::Waiting(request) = &self.exchange
            && let Some(reply) = self.device.receive(byte, request)
        {
            self.exchange = Exchange::Answered(request.clone(), reply);
            return true;
        }
        false
    }

    pub(super) fn outgoing(&self) -> &[u8] {
        self.frame
            .get(self.sent..self.frame_length)
            .unwrap_or_default()
    }

    pub(super) fn sent(&mut self, count: usize) {
        self.sent = self.sent.saturating_add(count).min(self.frame_length);
        self.is_line_open &= self.sent == 0;
    }

    /// Retransmits the frame when it is due, and returns the state of the request.
    pub(super) fn poll(&mut self, now: u64) -> PollResult {
        match core::mem::take(&mut self.exchange) {
            Exchange::Idle => PollResult::Idle,
            Exchange::Answered(request, reply) => PollResult::Reply(request, reply),
            Exchange::Waiting(_) if now >= self.timeout_at => PollResult::TimedOut,
            waiting @ Exchange::Waiting(_) => {
                self.exchange = waiting;
                if now >= self.retransmit_at && self.outgoing().is_empty() {
                    self.sent = 0;
                    self.retransmit_at = self.next_retransmission(now);
                }
                PollResult::Waiting
            }
        }
    }

    /// The time of the next retransmission, in ms. It counts from the scheduled time, so that delays do not accumulate.
    /// Missed retransmissions are skipped.
    fn next_retransmission(&self, now: u64) -> u64 {
        let next = self.retransmit_at.saturating_add(self.interval);
        if next > now {
            next
        } else {
            now.saturating_add(self.interval)
        }
    }

    /// Returns the time of the next retransmission or of the timeout in ms, whichever is earlier. A retransmission is
    /// scheduled only after the whole frame is sent. None if there is neither.
    pub(super) fn next_deadline(&self) -> Option<u64> {
        self.request()?;
        let deadline = match self.outgoing() {
            [] => self.retransmit_at.min(self.timeout_at),
            _ => self.timeout_at,
        };
        (deadline != u64::MAX).then_some(deadline)
    }
}
