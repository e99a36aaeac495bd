//! Replies of the host, and their absence.

use super::phase::Phase;
use super::{Action, Driver, Host};
use crate::error::{Error, ErrorCode};
use crate::fit::ScanModel;
use crate::link::{BYTES_PER_FRAME, PROTOCOL, RecipeBytes, Reply, Request};

impl<K: ScanModel> Driver<'_, K> {
    /// Handles the reply to a request.
    pub(super) fn handle_reply(&mut self, request: &Request, reply: Reply, now: u64) {
        self.is_connected = true;
        match (request, reply) {
            (Request::Failed(_), _) => self.phase = self.phase_after_failure(),
            (Request::Saved { .. }, Reply::Refused(ErrorCode::RefusedSaved)) => {
                self.reset_scan();
                self.begin_scan();
            }
            (Request::Measure { index, .. }, Reply::Refused(ErrorCode::RefusedDirections))
                if self.tolerates_missing() =>
            {
                self.skip_or_fail(*index);
            }
            // A host that only listens was restarted. It receives the result after another hello.
            (
                Request::Progress(_) | Request::Values { .. } | Request::Finished(_),
                Reply::Refused(ErrorCode::RefusedNoScan),
            ) if self.config.host == Host::Listens => self.is_connected = false,
            (_, Reply::Refused(code)) => self.fail(refused(code)),
            (Request::Hello { .. }, Reply::Welcome { protocol }) => self.welcome(protocol, now),
            (Request::Update, Reply::Recipe { bytes, checksum })
                if self.is_new_recipe(bytes, checksum) =>
            {
                self.phase = Phase::Store {
                    offset: 0,
                    bytes,
                    checksum,
                };
            }
            (Request::Update, _) => self.begin(),
            (
                _,
                Reply::RecipePart {
                    offset,
                    bytes: part,
                },
            ) => {
                if let Phase::Store {
                    bytes, checksum, ..
                } = self.phase
                {
                    self.store(offset, part, bytes, checksum);
                }
            }
            (Request::Saved { index, .. }, _) => {
                self.phase = Phase::Offer {
                    next: index.saturating_add(1),
                };
            }
            (_, Reply::Measured { index, reading }) => {
                // After an invalid reading, the driver requests the sample again, skips it, or has failed.
                let _ = self.record(index, reading);
            }
            (_, Reply::Skip { index }) => self.skip_or_fail(index),
            (_, Reply::FinishEarly) => {
                self.finish_early().unwrap_or_else(|error| self.fail(error));
            }
            (Request::Values { offset, values, .. }, _) => {
                let count = values.len() as u16;
                self.values_sent = offset.saturating_add(count);
            }
            (Request::Finished(_), _) => {
                self.pause.reset();
                self.phase = Phase::Published;
            }
            _ => {} // progress, and replies that do not answer the request
        }
    }

    /// Handles a request without a reply. A host that listens is optional; one that measures is not.
    pub(super) fn handle_timeout(&mut self, request: &Request) {
        match (self.config.host, request) {
            // The host may appear later. A device without a scan asks it for a recipe first.
            (_, Request::Failed(_)) if self.scan.is_ok() && self.is_halted => {
                self.report_pause.lengthen();
            }
            (_, Request::Failed(_)) => self.phase = self.phase_after_failure(),
            (Host::Listens, Request::RecipePart { .. }) => {
                self.is_connected = false;
                self.fetch_pause.lengthen();
                self.begin_scan();
            }
            (Host::Listens, Request::Hello { .. } | Request::Update) => {
                self.is_connected = false;
                self.begin_scan();
            }
            (Host::Listens, _) => self.is_connected = false,
            (Host::Measures | Host::Absent, _) => self.fail(Error::new(ErrorCode::NoReply)),
        }
    }

    fn welcome(&mut self, host: u16, now: u64) {
        if host != PROTOCOL {
            let details = [PROTOCOL.into(), host.into()];
            self.fail(Error::with(ErrorCode::Protocol, details));
            return;
        }
        // A result is sent before another recipe replaces its scan.
        let may_fetch = self.config.recipe_bytes > 0 && !self.is_finished;
        match may_fetch && self.fetch_pause.end(now).is_none() {
            true => self.phase = Phase::Update,
            false => self.begin(),
        }
    }

    fn tolerates_missing(&self) -> bool {
        let scan = self.scan.as_ref();
        scan.is_ok_and(|scan| scan.recipe().tolerates_missing())
    }

    fn skip_or_fail(&mut self, index: u16) {
        self.skip(index).unwrap_or_else(|error| self.fail(error));
    }

    /// Returns true if a recipe fits into the storage, differs from the current one, and was not declined.
    fn is_new_recipe(&self, bytes: u32, checksum: u32) -> bool {
        let current = self.scan.as_ref().map(|scan| scan.recipe().checksum());
        let is_other = current != Ok(checksum) && self.declined != Some(checksum);
        (1..=self.config.recipe_bytes).contains(&bytes) && is_other
    }

    /// Stores a part of the new recipe. The whole recipe has `bytes` bytes.
    fn store(&mut self, at: u32, part: RecipeBytes, bytes: u32, checksum: u32) {
        // Only the last part may be shorter, so that flash is written in whole words.
        let length = part.as_slice().len();
        let left = bytes.saturating_sub(at) as usize;
        if length != left.min(BYTES_PER_FRAME) {
            self.fail(refused(ErrorCode::RefusedRecipe));
            return;
        }
        let offset = at.saturating_add(length as u32);
        self.next = Some(Action::Store {
            offset: at,
            bytes: part,
        });
        self.phase = match offset == bytes {
            true => Phase::Stored { bytes, checksum },
            false => Phase::Store {
                offset,
                bytes,
                checksum,
            },
        };
    }
}

/// Returns the error of a refusal. Its detail is the number, as in protocol 6.
fn refused(code: ErrorCode) -> Error {
    Error::with(code, [code.number().into(), 0])
}
