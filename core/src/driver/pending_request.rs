//! The pending request: its frame, its retransmissions and its timeout.

use super::Config;
use crate::link::{Client, FRAME_BYTES, Reply, Request};

/// State of the request after [`PendingRequest::poll`].
pub(super) enum PollResult {
    /// No request is pending.
    Free,
    /// No reply yet.
    Waiting,
    /// The request and its reply.
    Reply(Request, Reply),
    /// No reply to this request before its timeout.
    TimedOut(Request),
}

/// A request and the progress of its exchange.
#[derive(Default)]
enum Exchange {
    #[default]
    Free,
    Waiting(Request),
    Answered(Request, Reply),
}

/// The only request that can be pending at a time.
pub(super) struct PendingRequest {
    client: Client,
    exchange: Exchange,
    frame: [u8; FRAME_BYTES],
    /// Length of the frame.
    end: usize,
    /// Number of its bytes that are sent.
    sent: usize,
    /// Time of the next retransmission, in ms.
    retransmit_at: u64,
    /// Time of the timeout, in ms; `u64::MAX` for no timeout.
    timeout_at: u64,
}

impl PendingRequest {
    pub(super) const fn new(seed: u32) -> Self {
        Self {
            client: Client::new(seed),
            exchange: Exchange::Free,
            frame: [0; FRAME_BYTES],
            end: 0,
            sent: 0,
            retransmit_at: 0,
            timeout_at: u64::MAX,
        }
    }

    /// Begins a request. The driver sends its frame through [`PendingRequest::outgoing`].
    pub(super) fn begin(&mut self, request: Request, now: u64, config: &Config) {
        // The buffer has room for every request.
        let frame = self.client.request(&request, &mut self.frame);
        self.end = frame.map_or(0, <[u8]>::len);
        self.sent = 0;
        self.retransmit_at = now.saturating_add(config.retransmit_interval_ms.into());
        self.timeout_at = match &request {
            Request::Hello { .. } => u64::MAX,
            Request::Measure { .. } => now.saturating_add(config.measure_timeout_ms.into()),
            _ => now.saturating_add(config.reply_timeout_ms.into()),
        };
        self.exchange = Exchange::Waiting(request);
    }

    /// Drops the request. A partly sent frame is still sent to its end: otherwise the host would wait for the rest.
    pub(super) fn cancel(&mut self) {
        self.exchange = Exchange::Free;
        if self.sent == 0 {
            self.end = 0;
        }
    }

    /// The request that waits for its reply.
    pub(super) fn request(&self) -> Option<&Request> {
        match &self.exchange {
            Exchange::Waiting(request) => Some(request),
            _ => None,
        }
    }

    /// Receives a byte from the host. Returns true if it completes the reply.
    pub(super) fn receive(&mut self, byte: u8) -> bool {
        if let Exchange::Waiting(request) = &self.exchange
            && let Some(reply) = self.client.receive(byte, request)
        {
            self.exchange = Exchange::Answered(request.clone(), reply);
            return true;
        }
        false
    }

    pub(super) fn outgoing(&self) -> &[u8] {
        self.frame.get(self.sent..self.end).unwrap_or_default()
    }

    pub(super) fn sent(&mut self, count: usize) {
        self.sent = self.sent.saturating_add(count).min(self.end);
    }

    /// Retransmits the frame when it is due, and returns the state of the request.
    pub(super) fn poll(&mut self, now: u64, config: &Config) -> PollResult {
        match core::mem::take(&mut self.exchange) {
            Exchange::Free => PollResult::Free,
            Exchange::Answered(request, reply) => PollResult::Reply(request, reply),
            Exchange::Waiting(request) if now >= self.timeout_at => PollResult::TimedOut(request),
            waiting @ Exchange::Waiting(_) => {
                self.exchange = waiting;
                if now >= self.retransmit_at && self.outgoing().is_empty() {
                    self.sent = 0;
                    self.retransmit_at = self.next_retransmission(now, config);
                }
                PollResult::Waiting
            }
        }
    }

    /// The time of the next retransmission, in ms. It counts from the scheduled time, so that delays do not accumulate.
    /// Missed retransmissions are skipped.
    fn next_retransmission(&self, now: u64, config: &Config) -> u64 {
        let interval = config.retransmit_interval_ms.max(1).into();
        let next = self.retransmit_at.saturating_add(interval);
        if next > now {
            next
        } else {
            now.saturating_add(interval)
        }
    }

    /// Time of the next retransmission or of the timeout, in ms. An unsent frame has no retransmission. None if no time
    /// is due.
    pub(super) fn due(&self) -> Option<u64> {
        self.request()?;
        let due = match self.outgoing() {
            [] => self.retransmit_at.min(self.timeout_at),
            _ => self.timeout_at,
        };
        (due != u64::MAX).then_some(due)
    }
}
