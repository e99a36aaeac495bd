//! A color sensor TCS3472 on an I2C bus, with a lens that sees the measured spot only.

use embassy_time::{Duration, Timer};
use embedded_hal_async::i2c::I2c;
use glimpse_core::error::{Error, ErrorCode};

use crate::optics::{Counts, Sensor};

const ADDRESS: u8 = 0x29;
/// The bit that marks a byte as a register's number; later bytes continue with the next registers.
const REGISTER: u8 = 0xA0;
const ENABLE: u8 = 0x00;
const INTEGRATION_TIME: u8 = 0x01;
const GAIN: u8 = 0x0F;
/// The register before those of clear, red, green and blue.
const STATUS: u8 = 0x13;
const POWER_ON: u8 = 1;
const CONVERT: u8 = 2;
/// The bit of [`STATUS`] that is set while there are valid counts.
const IS_VALID: u8 = 1;

/// An exposure: cycles of 2.4 ms, the gain's register, and the factor to the counts of the nominal one.
struct Exposure {
    cycles: u8,
    gain: u8,
    factor: f32,
}

/// Exposures, the shortest first. The third is nominal.
const EXPOSURES: [Exposure; 4] = [
    Exposure::new(4, 0, 64.0),
    Exposure::new(64, 0, 4.0),
    Exposure::new(64, 1, 1.0), // the gain 4
    Exposure::new(64, 3, 1.0 / 15.0),
];

impl Exposure {
    const fn new(cycles: u8, gain: u8, factor: f32) -> Self {
        Self {
            cycles,
            gain,
            factor,
        }
    }

    /// Counts at and above which a reading is saturated.
    fn saturation(&self) -> f32 {
        (1024.0 * f32::from(self.cycles)).min(65_535.0)
    }

    /// Two integrations, because the first may have begun before the arms rest, and the start of the oscillator.
    fn settling(&self) -> Duration {
        Duration::from_micros(4_800 * u64::from(self.cycles) + 5_000)
    }
}

/// A TCS3472: linear red, green and blue. A reading that saturates is read again with less exposure, and one below a
/// hundredth of the range with more.
#[derive(Debug)]
pub struct ColorSensor<B> {
    bus: B,
}

impl<B: I2c> ColorSensor<B> {
    /// Uses the sensor on a bus.
    pub fn new(bus: B) -> Self {
        Self { bus }
    }

    async fn write(&mut self, register: u8, value: u8) -> Result<(), Error> {
        let written = self.bus.write(ADDRESS, &[REGISTER | register, value]).await;
        written.map_err(|_| FAULT)
    }

    /// Reads red, green and blue with an exposure. The settings are written each time: the sensor may have lost its power.
    async fn expose(&mut self, exposure: &Exposure) -> Result<[f32; 3], Error> {
        for (register, value) in [
            (ENABLE, POWER_ON),
            (INTEGRATION_TIME, exposure.cycles.wrapping_neg()),
            (GAIN, exposure.gain),
            (ENABLE, POWER_ON | CONVERT),
        ] {
            self.write(register, value).await?;
        }
        Timer::after(exposure.settling()).await;
        let mut bytes = [0; 9];
        let read = self
            .bus
            .write_read(ADDRESS, &[REGISTER | STATUS], &mut bytes);
        read.await.map_err(|_| FAULT)?;
        let [status, _, _, r0, r1, g0, g1, b0, b1] = bytes;
        if status & IS_VALID == 0 {
            return Err(Error::new(ErrorCode::SensorReset));
        }
        Ok([[r0, r1], [g0, g1], [b0, b1]].map(|bytes| u16::from_le_bytes(bytes).into()))
    }
}

const FAULT: Error = Error::new(ErrorCode::Sensor);

impl<B: I2c> Sensor for ColorSensor<B> {
    async fn counts(&mut self, adapts: bool) -> Result<Counts, Error> {
        let [shortest, short, nominal, long] = &EXPOSURES;
        let mut exposure = nominal;
        let mut counts = self.expose(exposure).await?;
        let largest = |counts: [f32; 3]| counts.into_iter().fold(0.0, f32::max);
        let is_saturated = |counts, exposure: &Exposure| largest(counts) >= exposure.saturation();
        if adapts && largest(counts) < 0.01 * exposure.saturation() {
            exposure = long;
            counts = self.expose(exposure).await?;
        }
        for shorter in [short, shortest] {
            if adapts && is_saturated(counts, exposure) {
                exposure = shorter;
                counts = self.expose(exposure).await?;
            }
        }
        Ok(Counts {
            channels: counts.map(|count| count * exposure.factor),
            is_saturated: is_saturated(counts, exposure),
        })
    }
}
