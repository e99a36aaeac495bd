//! What follows from a reply.

use super::phase::Phase;
use super::{Action, Driver, Host, PAUSE};
use crate::fit::Fitter;
use crate::heapless::Vec;
use crate::link::{BYTES_PER_FRAME, Failure, PROTOCOL, Refusal, Reply, VALUES_PER_FRAME};
use crate::scan::Scan;

impl<K: Fitter> Driver<'_, K> {
    /// A reply to the last request.
    pub(super) fn understand(&mut self, reply: Reply) {
        match (reply, self.phase) {
            (Reply::Refused(Refusal::Saved), Phase::Offer { .. }) => {
                self.forget();
                self.phase = Phase::Measure;
            }
            (Reply::Refused(_), Phase::Complain(_)) | (Reply::Accepted, Phase::Complain(_)) => {
                self.phase = Phase::Pause { left: PAUSE };
            }
            (Reply::Refused(refusal), _) => self.fail(Failure::Refused(refusal)),
            (Reply::Welcome { protocol: PROTOCOL }, _) => {
                self.phase = match self.config.recipe_bytes {
                    0 => self.begin(),
                    _ => Phase::Update,
                };
            }
            (Reply::Welcome { protocol: host }, _) => {
                let device = PROTOCOL;
                self.fail(Failure::Protocol { device, host });
            }
            (Reply::Measured { index, reading }, _) => self.record(index, reading),
            (Reply::Recipe { bytes, checksum }, _) if self.is_news(bytes, checksum) => {
                self.phase = Phase::Store {
                    offset: 0,
                    bytes,
                    checksum,
                };
            }
            (Reply::RecipePart { offset, bytes }, Phase::Store { .. }) => {
                self.store(offset, bytes);
            }
            (_, Phase::Update) => self.phase = self.begin(),
            (_, Phase::Offer { next }) => {
                self.phase = Phase::Offer {
                    next: next.saturating_add(1),
                };
            }
            (_, Phase::Tell { offset }) => self.told(offset),
            _ => {}
        }
    }

    /// What follows the greeting. A host that only listens cannot tell whether kept readings hold:
    /// the firmware does, by recording them or not.
    pub(super) fn begin(&self) -> Phase {
        match (&self.scan, self.config.host) {
            (Err(failure), _) => Phase::Complain(*failure),
            (Ok(_), Host::Measures) => Phase::Offer { next: 0 },
            (Ok(_), _) => Phase::Measure,
        }
    }

    /// Whether there is room for a recipe, and it is another than the present one and than the one
    /// that did not serve.
    fn is_news(&self, bytes: u32, checksum: u32) -> bool {
        let present = self.scan.as_ref().map(|scan| scan.recipe().checksum());
        let is_other = present != Ok(checksum) && self.declined != Some(checksum);
        (1..=self.config.recipe_bytes).contains(&bytes) && is_other
    }

    /// More of the new recipe.
    fn store(&mut self, at: u32, part: Vec<u8, BYTES_PER_FRAME>) {
        let Phase::Store {
            bytes, checksum, ..
        } = self.phase
        else {
            return;
        };
        // Whole parts, so that flash is written in words.
        let left = bytes.saturating_sub(at) as usize;
        let offset = at.saturating_add(part.len() as u32);
        if part.len() != left.min(BYTES_PER_FRAME) {
            self.fail(Failure::Refused(Refusal::Recipe));
            return;
        }
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

    /// Values were heard, or that the scan is over.
    fn told(&mut self, offset: u16) {
        let fitted = self.scan.as_ref().ok().and_then(Scan::fitted);
        let Some(fitted) = fitted else {
            return;
        };
        let total = fitted.values().count();
        if usize::from(offset) < total {
            let next = usize::from(offset).saturating_add(VALUES_PER_FRAME);
            let offset = next.min(total) as u16;
            self.phase = Phase::Tell { offset };
        } else {
            self.next = Some(Action::Finished(fitted.residual()));
            self.phase = Phase::End;
        }
    }
}
