//! The order of a scan's readings: its samples, between readings that check lamp, room light and drift.

use crate::fit::ScanModel;
use crate::geometry::Directions;
use crate::gonio::Reading;
use crate::link::Purpose;
use crate::scan::{Evidence, EvidenceLimits, Scan};

/// The next kind of readings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Stage {
    #[default]
    DarkBefore,
    Samples,
    Again,
    DarkAfter,
    Complete,
}

/// The readings that check a scan.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Proof {
    stage: Stage,
    /// The first unsaturated reading since the driver was created.
    first: Option<(u16, Reading)>,
    /// The largest channel with the lamp off, sr^-1.
    dark: Option<f32>,
    drift: Option<f32>,
    /// Number of readings from before the driver was created.
    restored: u16,
}

impl Proof {
    pub(super) fn new(restored: u16) -> Self {
        Self {
            restored,
            ..Self::default()
        }
    }

    /// Returns the next reading: its purpose, and the index and the directions of a sample. None after the last one.
    pub(super) fn next<K: ScanModel>(
        &mut self,
        scan: &Scan<'_, K>,
        limits: EvidenceLimits,
    ) -> Option<(Purpose, u16, Directions<f32>)> {
        loop {
            let (is_due, purpose, sample) = match self.stage {
                Stage::DarkBefore => (limits.dark > 0.0, Purpose::Dark, scan.next_pending()),
                Stage::Samples => (true, Purpose::Sample, scan.next_pending()),
                Stage::Again => (limits.drift > 0.0, Purpose::Again, self.first_sample(scan)),
                Stage::DarkAfter => (limits.dark > 0.0, Purpose::Dark, self.first_sample(scan)),
                Stage::Complete => return None,
            };
            match sample {
                Some((index, directions)) if is_due => return Some((purpose, index, directions)),
                _ => self.advance(),
            }
        }
    }

    fn first_sample<K: ScanModel>(&self, scan: &Scan<'_, K>) -> Option<(u16, Directions<f32>)> {
        let (first, _) = self
            .first
            .filter(|(index, _)| scan.reading(*index).is_some())?;
        scan.recipe()
            .directions()
            .find(|(index, _)| *index == first)
    }

    /// Goes on without the reading that is due, or after it.
    pub(super) fn advance(&mut self) {
        self.stage = match self.stage {
            Stage::DarkBefore => Stage::Samples,
            Stage::Samples => Stage::Again,
            Stage::Again => Stage::DarkAfter,
            Stage::DarkAfter | Stage::Complete => Stage::Complete,
        };
    }

    /// Records the reading of a sample.
    pub(super) fn record_sample(&mut self, index: u16, reading: Reading) {
        if self.first.is_none_or(|(first, _)| first == index) && !reading.saturated {
            self.first = Some((index, reading));
        }
    }

    /// Records the reading that is due, which is not that of a pending sample. `mean` is the mean reading of the samples.
    pub(super) fn record(&mut self, reading: Reading, mean: f32) {
        let largest = |values: [f32; 3]| match reading.saturated {
            true => f32::INFINITY,
            false => values
                .into_iter()
                .fold(0.0, |a, b| if a > b { a } else { b }),
        };
        match (self.stage, self.first) {
            (Stage::Again, Some((_, first))) => {
                let mut changes = first.brdf.into_iter().zip(reading.brdf);
                let least = 0.1 * mean;
                let change = |(a, b): (f32, f32)| (b - a).abs() / if a > least { a } else { least };
                self.drift = Some(largest(
                    [(); 3].map(|()| changes.next().map_or(0.0, change)),
                ));
            }
            _ => {
                let dark = largest(reading.brdf.map(f32::abs));
                self.dark = self.dark.filter(|before| *before > dark).or(Some(dark));
            }
        }
        self.advance();
    }

    /// Returns the evidence of a scan with this mean reading.
    pub(super) fn evidence(&self, mean: f32) -> Evidence {
        Evidence {
            dark: self.dark.map(|dark| dark / mean),
            drift: self.drift,
            restored: self.restored,
        }
    }
}
