//! Simulated materials, light and color sensor.

use std::cell::{Cell, RefCell};
use std::f32::consts::{FRAC_1_PI, PI};
use std::rc::Rc;

use embassy_time::Instant;
use embedded_hal_async::i2c::{self, I2c, Operation};
use glimpse_core::geometry::Directions;

use crate::{Arm, Desk, Random};

/// A material's BRDF in linear RGB, sr^-1, not times the cosine.
pub type Brdf = Rc<dyn Fn(&Directions<f32>) -> [f32; 3]>;

/// Returns a GGX highlight of roughness `alpha` and reflectance `f0` on a Lambertian base.
pub fn ggx(at: &Directions<f32>, diffuse: [f32; 3], f0: [f32; 3], alpha: f32) -> [f32; 3] {
    let (i, o) = (at.incoming, at.outgoing);
    let sum: [f32; 3] = std::array::from_fn(|k| i[k] + o[k]);
    let length = sum.iter().map(|x| x * x).sum::<f32>().sqrt();
    let (cos_h, cos_d, a2) = (sum[2] / length, length / 2.0, alpha * alpha);
    let d = a2 * FRAC_1_PI / (cos_h * cos_h * (a2 - 1.0) + 1.0).powi(2);
    let lambda = |c: f32| (a2 + (1.0 - a2) * c * c).sqrt();
    let g = 2.0 * i[2] * o[2] / (o[2] * lambda(i[2]) + i[2] * lambda(o[2]));
    std::array::from_fn(|c| {
        let f = f0[c] + (1.0 - f0[c]) * (1.0 - cos_d).powi(5);
        diffuse[c] * FRAC_1_PI + d * g * f / (4.0 * i[2] * o[2])
    })
}

/// A plastic.
pub fn plastic(at: &Directions<f32>) -> [f32; 3] {
    ggx(at, [0.4, 0.25, 0.12], [0.04; 3], 0.35)
}

/// A metal with a narrow highlight.
pub fn metal(at: &Directions<f32>) -> [f32; 3] {
    ggx(at, [0.0; 3], [0.9, 0.7, 0.4], 0.2)
}

/// A black lacquer.
pub fn black(at: &Directions<f32>) -> [f32; 3] {
    ggx(at, [0.02; 3], [0.04; 3], 0.4)
}

/// The white tile of the calibration.
pub fn tile(_: &Directions<f32>) -> [f32; 3] {
    [0.99 * FRAC_1_PI; 3]
}

/// Lamp, room and sensor. The lamp lights all that the sensor sees. Counts are those of the nominal exposure.
pub struct Light {
    /// The material.
    pub material: RefCell<Brdf>,
    /// Brightness of the lamp, and its change per second.
    pub lamp: Cell<(f32, f32)>,
    /// True if the firmware cannot switch the lamp.
    pub is_always_on: Cell<bool>,
    /// The pin with which the firmware switches it.
    pub pin: Arm,
    /// Counts of the room's light, and their change per second.
    pub room: Cell<(f32, f32)>,
    /// Counts without light.
    pub dark: Cell<f32>,
    /// Counts of the white tile with light along the normal.
    pub white: Cell<f32>,
    /// Standard deviation of the noise, relative; in addition, it is two counts.
    pub noise: Cell<f32>,
    random: Cell<Random>,
}

impl Default for Light {
    fn default() -> Self {
        Self {
            material: RefCell::new(Rc::new(plastic)),
            lamp: Cell::new((1.0, 0.0)),
            is_always_on: Cell::new(false),
            pin: Arm::default(),
            room: Cell::new((0.0, 0.0)),
            dark: Cell::new(100.0),
            white: Cell::new(4_000.0),
            noise: Cell::new(0.002),
            random: Cell::new(Random(1)),
        }
    }
}

impl Light {
    /// Puts a material on the sample's place.
    pub fn put(&self, material: impl Fn(&Directions<f32>) -> [f32; 3] + 'static) {
        *self.material.borrow_mut() = Rc::new(material);
    }

    /// A nearly normal number of standard deviation 1.
    fn normal(&self) -> f32 {
        let mut random = self.random.get();
        let sum: f32 = (0..12).map(|_| random.unit()).sum();
        self.random.set(random);
        sum - 6.0
    }

