//! The firmware's side of a desk: the color sensor on its I2C bus, and the serial line.

use std::f32::consts::PI;
use std::future::pending;
use std::io;

use embassy_time::{Instant, Timer};
use embedded_hal_async::i2c::{self, I2c, NoAcknowledgeSource, Operation};
use embedded_io_async::{ErrorKind, ErrorType, Read, Write};

use crate::optics::DARK;
use crate::{Desk, Line, SensorFault, directions};

/// Standard deviation of the signal's noise, relative.
const NOISE: f32 = 0.002;
/// Standard deviation of the sensor's noise, counts.
const READ_NOISE: f32 = 2.0;

impl Desk {
    /// Returns the counts with the nominal exposure.
    fn counts(&self) -> [f32; 3] {
        let seconds = Instant::now().as_micros() as f32 * 1e-6;
        let now = |(start, change): (f32, f32)| start + seconds * change;
        let is_lit = self.is_lit.get() || self.is_always_lit;
        let lamp = if is_lit { now(self.lamp) } else { 0.0 };
        let at = directions(self.machine.angles());
        (self.material)(&at).map(|brdf| {
            let part = brdf * PI / 0.99 * at.incoming[2].max(0.0) * lamp;
            let noise = 1.0 + NOISE * self.random_normal();
            DARK + now(self.room) + (self.white_counts - DARK) * part * noise
        })
    }

    fn random_normal(&self) -> f32 {
        self.random.borrow_mut().normal() as f32
    }
}

impl i2c::ErrorType for &Desk {
    type Error = i2c::ErrorKind;
}

/// A TCS3472. The lamp lights all that it sees.
impl I2c for &Desk {
    async fn transaction(
        &mut self,
        address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), i2c::ErrorKind> {
        assert_eq!(address, 0x29);
        let fault = self.sensor.get();
        if fault == Some(SensorFault::Absent) {
            return Err(i2c::ErrorKind::NoAcknowledge(NoAcknowledgeSource::Unknown));
        }
        let mut registers = self.registers.get();
        for operation in operations {
            match operation {
                Operation::Write([register, value]) => {
                    registers[usize::from(*register) - 0xA0] = *value
                }
                Operation::Write(bytes) => assert_eq!(*bytes, [0xB3], "the status"),
                Operation::Read(bytes) => {
                    if fault == Some(SensorFault::PowerLoss) {
                        registers = [0; 32];
                    }
                    self.readings.borrow_mut().push(self.machine.angles());
                    let [enable, time, gain] = [0x0, 0x1, 0xF].map(|number| registers[number]);
                    let cycles = f32::from(time.wrapping_neg());
                    let gain = [1.0, 4.0, 16.0, 60.0][usize::from(gain)];
                    let counts = self.counts().map(|counts| {
                        let noise = READ_NOISE * self.random_normal();
                        let exposed = counts * cycles * gain / 256.0 + noise;
                        match fault {
                            Some(SensorFault::Stuck) => 5_000,
                            _ => exposed.min(1024.0 * cycles) as u16, // saturates
                        }
                    });
                    bytes[0] = u8::from(enable == 3);
                    bytes[3..9].copy_from_slice(counts.map(u16::to_le_bytes).as_flattened());
                }
            }
        }
        self.registers.set(registers);
        Ok(())
    }
}

impl ErrorType for &Desk {
    type Error = ErrorKind;
}

impl Read for &Desk {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, ErrorKind> {
        match self.line {
            Line::Unplugged => pending().await,
            Line::ReadFails => Err(ErrorKind::Other),
            Line::ReadZero => Ok(0),
            Line::Flood => {
                buffer.fill(0x79);
                Ok(buffer.len())
            }
            Line::Host | Line::Echo => {
                while self.host.borrow().replies.is_empty() {
                    Timer::after_millis(1).await;
                }
                let replies = &mut self.host.borrow_mut().replies;
                Ok(io::Read::read(replies, buffer).unwrap_or(0))
            }
        }
    }
}

impl Write for &Desk {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        match self.line {
            Line::Unplugged => pending().await,
            Line::Echo => self.host.borrow_mut().replies.extend(bytes),
            Line::Host => self.host.borrow_mut().receive(bytes),
            _ => {}
        }
        Ok(bytes.len())
    }

    async fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}
