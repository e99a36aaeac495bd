//! A button whose contact bounces, and a color sensor with counts of a known material.

use std::cell::Cell;
use std::convert::Infallible;
use std::f32::consts::FRAC_1_PI;
use std::pin::pin;
use std::task::{Context, Poll, Waker};

use embassy_time::{Duration, Instant, MockDriver, Timer};
use embedded_hal::digital::{ErrorType, InputPin};
use embedded_hal_async::digital::Wait;
use embedded_hal_async::i2c::{self, I2c, Operation};
use glimpse_core::geometry::{ArmAngles, Spherical};
use glimpse_core::gonio::{Calibration, Footprint};
use glimpse_desk::take_clock;
use glimpse_scanner::{Button, ColorSensor, Sensor};

/// A contact that is closed from each start to its end, ms, and bounces for 15 ms after each of them.
struct Contact(&'static [[u64; 2]]);

impl Contact {
    fn is_closed(&self) -> bool {
        let now = Instant::now().as_millis();
        let is_bouncing = |change: &u64| (*change..change + 15).contains(&now);
        if self.0.as_flattened().iter().any(is_bouncing) {
            return now.is_multiple_of(3);
        }
        self.0
            .iter()
            .any(|[start, end]| (*start..*end).contains(&now))
    }

    async fn wait_for(&self, is_closed: bool) {
        while self.is_closed() != is_closed {
            Timer::after_millis(1).await;
        }
    }
}

impl ErrorType for Contact {
    type Error = Infallible;
}

impl InputPin for Contact {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(!self.is_closed())
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(self.is_closed())
    }
}

impl Wait for Contact {
    async fn wait_for_high(&mut self) -> Result<(), Infallible> {
        self.wait_for(false).await;
        Ok(())
    }

    async fn wait_for_low(&mut self) -> Result<(), Infallible> {
        self.wait_for(true).await;
        Ok(())
    }

    async fn wait_for_rising_edge(&mut self) -> Result<(), Infallible> {
        unreachable!()
    }

    async fn wait_for_falling_edge(&mut self) -> Result<(), Infallible> {
        unreachable!()
    }

    async fn wait_for_any_edge(&mut self) -> Result<(), Infallible> {
        unreachable!()
    }
}

/// A second press that a bounce pretends would home the arms right after a stop.
#[test]
fn bounces_are_no_presses() {
    let _clock = take_clock();
    // It is held at the start, and pressed twice.
    let mut button = Button::new(Contact(&[[0, 100], [200, 260], [400, 1000]]));
    let mut presses = Vec::new();
    while Instant::now().as_millis() < 1500 {
        // The future is dropped every 5 ms, as by a loop that also waits for bytes.
        let mut pressed = pin!(button.pressed());
        for _ in 0..5 {
            let mut context = Context::from_waker(Waker::noop());
            if pressed.as_mut().poll(&mut context).is_ready() {
                presses.push(Instant::now().as_millis());
                break;
            }
            MockDriver::get().advance(Duration::from_millis(1));
        }
    }
    assert_eq!(presses.len(), 2, "{presses:?}");
    assert!((220..240).contains(&presses[0]) && (420..440).contains(&presses[1]));
}

/// A bus whose sensor has these counts of red, green and blue.
struct Bus<'c>(&'c Cell<[u16; 3]>);

impl i2c::ErrorType for Bus<'_> {
    type Error = Infallible;
}

impl I2c for Bus<'_> {
    async fn transaction(
        &mut self,
        _: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), Infallible> {
        for operation in operations {
            if let Operation::Read(bytes) = operation {
                bytes.copy_from_slice(self.0.get().map(u16::to_le_bytes).as_flattened());
            }
        }
        Ok(())
    }
}

fn run<T>(future: impl Future<Output = T>) -> T {
    let mut future = pin!(future);
    loop {
        let mut context = Context::from_waker(Waker::noop());
        if let Poll::Ready(result) = future.as_mut().poll(&mut context) {
            return result;
        }
        MockDriver::get().advance(Duration::from_millis(1));
    }
}

/// A gray card has the same BRDF at all directions, although the counts fall with the cosine.
#[test]
fn calibration_holds_at_all_angles() {
    let _clock = take_clock();
    let arms = |theta_i: f32, theta_o: f32| {
        let at = |theta, phi| Spherical { theta, phi };
        let [incoming, outgoing] = [at(theta_i, 0.0), at(theta_o, 3.0)];
        ArmAngles { incoming, outgoing }
    };
    let counts = Cell::new([0; 3]);
    let calibration = Calibration::new([100.0; 3], [20_100.0; 3], [0.99; 3]).unwrap();
    for (footprint, is_lamp) in [
        (Footprint::LightLarger, true),
        (Footprint::SensorLarger, false),
    ] {
        let white_at = arms(0.5, 0.3);
        let sensor = ColorSensor::new(Bus(&counts), calibration, &white_at, footprint);
        let mut sensor = run(sensor).unwrap();
        for (theta_i, theta_o) in [(0.5, 0.3), (0.1, 1.2), (1.2, 0.0)] {
            let (theta, white) = if is_lamp {
                (theta_i, 0.5_f32)
            } else {
                (theta_o, 0.3)
            };
            let light = 20_000.0 * 0.5 / 0.99 * f32::cos(theta) / white.cos();
            counts.set([(100.0 + light) as u16; 3]);
            let reading = run(sensor.read(&arms(theta_i, theta_o))).unwrap();
            let error = reading.brdf[1] / (0.5 * FRAC_1_PI) - 1.0;
            assert!(error.abs() < 1e-3, "{theta_i} {theta_o}: {error}");
        }
    }
}
