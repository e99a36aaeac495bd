//! Replies of the host.

use super::phase::Phase;
use super::{Action, Driver};
use crate::fit::Fitter;
use crate::link::{BYTES_PER_FRAME, Failure, PROTOCOL, RecipeBytes, Refusal, Reply, Request};
use crate::scan::Scan;

impl<K: Fitter> Driver<'_, K> {
    /// Handles the reply to a request.
    pub(super) fn handle_reply(&mut self, request: &Request, reply: Reply, now: u64) {
        match (request, reply) {
            (Request::Failed(_), _) => self.pause(now),
            (Request::Saved { .. }, Reply::Refused(Refusal::Saved)) => {
                self.forget();
                self.begin_scan();
            }
            (Request::Measure { index, .. }, Reply::Refused(Refusal::Directions))
                if self.tolerates_missing() =>
            {
                self.skip_or_fail(*index);
            }
            (_, Reply::Refused(refusal)) => self.fail(Failure::Refused(refusal)),
            (Request::Hello { .. }, Reply::Welcome { protocol }) => self.welcome(protocol),
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
            (_, Reply::Measured { index, reading }) => self.record(index, reading),
            (_, Reply::Skip { index }) => self.skip_or_fail(index),
            (Request::Measure { index, .. }, Reply::FinishEarly) => {
                let finished = self.finish_early();
                finished.unwrap_or_else(|_| self.fail(Failure::ReadingRequired { index: *index }));
            }
            (Request::Values { offset, values, .. }, _) => {
                let count = values.as_slice().len() as u16;
                self.values_sent = offset.saturating_add(count);
            }
            (Request::Finished(_), _) => self.finish(),
            _ => {} // progress, and replies that do not answer the request
        }
    }

    fn welcome(&mut self, host: u16) {
        let device = PROTOCOL;
        match self.config.recipe_bytes {
            _ if host != device => self.fail(Failure::Protocol { device, host }),
            0 => self.begin(),
            _ => self.phase = Phase::Update,
        }
    }

    fn tolerates_missing(&self) -> bool {
        let scan = self.scan.as_ref();
        scan.is_ok_and(|scan| scan.recipe().tolerates_missing())
    }

    fn skip_or_fail(&mut self, index: u16) {
        if self.skip(index).is_err() {
            self.fail(Failure::ReadingRequired { index });
        }
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
            self.fail(Failure::Refused(Refusal::Recipe));
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

    /// Ends the scan, unless a reading was recorded after the values were sent.
    fn finish(&mut self) {
        if let Some(fitted) = self.scan.as_ref().ok().and_then(Scan::fitted) {
            self.next = Some(Action::Finished(fitted.residual()));
            self.phase = Phase::End;
        }
    }
}
