//! The device's part, played on the host: for tests of the scanner, and as the firmware's equal.

use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::fit::AnyModel;
use glimpse_core::link::{Client, FRAME_BYTES, Reply, Request};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{FinishError, Residual, Scan};
use glimpse_trainer::scanner::{ScanReport, Taken};

/// Fits readings by a recipe, as the firmware does: values and residual.
///
/// # Panics
/// If the recipe is damaged or does not belong to the readings.
#[must_use]
pub fn fit(recipe: &[u8], readings: &[Taken]) -> (Vec<f32>, Residual) {
    let recipe = Recipe::parse(recipe).expect("a whole recipe");
    let mut memory = vec![0.0; recipe.memory_words()];
    let mut scan = Scan::<AnyModel>::new(recipe, &mut memory).expect("there is room");
    for taken in readings {
        let (index, directions) = scan.next_pending().expect("as many as were read");
        assert_eq!(directions, taken.directions);
        scan.record(index, taken.reading)
            .expect("a possible reading");
    }
    let mut fit = scan.fit().expect("all readings");
    while !fit.advance(u32::MAX).is_complete() {}
    match fit.finish() {
        Ok(_) | Err(FinishError::Implausible(_)) => {}
        Err(error) => panic!("{error}"),
    }
    let fitted = scan.fitted().expect("it is finished");
    (fitted.values().collect(), fitted.residual())
}

/// The device's result is the host's fit of the same measurements.
///
/// # Panics
/// If it is not.
pub fn assert_agrees(report: &ScanReport, recipe: &[u8]) {
    let close = |device: f32, host: f32| (device - host).abs() <= 1e-4 * host.abs() + 1e-7;
    let parsed = Recipe::parse(recipe).expect("a whole recipe");
    assert_eq!(report.recipe, parsed.checksum());
    assert_eq!(report.readings.len(), parsed.samples());

    let (values, residual) = fit(recipe, &report.readings);
    assert_eq!(report.values.len(), values.len());
    for (index, (device, host)) in report.values.iter().zip(&values).enumerate() {
        assert!(
            close(*device, *host),
            "value {index}: {device}, on the host {host}"
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
    client: Client,
    reply_timeout: Duration,
}

impl Device {
    /// A device that repeats a request after `reply_timeout`.
    ///
    /// # Errors
    /// If the stream refuses a time-out.
    pub fn new(stream: TcpStream, reply_timeout: Duration) -> io::Result<Self> {
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(Duration::from_millis(1)))?;
        Ok(Self {
            stream,
            client: Client::new(0),
            reply_timeout,
        })
    }

    /// Repeats a request until its reply arrives.
    ///
    /// # Errors
    /// If the stream fails or ends, or there is no reply to a hundred repetitions.
    ///
    /// # Panics
    /// If the request does not fit into a frame.
    pub fn request(&mut self, request: &Request) -> io::Result<Reply> {
        let mut frame = [0; FRAME_BYTES];
        let frame = self
            .client
            .request(request, &mut frame)
            .expect("there is room");
        let mut bytes = [0; 64];
        for _ in 0..100 {
            self.stream.write_all(frame)?;
            let sent = Instant::now();
            while sent.elapsed() < self.reply_timeout {
                let count = match self.stream.read(&mut bytes) {
                    Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                    Ok(count) => count,
                    Err(error) if error.kind() == io::ErrorKind::WouldBlock => continue,
                    Err(error) => return Err(error),
                };
                for byte in &bytes[..count] {
                    if let Some(reply) = self.client.receive(*byte, request) {
                        return Ok(reply);
                    }
                }
            }
        }
        Err(io::ErrorKind::TimedOut.into())
    }

    /// Scans one material, from hello to finished, as core's driver leads it.
    ///
    /// # Errors
    /// If the stream fails or ends, or the driver gives up.
    ///
    /// # Panics
    /// If the recipe is damaged.
    pub fn scan(&mut self, recipe: &[u8]) -> io::Result<()> {
        let recipe = Recipe::parse(recipe).expect("a whole recipe");
        let mut memory = vec![0.0; recipe.memory_words()];
        let scan = Scan::<AnyModel>::new(recipe, &mut memory).expect("there is room");
        let interval = self.reply_timeout.as_millis() as u32;
        let mut config = Config::new(Host::Measures);
        config.retransmit_interval_ms = interval;
        config.reply_timeout_ms = 100 * interval;
        config.measure_timeout_ms = 100 * interval;
        config.steps_per_poll = u32::MAX;
        let mut driver = Driver::new(scan, config);
        let start = Instant::now();
        let mut bytes = [0; 64];
        loop {
            match driver.poll(start.elapsed().as_millis() as u64) {
                Action::Finished(_) => return Ok(()),
                Action::Failed(failure) => return Err(io::Error::other(failure.to_string())),
                _ => {}
            }
            let outgoing = driver.outgoing();
            if !outgoing.is_empty() {
                self.stream.write_all(outgoing)?;
                let count = outgoing.len();
                driver.sent(count);
            }
            match self.stream.read(&mut bytes) {
                Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                Ok(count) => bytes[..count].iter().for_each(|byte| driver.receive(*byte)),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                Err(error) => return Err(error),
            }
        }
    }
}
