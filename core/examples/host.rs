//! The host's side of the link: a device asks, a host moves the arms and answers, over a line that
//! loses bytes. All in memory and in virtual time: `cargo run -p glimpse-core --example host`

mod common;

use common::material;
use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::link::{
    FRAME_BYTES, Failure, PROTOCOL, Received, Refusal, Reply, Request, Server,
};
use glimpse_core::model::Neural;
use glimpse_core::recipe::{Recipe, memory_words};
use glimpse_core::scan::{Reading, Residual, Scan};

const RECIPE: &[u8] = include_bytes!("recipes/neural-n8.recipe");

/// A line in one direction, which loses every `loses`th byte.
struct Line {
    loses: usize,
    bytes: usize,
}

impl Line {
    fn passes(&mut self) -> bool {
        self.bytes += 1;
        !self.bytes.is_multiple_of(self.loses)
    }
}

/// A host of one scan.
#[derive(Default)]
pub(crate) struct Computer {
    server: Server,
    /// What was fitted, as the device told it.
    pub(crate) values: Vec<f32>,
    /// How often the arms were moved.
    pub(crate) readings: u32,
}

impl Computer {
    /// Takes a byte from the line; returns the bytes to be sent back, if any.
    fn receive<'b>(&mut self, byte: u8, buffer: &'b mut [u8]) -> Option<&'b [u8]> {
        let reply = match self.server.receive(byte)? {
            Ok(Received::New(request)) => self.answer(request),
            Ok(Received::Duplicate(reply)) => reply,
            // The arms move for it already; or it was damaged, and the device sends it again.
            _ => return None,
        };
        self.server.reply(reply, buffer).ok()
    }

    fn answer(&mut self, request: Request) -> Reply {
        match request {
            Request::Hello { .. } => {
                self.values.clear();
                Reply::Welcome { protocol: PROTOCOL }
            }
            Request::Measure { index, directions } => {
                self.readings += 1;
                let reading = Reading::new(material(&directions));
                Reply::Measured { index, reading }
            }
            // This host remembers no scan of before.
            Request::Saved { .. } => Reply::Refused(Refusal::Saved),
            Request::Values { values, .. } => {
                self.values.extend_from_slice(values.as_slice());
                Reply::Accepted
            }
            _ => Reply::Accepted,
        }
    }
}

/// Device and host, until the scan is done. Returns the residual, the values as the device has
/// them, and the milliseconds that all of it took.
pub(crate) fn scan(
    computer: &mut Computer,
    loses: usize,
) -> Result<(Residual, Vec<f32>, u32), Failure> {
    let recipe = Recipe::parse(RECIPE).map_err(Failure::Recipe)?;
    let mut memory = [0.0; memory_words(&[RECIPE])];
    let scan = Scan::<Neural>::new(recipe, &mut memory).map_err(Failure::Scan)?;
    let mut driver = Driver::new(scan, Config::new(Host::Measures));
    let mut line = Line { loses, bytes: 0 };
    let mut buffer = [0; FRAME_BYTES];
    for now_ms in 0_u32.. {
        match driver.poll(now_ms.into()) {
            Action::Finished(residual) => {
                let fitted = driver.scan()?.fitted();
                let values = fitted.map(|fitted| fitted.values().collect());
                return Ok((residual, values.unwrap_or_default(), now_ms));
            }
            Action::Failed(failure) => return Err(failure),
            _ => {} // `Action::Save` and `Action::Forget` are for what outlasts a reset
        }
        // A byte in a millisecond and direction; the reply comes at once.
        let Some(byte) = driver.outgoing().first().copied() else {
            continue;
        };
        driver.sent(1);
        if line.passes() {
            for byte in computer.receive(byte, &mut buffer).unwrap_or_default() {
                if line.passes() {
                    driver.receive(*byte);
                }
            }
        }
    }
    Err(Failure::NoReply)
}

pub(crate) fn main() -> Result<(), Failure> {
    for loses in [usize::MAX, 150] {
        let mut computer = Computer::default();
        let (residual, _, milliseconds) = scan(&mut computer, loses)?;
        let (values, readings) = (computer.values.len(), computer.readings);
        println!("{milliseconds:6} ms: {readings} readings, {values} values told, {residual:.4?}");
    }
    Ok(())
}
