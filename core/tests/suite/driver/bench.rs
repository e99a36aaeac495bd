//! A simulated host, line and clock for drivers. Time passes only while a driver waits.

use glimpse_core::driver::{Action, Config, Driver};
use glimpse_core::error::ErrorCode;
use glimpse_core::gonio::Reading;
use glimpse_core::link::{FRAME_BYTES, HostEnd, PROTOCOL, Purpose, Received, Reply, Request};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;

use crate::scanning::{Any, new_scan, recipe_for, synthetic_reading};

/// Number of steps after which a driver counts as hung.
const MAX_STEPS: usize = 200_000;

/// Time of the driver's clock at the start, in ms. Its low 32 bits overflow after 0.256 s.
pub(crate) const ORIGIN: u64 = 0xFFFF_FF00;

pub(crate) type AnyDriver = Driver<'static, Any>;

/// A driver that scans with a recipe.
pub(crate) fn new_driver(recipe: Recipe<'static>, config: Config) -> AnyDriver {
    Driver::new(new_scan(recipe), config)
}

/// A driver that scans with a Phong recipe.
pub(crate) fn phong_driver(config: Config) -> AnyDriver {
    new_driver(recipe_for(ModelKind::Phong), config)
}

/// The reply of a correct host to a request.
pub(crate) fn default_reply(request: &Request) -> Reply {
    match request {
        Request::Hello { .. } => Reply::Welcome { protocol: PROTOCOL },
        Request::Measure { purpose, index, .. } => Reply::Measured {
            index: *index,
            reading: reading_for(*purpose, *index, synthetic_reading),
        },
        Request::Restored { index, reading } if *reading != synthetic_reading(*index) => {
            Reply::Refused(ErrorCode::RefusedRestored)
        }
        _ => Reply::Accepted,
    }
}

/// The reading of a sample, or with the lamp off 0.
fn reading_for(purpose: Purpose, index: u16, mut sensor: impl FnMut(u16) -> Reading) -> Reading {
    match purpose {
        Purpose::Dark => Reading::new([0.0; 3]),
        _ => sensor(index),
    }
}

/// A host's reply to a request; None if it does not reply.
type Handler<'h> = Box<dyn FnMut(&Request) -> Option<Reply> + 'h>;

/// The host at the other end of the line, with a record of messages and actions.
pub(crate) struct Bench<'h> {
    handler: Handler<'h>,
    end: HostEnd,
    /// Corrupts the bytes in either direction.
    pub(crate) corrupt: Box<dyn FnMut(Vec<u8>) -> Vec<u8> + 'h>,
    /// The device's own sensor.
    pub(crate) sensor: Box<dyn FnMut(u16) -> Reading + 'h>,
    /// The reading of the device's sensor with the lamp off, sr^-1.
    pub(crate) dark: f32,
    /// Delay of the host's reply in ms.
    pub(crate) delay: Box<dyn Fn(&Request) -> u64 + 'h>,
    /// The reply that is not sent yet, and its time in ms.
    delayed: Option<(u64, Reply)>,
    /// True if no byte reaches the host.
    pub(crate) disconnected: bool,
    /// Milliseconds since the start.
    pub(crate) now: u64,
    /// Milliseconds to sleep before the next step.
    pub(crate) sleep_ms: u32,
    /// Each request that the host received, without repetitions.
    pub(crate) requests: Vec<Request>,
    /// Each frame that was sent, with its time in ms.
    pub(crate) frames: Vec<(u64, Vec<u8>)>,
    /// Each action except `Wait`, `Continue` and `Measure`, with its time in ms.
    pub(crate) actions: Vec<(u64, Action)>,
}

impl<'h> Bench<'h> {
    /// A host with a reply to each request; None if it does not reply.
    pub(crate) fn new(handler: impl FnMut(&Request) -> Option<Reply> + 'h) -> Self {
        Self {
            handler: Box::new(handler),
            end: HostEnd::default(),
            corrupt: Box::new(|bytes| bytes),
            sensor: Box::new(synthetic_reading),
            dark: 0.0,
            delay: Box::new(|_| 0),
            delayed: None,
            disconnected: false,
            now: 0,
            sleep_ms: 0,
            requests: Vec::new(),
            frames: Vec::new(),
            actions: Vec::new(),
        }
    }

    /// A host that replies correctly to all requests.
    pub(crate) fn cooperative() -> Self {
        Self::new(|request| Some(default_reply(request)))
    }

    /// Passes bytes to the host, and returns its replies.
    pub(crate) fn reply_to(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut replies = Vec::new();
        for byte in bytes {
            let reply = match self.end.receive(*byte) {
                Some(Ok(Received::New(request))) => {
                    let reply = (self.handler)(&request);
                    self.delayed = reply.map(|reply| (self.now + (self.delay)(&request), reply));
                    self.requests.push(request);
                    self.due_reply()
                }
                Some(Ok(Received::Pending)) => self.due_reply(),
                Some(Ok(Received::Duplicate(reply))) => Some(reply),
                _ => None,
            };
            if let Some(reply) = reply {
                let mut buffer = [0; FRAME_BYTES];
                replies.extend_from_slice(self.end.reply(reply, &mut buffer).unwrap());
            }
        }
        replies
    }

