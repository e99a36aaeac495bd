//! A device simulated on the host, for tests of the scanner and as a reference for the firmware.

use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::fit::AnyModel;
use glimpse_core::gonio::Reading;
use glimpse_core::link::{DeviceEnd, FRAME_BYTES, Purpose, Reply, Request};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Residual, Scan};
use glimpse_fitting::scanner::{ScanReading, ScanReport};

/// Fits readings with a recipe, as the firmware does. Returns the values and the residual.
///
/// # Panics
/// If the recipe is damaged or does not belong to the readings.
#[must_use]
pub fn fit(recipe: &[u8], readings: &[ScanReading]) -> (Vec<f32>, Residual) {
    let recipe = Recipe::parse(recipe).expect("the recipe is valid");
    let mut memory = vec![0.0; recipe.memory_words()];
    let mut scan = Scan::<AnyModel>::new(recipe, &mut memory).expect("the buffer is large enough");
    for reading in readings {
        let next = scan.next_pending();
        let (index, directions) = next.expect("the scan has a sample for each reading");
        assert_eq!(directions, reading.directions);
        scan.record(index, reading.reading)
            .expect("the reading is valid");
    }
    let mut fit = scan.fit().expect("the scan has enough readings");
    while !fit.advance(u32::MAX).is_complete() {}
    if let Err(error) = fit.finish() {
        assert!(error.is_implausible(), "{error}");
    }
    let fitted = scan.fitted().expect("the fit is finished");
    (fitted.values().collect(), fitted.residual())
}

/// Checks that the device's result has the bits of the host's fit of the same readings.
///
/// # Panics
/// If it does not.
pub fn assert_matches_host(report: &ScanReport, recipe: &[u8]) {
    let (values, residual) = fit(recipe, &report.readings);
    let recipe = Recipe::parse(recipe).expect("the recipe is valid");
    assert_eq!(report.recipe, recipe.checksum());
    assert_eq!(report.readings.len(), recipe.samples());
    let model = recipe.model();
    assert_eq!(bits(&report.values), bits(&values), "{model}");
    // The host's fit has no evidence of a scan.
    let evidence = report.residual.evidence;
    let residual = Residual {
        evidence,
        ..residual
    };
    assert_eq!(report.residual, residual, "{model}");
}

/// Returns the bits of numbers, for comparison.
#[must_use]
pub fn bits(numbers: &[f32]) -> Vec<u32> {
    numbers.iter().map(|number| number.to_bits()).collect()
}

/// The reading of a device that measures.
pub const OWN_READING: [f32; 3] = [0.3, 0.2, 0.1];

/// A device that is connected by a stream.
#[derive(Debug)]
pub struct Device {
    stream: TcpStream,
    end: DeviceEnd,
    reply_timeout: Duration,
}

impl Device {
    /// A device that repeats a request after `reply_timeout`.
    ///
    /// # Errors
    /// If the stream does not support timeouts.
    pub fn new(stream: TcpStream, reply_timeout: Duration) -> io::Result<Self> {
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(Duration::from_millis(1)))?;
        Ok(Self {
            stream,
            end: DeviceEnd::new(0),
            reply_timeout,
        })
    }

    /// Repeats a request until its reply arrives.
    ///
    /// # Errors
    /// If the stream fails or ends, or 100 repetitions get no reply.
    ///
    /// # Panics
    /// If the request does not fit into a frame.
    pub fn request(&mut self, request: &Request) -> io::Result<Reply> {
        let mut frame = [0; FRAME_BYTES];
        let frame = self
            .end
            .request(request, &mut frame)
            .expect("the buffer is large enough");
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
                    if let Some(reply) = self.end.receive(*byte, request) {
                        return Ok(reply);
                    }
                }
            }
        }
        Err(io::ErrorKind::TimedOut.into())
    }

    /// Scans one material with core's driver, from hello to the end of the scan. If the host does not measure, the device
    /// reads the BRDF [`OWN_READING`] everywhere.
    ///
    /// # Errors
    /// If the stream fails or ends, or the driver gives up.
    ///
    /// # Panics
    /// If the recipe is damaged.
    pub fn scan(&mut self, recipe: &[u8], host: Host) -> io::Result<()> {
        let recipe = Recipe::parse(recipe).expect("the recipe is valid");
        let mut memory = vec![0.0; recipe.memory_words()];
        let scan = Scan::<AnyModel>::new(recipe, &mut memory).expect("the buffer is large enough");
        let interval = self.reply_timeout.as_millis() as u32;
        let mut config = Config::new(host);
        config.retransmit_interval_ms = interval;
        config.reply_timeout_ms = 100 * interval;
        config.measure_timeout_ms = 100 * interval;
        config.steps_per_poll = u32::MAX;
        let mut driver = Driver::new(scan, config);
        let start = Instant::now();
        let mut bytes = [0; 64];
        loop {
            match driver.poll(start.elapsed().as_millis() as u64) {
                Action::Forget => return Ok(()), // the host has the result
                Action::Measure { purpose, index, .. } => {
                    let brdf = match purpose {
                        Purpose::Dark => [0.0; 3],
                        Purpose::Sample | Purpose::Again => OWN_READING,
                    };
                    let recorded = driver.record(index, Reading::new(brdf));
                    recorded.map_err(|error| io::Error::other(error.to_string()))?;
                }
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
