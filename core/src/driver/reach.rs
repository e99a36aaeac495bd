//! Check of the machine's reach before any move.

use super::Driver;
use super::phase::Phase;
use crate::error::{Error, ErrorCode};
use crate::fit::ScanModel;

impl<K: ScanModel> Driver<'_, K> {
    /// Begins the readings. It skips samples that are out of reach.
    pub(super) fn begin_scan(&mut self) {
        self.phase = Phase::Scan;
        self.values_sent = 0;
        let scan = match &mut self.scan {
            Ok(scan) => scan,
            Err(error) => {
                let error = *error;
                self.fail_without_scan(error);
                return;
            }
        };
        let (Some(machine), None) = (&self.config.machine, scan.fitted()) else {
            return;
        };
        let recipe = *scan.recipe();
        let mut first = None;
        let mut count: u16 = 0;
        let mut is_tolerated = true;
        for (index, directions) in recipe.directions() {
            if scan.reading(index).is_some() || machine.check(&directions).is_ok() {
                continue;
            }
            first = first.or(Some(index));
            count = count.saturating_add(1);
            is_tolerated &= scan.skip(index).is_ok();
        }
        if let Some(index) = first
            && (!is_tolerated || usize::from(count) == recipe.samples())
        {
            let details = [index.into(), count.into()];
            self.fail(Error::with(ErrorCode::OutOfReach, details));
        }
    }
}
