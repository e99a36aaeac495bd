//! The device's part, played on the host: for tests of the scanner, and as the firmware's equal.

use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use glimpse_core::fit::Workspace;
use glimpse_core::link::{Asker, FRAME_BYTES, PROTOCOL, Reply, Request};
use glimpse_core::model::{Neural, ParameterSet};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Residual, Scan};
use glimpse_trainer::scanner::{ScanReport, Taken};

/// Fits measurements by a recipe, as the firmware does: parameters and residual.
///
/// # Panics
/// If the recipe is damaged or does not belong to the measurements.
#[must_use]
pub fn fit(recipe: &[u8], measurements: &[Taken]) -> (Vec<f32>, Residual) {
    let recipe = Recipe::parse(recipe).expect("a whole recipe");
    let mut workspace = Workspace::<Neural>::new();
    let mut scan = Scan::<Neural, 64>::new(recipe, &mut workspace).expect("a Neural recipe");
    for taken in measurements {
        let (_, directions) = scan.next_directions().expect("as many as were measured");
        assert_eq!(directions, taken.directions);
        scan.record(taken.measurement)
            .expect("a possible measurement");
    }
    assert!(scan.next_directions().is_none(), "a measurement is missing");
    while !scan.advance_fit(usize::MAX).is_complete() {}
    (scan.parameters().iter().copied().collect(), scan.residual())
}

/// The device's result is the host's fit of the same measurements.
///
/// # Panics
/// If it is not.
pub fn assert_agrees(report: &ScanReport, recipe: &[u8]) {
    let close = |device: f32, host: f32| (device - host).abs() <= 1e-4 * host.abs() + 1e-7;
    let parsed = Recipe::parse(recipe).expect("a whole recipe");
    assert_eq!(report.recipe, parsed.checksum());
    assert_eq!(report.measurements.len(), parsed.samples());

    let (parameters, residual) = fit(recipe, &report.measurements);
    assert_eq!(report.parameters.len(), parameters.len());
    for (index, (device, host)) in report.parameters.iter().zip(&parameters).enumerate() {
        assert!(
            close(*device, *host),
            "parameter {index}: {device}, on the host {host}"
        );
    }
    assert!(
        close(report.residual.mean, residual.mean) && close(report.residual.worst, residual.worst),
        "{:?}, on the host {residual:?}",
        report.residual
    );
}

/// A device at the other end of a stream.
#[derive(Debug)]
pub struct Device {
    stream: TcpStream,
    asker: Asker,
    patience: Duration,
}

impl Device {
    /// A device that asks again after `patience`.
    ///
    /// # Errors
    /// If the stream refuses a time-out.
    pub fn new(stream: TcpStream, patience: Duration) -> io::Result<Self> {
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(Duration::from_millis(1)))?;
        Ok(Self {
            stream,
            asker: Asker::new(),
            patience,
        })
    }

    /// Asks until the reply is there.
    ///
    /// # Errors
    /// If the stream fails or ends, or there is no reply to a hundred repetitions.
    ///
    /// # Panics
    /// If the request does not fit into a frame.
    pub fn ask(&mut self, request: &Request) -> io::Result<Reply> {
        let mut frame = [0; FRAME_BYTES];
        let frame = self.asker.ask(request, &mut frame).expect("there is room");
        let mut bytes = [0; 64];
        for _ in 0..100 {
            self.stream.write_all(frame)?;
            let sent = Instant::now();
            while sent.elapsed() < self.patience {
                let count = match self.stream.read(&mut bytes) {
                    Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                    Ok(count) => count,
                    Err(error) if error.kind() == io::ErrorKind::WouldBlock => continue,
                    Err(error) => return Err(error),
                };
                for byte in &bytes[..count] {
                    if let Some(reply) = self.asker.hear(*byte, request) {
                        return Ok(reply);
                    }
                }
            }
        }
        Err(io::ErrorKind::TimedOut.into())
    }

    /// Scans one material, from hello to finished.
    ///
    /// # Errors
    /// As [`Device::ask`].
    ///
    /// # Panics
    /// If the recipe is damaged, or the scanner does not do as it is asked.
    pub fn scan(&mut self, recipe: &[u8]) -> io::Result<()> {
        let recipe = Recipe::parse(recipe).expect("a whole recipe");
        let mut workspace = Workspace::<Neural>::new();
        let mut scan = Scan::<Neural, 64>::new(recipe, &mut workspace).expect("a Neural recipe");
        let hello = Request::Hello {
            protocol: PROTOCOL,
            model: recipe.model(),
            samples: recipe.samples() as u16,
            recipe: recipe.checksum(),
        };
        let welcome = Reply::Welcome { protocol: PROTOCOL };
        assert_eq!(self.ask(&hello)?, welcome);
        while let Some((index, directions)) = scan.next_directions() {
            let reply = self.ask(&Request::Measure { index, directions })?;
            let Reply::Measured { measurement, .. } = reply else {
                panic!("{reply:?}")
            };
            scan.record(measurement).expect("a possible measurement");
        }
        while !scan.advance_fit(usize::MAX).is_complete() {}
        let values: Vec<f32> = scan.parameters().iter().copied().collect();
        let mut offset = 0;
        for values in values.chunks(glimpse_core::link::VALUES_PER_FRAME) {
            let request = Request::Parameters {
                offset,
                values: values.iter().copied().collect(),
            };
            assert_eq!(self.ask(&request)?, Reply::Accepted);
            offset += values.len() as u16;
        }
        let finished = Request::Finished(scan.residual());
        assert_eq!(self.ask(&finished)?, Reply::Accepted);
        Ok(())
    }
}
