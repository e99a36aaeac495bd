//! A request on its way, until its reply comes.

use crate::link::{Client, FRAME_BYTES, Reply, Request};

/// What has come of a request.
pub(super) enum News {
    /// Nothing yet; in so many milliseconds it is sent again, or there is silence.
    None { milliseconds: u32 },
    /// Its reply.
    Reply(Reply),
    /// No reply for too long.
    Silence,
    /// Nothing was asked.
    Free,
}

/// A request and its frame.
pub(super) struct Line {
    asker: Client,
    request: Option<Request>,
    reply: Option<Reply>,
    frame: [u8; FRAME_BYTES],
    /// Where the frame ends, and how much of it is sent.
    end: usize,
    sent: usize,
    /// Milliseconds since the request was asked, and since it was sent last.
    waited: u32,
    since_sent: u32,
}

impl Line {
    pub(super) const fn new() -> Self {
        Self {
            asker: Client::new(),
            request: None,
            reply: None,
            frame: [0; FRAME_BYTES],
            end: 0,
            sent: 0,
            waited: 0,
            since_sent: 0,
        }
    }

    /// Asks; the frame waits to be sent.
    pub(super) fn ask(&mut self, request: Request) {
        // The buffer has room for every request.
        let frame = self.asker.ask(&request, &mut self.frame);
        self.end = frame.map_or(0, <[u8]>::len);
        self.sent = 0;
        self.waited = 0;
        self.since_sent = 0;
        self.reply = None;
        self.request = Some(request);
    }

    /// Waits for no reply any more.
    pub(super) fn hang_up(&mut self) {
        self.request = None;
        self.reply = None;
        // A frame that is cut short is known by its checksum, but costs the host's patience.
        if self.sent == 0 {
            self.end = 0;
        }
    }

    pub(super) fn receive(&mut self, byte: u8) {
        if let Some(request) = &self.request
            && let Some(reply) = self.asker.receive(byte, request)
        {
            self.reply = Some(reply);
        }
    }

    pub(super) fn outgoing(&self) -> &[u8] {
        self.frame.get(self.sent..self.end).unwrap_or_default()
    }

    pub(super) fn sent(&mut self, count: usize) {
        self.sent = self.sent.saturating_add(count).min(self.end);
    }

    /// What has come, `elapsed` milliseconds after the last call.
    pub(super) fn news(&mut self, elapsed: u32, repeat: u32, patience: u32) -> News {
        if self.request.is_none() {
            return News::Free;
        }
        if let Some(reply) = self.reply.take() {
            self.request = None;
            return News::Reply(reply);
        }
        self.waited = self.waited.saturating_add(elapsed);
        self.since_sent = self.since_sent.saturating_add(elapsed);
        if self.waited >= patience && patience != u32::MAX {
            self.request = None;
            return News::Silence;
        }
        if self.since_sent >= repeat && self.outgoing().is_empty() {
            // From when it was due, not from now: so that lateness does not add up.
            let late = self.since_sent.saturating_sub(repeat);
            self.since_sent = if late < repeat { late } else { 0 };
            self.sent = 0;
        }
        let repeated = repeat.saturating_sub(self.since_sent);
        let silent = match patience {
            u32::MAX => u32::MAX,
            some => some.saturating_sub(self.waited),
        };
        News::None {
            milliseconds: repeated.min(silent),
        }
    }
}
