//! Both ends of the serial link, over a line that loses bytes. The device sends requests; the host moves the
//! arms and replies. Everything is simulated: `cargo run -p glimpse-core --example host`

mod common;

use common::material;
use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::gonio::Reading;
use glimpse_core::link::{FRAME_BYTES, HostEnd, PROTOCOL, Purpose, Reply, Request};
use glimpse_core::model::Neural;
use glimpse_core::recipe::{Recipe, memory_words};
use glimpse_core::scan::{Residual, Scan};

const RECIPE: &[u8] = include_bytes!("recipes/neural-n8.recipe");

/// One direction of the line. It loses one of `loss_interval` bytes.
struct Line {
    loss_interval: usize,
    bytes: usize,
}

impl Line {
    fn transmit(&mut self) -> bool {
        self.bytes += 1;
        !self.bytes.is_multiple_of(self.loss_interval)
    }
}

/// A host that serves one scan.
#[derive(Default)]
pub(crate) struct Computer {
    end: HostEnd,
    /// Fitted values received from the device.
    pub(crate) values: Vec<f32>,
    /// Number of movements of the arms.
    pub(crate) readings: u32,
}

impl Computer {
    /// Receives a byte and returns the reply's bytes, if there is a reply.
    fn receive<'b>(&mut self, byte: u8, buffer: &'b mut [u8; FRAME_BYTES]) -> Option<&'b [u8]> {
        let mut respond = |request| match request {
            Request::Hello { .. } => {
                self.values.clear();
                Reply::Welcome { protocol: PROTOCOL }
            }
            Request::Measure {
                purpose,
                index,
                directions,
            } => {
                self.readings += 1;
                let lamp = if purpose == Purpose::Dark { 0.0 } else { 1.0 };
                let reading = Reading::new(material(&directions).map(|brdf| lamp * brdf));
                Reply::Measured { index, reading }
            }
            // This host does not remember earlier scans.
            Request::Restored { .. } => Reply::Refused(ErrorCode::RefusedRestored),
            Request::Values { values: new, .. } => {
                self.values.extend_from_slice(&new);
                Reply::Accepted
            }
            _ => Reply::Accepted,
        };
        self.end
            .answer(byte, buffer, |request| Some(respond(request)))
    }
}

const NO_REPLY: Error = Error::new(ErrorCode::NoReply);

/// Runs device and host until the scan is finished. Returns the residual, the device's values, and the time in
/// milliseconds.
pub(crate) fn scan(
    computer: &mut Computer,
    loss_interval: usize,
) -> Result<(Residual, Vec<f32>, u32), Error> {
    let mut memory = [0.0; memory_words(&[RECIPE])];
    let scan = Scan::<Neural>::new(Recipe::parse(RECIPE)?, &mut memory)?;
    let mut driver = Driver::new(scan, Config::new(Host::Measures));
    let mut line = Line {
        loss_interval,
        bytes: 0,
    };
    let mut buffer = [0; FRAME_BYTES];
    let mut result = None;
    for now_ms in 0_u32.. {
        match driver.poll(now_ms.into()) {
            Action::Finished(residual) => {
                let fitted = driver.scan().fitted();
                result = fitted.map(|fitted| (residual, fitted.values().collect(), now_ms));
            }
            // The host has the result. (This device saves no readings for resets.)
            Action::Forget => return result.ok_or(NO_REPLY),
            // The host is silent: the readings are kept, and nothing moves until this call.
            Action::Failed(NO_REPLY) => driver.resume(),
            Action::Failed(error) => return Err(error),
            _ => {}
        }
        // The device sends one byte per millisecond, and the reply arrives immediately.
        let Some(byte) = driver.outgoing().first().copied() else {
            continue;
        };
        driver.sent(1);
        if line.transmit() {
            for byte in computer.receive(byte, &mut buffer).unwrap_or_default() {
                if line.transmit() {
                    driver.receive(*byte);
                }
            }
        }
    }
    Err(NO_REPLY)
}

pub(crate) fn main() -> Result<(), Error> {
    for loss_interval in [usize::MAX, 150] {
        let mut computer = Computer::default();
        let (residual, _, milliseconds) = scan(&mut computer, loss_interval)?;
        let (values, readings) = (computer.values.len(), computer.readings);
        println!("{milliseconds:6} ms: {readings} readings, {values} values, {residual:.4?}");
    }
    Ok(())
}
