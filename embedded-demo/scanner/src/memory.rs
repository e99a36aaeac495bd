//! Memory that survives a reset.

use crate::goniometer::StepCheck;
use crate::store::Store;
use embedded_storage::nor_flash::NorFlash;
use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::gonio::Reading;
use glimpse_core::recipe::Recipe;

/// Memory for the readings of a scan. Readings count once a homing has shown that no steps were lost.
pub trait Memory {
    /// Returns a confirmed reading.
    fn reading(&self, index: u16) -> Option<Reading>;

    /// Saves an unconfirmed reading.
    ///
    /// # Errors
    /// [`ErrorCode::Storage`].
    async fn save(&mut self, index: u16, reading: Reading) -> Result<(), Error>;

    /// Confirms all readings after a homing without lost steps, or else deletes the unconfirmed ones.
    ///
    /// # Errors
    /// [`ErrorCode::Storage`].
    async fn record_homing(&mut self, check: StepCheck) -> Result<(), Error>;

    /// Deletes all readings.
    ///
    /// # Errors
    /// [`ErrorCode::Storage`].
    async fn forget(&mut self) -> Result<(), Error>;
}

/// A flash with a journal of readings.
#[derive(Debug)]
pub struct FlashMemory<F, const SAMPLES: usize> {
    store: Store<F, SAMPLES>,
    scan: (u32, u16),
}

const FAULT: Error = Error::new(ErrorCode::Storage);

impl<F: NorFlash, const SAMPLES: usize> FlashMemory<F, SAMPLES> {
    /// Uses a store for scans with a recipe. Readings of another recipe are deleted.
    ///
    /// # Errors
    /// [`ErrorCode::Storage`].
    pub fn new(mut store: Store<F, SAMPLES>, recipe: &Recipe<'_>) -> Result<Self, Error> {
        let scan = (recipe.checksum(), recipe.samples() as u16);
        if store.scan() != Some(scan) {
            store.begin_scan(scan.0, scan.1).map_err(|_| FAULT)?;
        }
        Ok(Self { store, scan })
    }
}

impl<F: NorFlash, const SAMPLES: usize> Memory for FlashMemory<F, SAMPLES> {
    fn reading(&self, index: u16) -> Option<Reading> {
        self.store.reading(index)
    }

    async fn save(&mut self, index: u16, reading: Reading) -> Result<(), Error> {
        self.store.save(index, reading).map_err(|_| FAULT)
    }

    async fn record_homing(&mut self, check: StepCheck) -> Result<(), Error> {
        self.store.record_homing(check).map_err(|_| FAULT)
    }

    async fn forget(&mut self) -> Result<(), Error> {
        let (checksum, samples) = self.scan;
        self.store.begin_scan(checksum, samples).map_err(|_| FAULT)
    }
}