    /// Returns the counts with the nominal exposure.
    fn counts(&self, at: &Directions<f32>) -> [f32; 3] {
        let seconds = Instant::now().as_micros() as f32 * 1e-6;
        let now = |(start, change): (f32, f32)| start + seconds * change;
        let is_lit = self.pin.level() || self.is_always_on.get();
        let lamp = if is_lit { now(self.lamp.get()) } else { 0.0 };
        let span = self.white.get() - self.dark.get();
        (self.material.borrow())(at).map(|brdf| {
            let signal = span * brdf * PI / 0.99 * at.incoming[2].max(0.0) * lamp;
            let noise = self.noise.get() * self.normal();
            self.dark.get() + now(self.room.get()) + signal * (1.0 + noise)
        })
    }
}

/// A fault of the sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum SensorFault {
    /// It works.
    #[default]
    None,
    /// It never answers.
    Absent,
    /// It does not answer at a reading with this number, once.
    NackAt(usize),
    /// It loses its power for a moment, after this number of readings.
    PowerLossAfter(usize),
    /// The same while it reads, so that it has no valid counts.
    PowerLossIn(usize),
    /// Its counts do not change.
    Stuck,
}

/// The registers of a TCS3472.
#[derive(Clone, Copy, Debug, Default)]
pub struct Registers {
    enable: u8,
    time: u8,
    gain: u8,
}

/// There is no sensor.
#[derive(Debug)]
pub struct Nack;

impl i2c::Error for Nack {
    fn kind(&self) -> i2c::ErrorKind {
        i2c::ErrorKind::NoAcknowledge(i2c::NoAcknowledgeSource::Unknown)
    }
}

impl i2c::ErrorType for &Desk {
    type Error = Nack;
}

impl I2c for &Desk {
    async fn transaction(
        &mut self,
        address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), Nack> {
        assert_eq!(address, 0x29);
        let number = self.readings.get() + 1;
        let mut registers = self.registers.get();
        for operation in operations {
            match (operation, self.sensor.get()) {
                (_, SensorFault::Absent) => return Err(Nack),
                (Operation::Write([0xA0, value]), _) => registers.enable = *value,
                (Operation::Write([0xA1, value]), _) => registers.time = *value,
                (Operation::Write([0xAF, value]), _) => registers.gain = *value,
                (Operation::Write(bytes), _) => assert_eq!(*bytes, [0xB3], "the status"),
                (Operation::Read(_), SensorFault::NackAt(at)) if at == number => {
                    self.sensor.set(SensorFault::None);
                    return Err(Nack);
                }
                (Operation::Read(bytes), fault) => {
                    if fault == SensorFault::PowerLossIn(number) {
                        registers = Registers::default();
                        self.sensor.set(SensorFault::None);
                    }
                    self.readings.set(number);
                    if let Some((_, axis, steps)) =
                        self.stalls.get().filter(|(after, ..)| *after == number)
                    {
                        self.machine.arms[axis].stalled.set(steps);
                    }
                    self.read_at.borrow_mut().push(self.machine.angles());
                    bytes[0] = u8::from(registers.enable == 3);
                    let cycles = f32::from(registers.time.wrapping_neg());
                    let gain = [1.0, 4.0, 16.0, 60.0][usize::from(registers.gain)];
                    let full = (1024.0 * cycles).min(65_535.0);
                    let counts = self.light.counts(&self.directions()).map(|counts| {
                        let exposed = counts * cycles * gain / 256.0 + 2.0 * self.light.normal();
                        exposed.clamp(0.0, full) as u16
                    });
                    let counts = match fault {
                        SensorFault::Stuck => [5_000; 3],
                        _ if registers.enable != 3 => [0; 3],
                        _ => counts,
                    };
                    bytes[3..9].copy_from_slice(counts.map(u16::to_le_bytes).as_flattened());
                    if fault == SensorFault::PowerLossAfter(number) {
                        registers = Registers::default();
                    }
                }
            }
        }
        self.registers.set(registers);
        Ok(())
    }
}
