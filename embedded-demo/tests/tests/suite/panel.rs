//! A panel whose button bounces, on lines of all kinds.

use std::cell::Cell;
use std::pin::pin;
use std::task::{Context, Poll, Waker};

use embassy_time::{Duration, Instant, MockDriver};
use embedded_hal::digital::ErrorKind;
use glimpse_core::error::{Error, ErrorCode};
use glimpse_desk::Line::*;
use glimpse_desk::{Desk, Pin, take_clock};
use glimpse_scanner::{Button, Panel, Press};

use crate::N8;

/// Reads a contact that is closed from each start to its end, ms, and bounces for 15 ms after each of them.
fn read(presses: &[[u64; 2]]) -> Result<bool, ErrorKind> {
    let now = Instant::now().as_millis();
    let is_bouncing = |change: &u64| (*change..change + 15).contains(&now);
    let is_closed = |[start, end]: &[u64; 2]| (*start..*end).contains(&now);
    match presses.as_flattened().iter().any(is_bouncing) {
        true => Ok(!now.is_multiple_of(3)),
        false => Ok(!presses.iter().any(is_closed)),
    }
}

/// A second press that a bounce pretends would home the arms right after a stop.
#[test]
fn bounces_are_no_presses() {
    let _clock = take_clock();
    // It is held at the start, pressed twice, and held.
    let pin = Pin(|| read(&[[0, 100], [200, 260], [400, 1000], [1500, 4000]]));
    let mut button = Button::new(pin);
    let mut presses = Vec::new();
    while Instant::now().as_millis() < 5000 {
        // The future is dropped every 5 ms, as by a loop that also waits for bytes.
        let mut press = pin!(button.press());
        for _ in 0..5 {
            let mut context = Context::from_waker(Waker::noop());
            if let Poll::Ready(press) = press.as_mut().poll(&mut context) {
                presses.push((press, Instant::now().as_millis() / 50 * 50));
                break;
            }
            MockDriver::get().advance(Duration::from_millis(1));
        }
    }
    use Press::{Down, Held, Up};
    let [first, second] = [[(Down, 200), (Up, 250)], [(Down, 400), (Up, 1000)]];
    assert_eq!(
        presses,
        [first, second, [(Down, 1500), (Held, 3500)]].concat()
    );
}

/// A line that is always ready, or always fails, does not starve the button: a press homes the arms, and the next one stops
/// them. The light blinks.
#[test]
fn every_press_counts_on_every_line() {
    for line in [Host, Unplugged, ReadFails, ReadZero, Flood, Echo] {
        let mut desk = Desk::new(N8);
        desk.line = line;
        let presses = || Instant::now().as_millis() / 2500;
        let button = Pin(|| {
            let start = 2500 * presses() + 1000;
            read(&[[start, start + 300]])
        });
        let (is_lit, changes) = (Cell::new(false), Cell::new(0));
        let light = Pin(|level| changes.update(|n| n + u32::from(level != is_lit.replace(level))));
        let mut panel = Panel::new(button, light);
        desk.run_with(&mut panel, || desk.failures.borrow().len() == 6);
        let failures = desk.failures.borrow();
        let is_stop = |error: &Error| error.code == ErrorCode::Stopped;
        assert!(failures.iter().all(is_stop), "{line:?}: {failures:?}");
        assert!(presses() <= 14 && changes.get() > 20, "{line:?}");
    }
}
