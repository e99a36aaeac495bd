//! The link on this board: core's messages over the UART, with time-outs.

use glimpse_core::fit::Progress;
use glimpse_core::geometry::Directions;
use glimpse_core::link::{
    Asker, FRAME_BYTES, Failure, PROTOCOL, Refusal, Reply, Request, VALUES_PER_FRAME,
};
use glimpse_core::model::ParameterSet;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Measurement, Residual};
use heapless::Vec;

use crate::time::Clock;
use crate::uart::Uart;
use crate::watchdog;

/// A request is sent again after a tenth of a second. (The longest takes a fifth of that.)
const REPLY_MILLISECONDS: u32 = 100;
/// How often a request is sent before the device gives up: for 2 s.
const ATTEMPTS: u32 = 20;
/// The same for measurements, which have to wait for motors: for a minute.
const MEASURE_ATTEMPTS: u32 = 600;
/// How long the device does nothing after a failure.
const REST_MILLISECONDS: u32 = 500;

/// The device's end of the link.
pub struct Link {
    uart: Uart,
    clock: Clock,
    asker: Asker,
}

impl Link {
    /// A link over `uart`.
    pub fn new(uart: Uart, clock: Clock) -> Self {
        Self {
            uart,
            clock,
            asker: Asker::new(),
        }
    }

    /// Begins a scan, once a host of the same protocol is there.
    pub fn hello(&mut self, recipe: &Recipe<'_>) -> Result<(), Failure> {
        let hello = Request::Hello {
            protocol: PROTOCOL,
            model: recipe.model(),
            samples: recipe.samples() as u16,
            recipe: recipe.checksum(),
        };
        loop {
            match self.ask(&hello, ATTEMPTS) {
                Ok(Reply::Welcome { protocol: PROTOCOL }) => return Ok(()),
                Ok(Reply::Welcome { protocol: host }) => {
                    let device = PROTOCOL;
                    return Err(Failure::Protocol { device, host });
                }
                Ok(_) | Err(Failure::NoReply) => {} // nobody is there yet
                Err(failure) => return Err(failure),
            }
        }
    }

    /// Asks whether a measurement from before a reset holds still.
    pub fn holds(&mut self, index: u16, measurement: Measurement) -> Result<bool, Failure> {
        match self.tell(&Request::Kept { index, measurement }) {
            Ok(()) => Ok(true),
            Err(Failure::Refused(Refusal::Kept)) => Ok(false),
            Err(failure) => Err(failure),
        }
    }

    /// Has the scanner measure.
    pub fn measure(
        &mut self,
        index: u16,
        directions: Directions<f32>,
    ) -> Result<Measurement, Failure> {
        let request = Request::Measure { index, directions };
        match self.ask(&request, MEASURE_ATTEMPTS)? {
            Reply::Measured { measurement, .. } => Ok(measurement),
            other => {
                // Core's `Asker` lets no such reply through.
                defmt::error!("not a reply to a measurement: {}", other);
                Err(Failure::NoReply)
            }
        }
    }

    /// Tells how far the fit is.
    pub fn progress(&mut self, progress: Progress) -> Result<(), Failure> {
        self.tell(&Request::Progress(progress))
    }

    /// Tells all parameters, some at a time.
    pub fn parameters(&mut self, parameters: &impl ParameterSet<f32>) -> Result<(), Failure> {
        let mut values = parameters.iter().copied().peekable();
        let mut offset = 0;
        while values.peek().is_some() {
            let values: Vec<f32, VALUES_PER_FRAME> =
                values.by_ref().take(VALUES_PER_FRAME).collect();
            let next = offset + values.len() as u16;
            self.tell(&Request::Parameters { offset, values })?;
            offset = next;
        }
        Ok(())
    }

    /// Ends the scan.
    pub fn finished(&mut self, residual: Residual) -> Result<(), Failure> {
        self.tell(&Request::Finished(residual))
    }

    /// Gives up on the scan. Nobody may be there to hear it.
    pub fn fail(&mut self, failure: Failure) {
        let _ = self.tell(&Request::Failed(failure));
        // Whatever it was, it is not tried again in haste.
        self.clock.pass();
        let mut rested = 0;
        while rested < REST_MILLISECONDS {
            watchdog::feed();
            while self.uart.read().is_some() {}
            self.wait(REST_MILLISECONDS - rested);
            rested += self.clock.pass();
        }
    }

    /// Sleeps until a byte comes, but not for longer than so many milliseconds.
    fn wait(&mut self, milliseconds: u32) {
        self.clock.sleep(milliseconds, || self.uart.has_byte());
    }

    fn tell(&mut self, request: &Request) -> Result<(), Failure> {
        self.ask(request, ATTEMPTS).map(|_| ())
    }

    /// Sends a request until its reply comes, but not for ever.
    fn ask(&mut self, request: &Request, attempts: u32) -> Result<Reply, Failure> {
        let mut buffer = [0; FRAME_BYTES];
        let frame = self
            .asker
            .ask(request, &mut buffer)
            .map_err(|_| Failure::NoReply)?; // cannot be: the buffer is large enough
        self.clock.pass();
        let mut passed = 0;
        for _ in 0..attempts {
            let mut unsent = frame.iter().copied().peekable();
            while passed < REPLY_MILLISECONDS {
                watchdog::feed();
                match (unsent.peek(), self.uart.read()) {
                    (_, Some(byte)) => match self.asker.hear(byte, request) {
                        Some(Reply::Refused(refusal)) => return Err(Failure::Refused(refusal)),
                        Some(reply) => return Ok(reply),
                        None => {}
                    },
                    (Some(byte), None) => {
                        if self.uart.write(*byte) {
                            unsent.next();
                        }
                    }
                    (None, None) => self.wait(REPLY_MILLISECONDS - passed),
                }
                passed += self.clock.pass();
            }
            passed -= REPLY_MILLISECONDS; // a repeat that is late does not make the next one late
        }
        Err(Failure::NoReply)
    }
}
