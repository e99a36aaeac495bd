//! A panel whose button bounces, on lines of all kinds.

use std::cell::{Cell, RefCell};
use std::convert::Infallible;
use std::pin::pin;
use std::task::{Context, Poll, Waker};

use embassy_time::{Duration, Instant, MockDriver, Timer};
use embedded_hal::digital::{ErrorType, InputPin, OutputPin};
use embedded_hal_async::digital::Wait;
use glimpse_core::driver::Host;
use glimpse_core::error::ErrorCode;
use glimpse_desk::optics::SensorFault;
use glimpse_desk::{Desk, Line, take_clock};
use glimpse_scanner::{Button, Command, Event, Operator, Panel, Press};

use crate::faults::N8;

/// A contact that is closed from each start to its end, ms, and bounces for 15 ms after each of them.
struct Contact<'a>(&'a RefCell<Vec<[u64; 2]>>);

impl Contact<'_> {
    fn is_closed(&self) -> bool {
        let now = Instant::now().as_millis();
        let presses = self.0.borrow();
        let is_bouncing = |change: &u64| (*change..change + 15).contains(&now);
        if presses.as_flattened().iter().any(is_bouncing) {
            return now.is_multiple_of(3);
        }
        presses
            .iter()
            .any(|[start, end]| (*start..*end).contains(&now))
    }

    async fn wait_for(&self, is_closed: bool) {
        while self.is_closed() != is_closed {
            Timer::after_millis(1).await;
        }
    }
}

impl ErrorType for Contact<'_> {
    type Error = Infallible;
}

impl InputPin for Contact<'_> {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(!self.is_closed())
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(self.is_closed())
    }
}

impl Wait for Contact<'_> {
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

/// A light that counts its changes.
struct Light<'a>(&'a Cell<usize>);

impl ErrorType for Light<'_> {
    type Error = Infallible;
}

impl OutputPin for Light<'_> {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.update(|changes| changes + changes % 2);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.update(|changes| changes + 1 - changes % 2);
        Ok(())
    }
}

/// A second press that a bounce pretends would home the arms right after a stop.
#[test]
fn bounces_are_no_presses() {
    let _clock = take_clock();
    // It is held at the start, pressed twice, and held.
    let contact = RefCell::new(vec![[0, 100], [200, 260], [400, 1000], [1500, 4000]]);
    let mut button = Button::new(Contact(&contact));
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
    let (down, up, held) = (Press::Down, Press::Up, Press::Held);
    let expected = [
        (down, 200),
        (up, 250),
        (down, 400),
        (up, 1000),
        (down, 1500),
        (held, 3500),
    ];
    assert_eq!(presses, expected);
}

/// A panel, and a desk that records what is shown.
struct Recorder<'a>(Panel<Contact<'a>, Light<'a>>, &'a Desk);

impl Operator for Recorder<'_> {
    async fn command(&mut self) -> Command {
        self.0.command().await
    }

    fn show(&mut self, event: &mut Event<'_>) {
        self.0.show(event);
        let mut desk = self.1;
        desk.show(event);
    }
}

/// A line that is always ready, or always fails, does not starve the button: after each of ten failures a press homes the
/// arms, and one while they move stops them. The light blinks.
#[test]
fn every_press_counts_on_every_line() {
    for line in [
        Line::Host,
        Line::Unplugged,
        Line::ReadFails,
        Line::ReadZero,
        Line::Flood,
        Line::Breaks,
        Line::Echo,
    ] {
        let desk = Desk::new(N8);
        desk.line.set(line);
        desk.sensor.set(SensorFault::NackAt(1));
        let (contact, changes) = (RefCell::default(), Cell::new(0));
        let panel = Panel::new(Contact(&contact), Light(&changes));
        let next = Cell::new(1000);
        desk.run_with(Host::Listens, &mut Recorder(panel, &desk), || {
            let now = Instant::now().as_millis();
            if now >= next.get() {
                contact.borrow_mut().push([now, now + 300]);
                next.set(now + 2500);
            }
            desk.failures.borrow().len() == 6
        });
        // A press starts, the next one stops, and so on.
        let presses = contact.borrow().len();
        let failures = desk.failures.borrow();
        let stops = failures
            .iter()
            .filter(|error| error.code == ErrorCode::Stopped)
            .count();
        assert!(
            stops >= 5 && presses <= 14,
            "{line:?}: {presses} presses, {failures:?}"
        );
        assert!(changes.get() > 20, "{changes:?}");
    }
}