    /// The reply to the last request, if it is due.
    fn due_reply(&mut self) -> Option<Reply> {
        let (_, reply) = self.delayed.take_if(|(due, _)| *due <= self.now)?;
        Some(reply)
    }

    /// One iteration of a firmware's loop, which sleeps as long as the driver allows.
    pub(crate) fn step(&mut self, driver: &mut AnyDriver) -> Action {
        self.now += u64::from(self.sleep_ms);
        let action = driver.poll(ORIGIN + self.now);
        self.sleep_ms = 0;
        match action {
            Action::Continue => assert_eq!(driver.poll_delay(ORIGIN + self.now), Some(0)),
            Action::Wait => {}
            Action::Measure {
                purpose,
                index,
                directions,
            } => {
                if purpose == Purpose::Sample {
                    assert_eq!(driver.scan().next_pending(), Some((index, directions)));
                }
                // The driver requests a sample with an invalid reading again.
                let mut reading = reading_for(purpose, index, &mut self.sensor);
                reading.brdf = reading.brdf.map(|brdf| brdf + self.dark);
                let _ = driver.record(index, reading);
            }
            _ => self.actions.push((self.now, action.clone())),
        }
        let bytes = driver.outgoing().to_vec();
        driver.sent(bytes.len());
        if action == Action::Wait {
            let delay = driver.poll_delay(ORIGIN + self.now);
            self.sleep_ms = delay.unwrap_or(u32::MAX);
        }
        if !bytes.is_empty() {
            self.frames.push((self.now, bytes.clone()));
            if !self.disconnected {
                let arrived = (self.corrupt)(bytes);
                let replies = self.reply_to(&arrived);
                for byte in (self.corrupt)(replies) {
                    self.sleep_ms = 0;
                    driver.receive(byte);
                }
            }
        }
        action
    }

    /// Runs until an action satisfies `until`. Returns its time in ms and the action.
    pub(crate) fn run(
        &mut self,
        driver: &mut AnyDriver,
        until: impl Fn(&Action) -> bool,
    ) -> (u64, Action) {
        for _ in 0..MAX_STEPS {
            let action = self.step(driver);
            assert_ne!(
                self.sleep_ms,
                u32::MAX,
                "the driver waits forever: {:?}",
                self.actions
            );
            if until(&action) {
                return (self.now, action);
            }
        }
        panic!("the driver hangs: {:?}, {:?}", self.actions, self.requests);
    }

    /// Runs for a time in ms.
    pub(crate) fn wait(&mut self, driver: &mut AnyDriver, milliseconds: u64) {
        let end = self.now + milliseconds;
        for _ in 0..MAX_STEPS {
            if self.now + u64::from(self.sleep_ms) > end {
                self.sleep_ms = (end - self.now) as u32;
            }
            self.step(driver);
            if self.now >= end {
                return;
            }
        }
        panic!("the driver hangs");
    }

    /// The number of requests of a kind that the host received.
    pub(crate) fn count(&self, is_counted: fn(&Request) -> bool) -> usize {
        let counted = self.requests.iter().filter(|request| is_counted(request));
        counted.count()
    }

    /// Takes the recorded actions, without their times.
    pub(crate) fn take_actions(&mut self) -> Vec<Action> {
        let actions = std::mem::take(&mut self.actions).into_iter();
        actions.map(|(_, action)| action).collect()
    }

    /// The bits of the last values and residual, and the number of `Finished` requests.
    pub(crate) fn results(&self) -> (Vec<u32>, usize) {
        let mut bits = Vec::new();
        let mut ends = 0;
        for request in &self.requests {
            match request {
                Request::Values {
                    offset,
                    total,
                    values,
                } => {
                    bits.truncate(usize::from(*offset));
                    assert_eq!(bits.len(), usize::from(*offset));
                    bits.extend(values.iter().map(|value| value.to_bits()));
                    assert!(bits.len() <= usize::from(*total));
                }
                Request::Finished(residual) => {
                    ends += 1;
                    bits.extend([residual.mean, residual.worst].map(f32::to_bits));
                }
                _ => {}
            }
        }
        (bits, ends)
    }
}

/// The bits of the fitted material of a driver.
pub(crate) fn fitted_bits(driver: &AnyDriver) -> Vec<u32> {
    let fitted = driver.scan().fitted().unwrap();
    let residual = fitted.residual();
    let numbers = fitted.values().chain([residual.mean, residual.worst]);
    numbers.map(f32::to_bits).collect()
}

pub(crate) fn is_finished(action: &Action) -> bool {
    matches!(action, Action::Finished(_))
}

pub(crate) fn is_failed(action: &Action) -> bool {
    matches!(action, Action::Failed(_))
}

pub(crate) fn is_forget(action: &Action) -> bool {
    *action == Action::Forget
}

/// Returns true for the request of a sample's reading.
pub(crate) fn is_measure(request: &Request) -> bool {
    matches!(
        request,
        Request::Measure {
            purpose: Purpose::Sample,
            ..
        }
    )
}
