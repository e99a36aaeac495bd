//! A virtual scanner: a host that serves the firmware with simulated readings of a material instead of motors and a
//! sensor.
//!
//! It implements the host's side of [`glimpse_core::link`] on any byte stream.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Read, Write};
use std::path::Path;

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::geometry::{Angles, Directions, HalfDifference};
use glimpse_core::gonio::Reading;
use glimpse_core::link::{FRAME_BYTES, HostEnd, PROTOCOL, Purpose, Reply, Request};
use glimpse_core::model::ModelKind;
use glimpse_core::scan::Residual;
use glimpse_materials::basis::BasisTable;
use glimpse_materials::loss::loss_between;
use glimpse_materials::sampling::random_stream;
use glimpse_materials::{FittedBrdf, FittedMaterial, Material};
use serde::Serialize;
use serde_json::json;

use crate::measurement::{MaterialFiles, material_files};
use crate::recipe::ReadingNoise;

/// An error that aborts a scan. The next scan may succeed.
#[derive(Debug, thiserror::Error)]
pub enum ScannerError {
    /// The stream failed.
    #[error("the link to the device failed: {0}")]
    Link(#[from] io::Error),
    /// The stream ended.
    #[error("the device closed the connection; restart the device")]
    Closed,
    /// The device aborted the scan.
    #[error("the device aborted the scan: {0}")]
    Device(Error),
    /// The device speaks another version of the protocol.
    #[error(
        "the device speaks protocol version {0}, but this host speaks {PROTOCOL}; use firmware and trainer of the same \
         release"
    )]
    Protocol(u16),
}

/// One reading that the device requested.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ScanReading {
    /// The directions of light and sensor.
    #[serde(skip)]
    pub directions: Directions<f32>,
    /// The same directions as Rusinkiewicz angles, in radians.
    #[serde(flatten)]
    pub angles: Angles<f32>,
    /// The simulated reading.
    #[serde(flatten)]
    pub reading: Reading,
}

/// A completed scan, as the device reported it.
#[derive(Clone, Debug)]
pub struct ScanReport {
    /// The fitted model.
    pub model: ModelKind,
    /// The checksum of the recipe.
    pub recipe: u32,
    /// The readings, in the order of the recipe's pattern.
    pub readings: Vec<ScanReading>,
    /// The fitted values: the model's parameters in its order. For Linear, they are the coefficients: m for red, then m
    /// for green, then m for blue, with m components.
    pub values: Vec<f32>,
    /// The residual at the readings.
    pub residual: Residual,
}

impl ScanReport {
    /// Returns the fitted BRDF. Linear needs the recipe's basis; None without it.
    #[must_use]
    pub fn fitted(&self, basis: Option<&BasisTable>) -> Option<FittedBrdf> {
        FittedBrdf::new(self.model, self.values.clone(), basis)
    }

    /// Returns the material's file, with the readings and their residual, and for Linear the file of the basis next to
    /// it. `loss` is the loss against the scanned material. None if the values do not match the model or its basis.
    #[must_use]
    pub fn material_files(
        &self,
        path: &Path,
        name: &str,
        basis: Option<&BasisTable>,
        loss: Option<f64>,
    ) -> Option<MaterialFiles> {
        let material = FittedMaterial::new(name.to_owned(), self.fitted(basis)?)?;
        let metadata = json!({
            "recipe": { "checksum": format!("{:08x}", self.recipe) },
            "scanned": self.readings,
            "residual": self.residual,
            "loss": loss,
        });
        material_files(&material, path, basis, metadata).ok()
    }

    /// Returns the loss of the fitted BRDF against a material, over the directions of `trainer evaluate`.
    #[must_use]
    pub fn loss(&self, basis: Option<&BasisTable>, material: &dyn Material) -> Option<f64> {
        Some(loss_between(&self.fitted(basis)?, material))
    }
}

/// Returns the Rusinkiewicz angles of a pair of directions, phi_d in \[0, 2 pi). None if the half vector is undefined or
/// one direction is below the horizon.
#[must_use]
pub fn angles_of(directions: &Directions<f32>) -> Option<Angles<f32>> {
    let at = HalfDifference::from_directions(directions).filter(HalfDifference::is_valid)?;
    Some(glimpse_materials::angles_of(&at))
}

/// The state of a scan in progress.
#[derive(Debug)]
struct ScanState {
    model: ModelKind,
    recipe: u32,
    /// The readings by sample index, also those of the same recipe before the device's latest hello. The device may have
    /// saved them across a reset.
    readings: BTreeMap<u16, ScanReading>,
    /// The samples of this scan.
    samples: BTreeSet<u16>,
    values: Vec<f32>,
    /// The total number of values, as stated by the device.
    total: u16,
}

impl ScanState {
    /// Receives some of the values. Repeated values replace earlier ones.
    fn receive(&mut self, offset: u16, total: u16, values: &[f32]) -> Reply {
        let begin = usize::from(offset);
        let is_valid_total = self
            .model
            .parameters()
            .map_or(total.is_multiple_of(3), |all| all == usize::from(total));
        if !is_valid_total || begin > self.values.len() || begin + values.len() > usize::from(total)
        {
            return Reply::Refused(ErrorCode::RefusedValues);
        }
        self.values.truncate(begin);
        self.values.extend_from_slice(values);
        self.total = total;
        Reply::Accepted
    }

    /// Accepts a reading that the device saved, if it equals the reading that the device received before its hello.
    fn accept_restored(&mut self, index: u16, reading: Reading) -> Reply {
        let bits = |reading: Reading| (reading.brdf.map(f32::to_bits), reading.saturated);
        let received = self.readings.get(&index);
        let is_same = received.is_some_and(|received| bits(received.reading) == bits(reading));
        // Samples of this scan were read after the hello.
        if is_same && self.samples.insert(index) {
            Reply::Accepted
        } else {
            Reply::Refused(ErrorCode::RefusedRestored)
        }
    }
}

/// A virtual scanner that measures one material, or only receives the results of devices that measure themselves.
pub struct VirtualScanner<'a> {
    material: Option<&'a dyn Material>,
    noise: ReadingNoise,
    /// The seed of the noise.
    seed: u64,
    end: HostEnd,
    scan: Option<ScanState>,
    /// The number of scans that devices have started.
    scan_count: u64,
}

impl<'a> VirtualScanner<'a> {
    /// Creates a scanner that measures `material` with noise that depends on a seed, or without a material a host of devices
    /// that measure themselves.
    #[must_use]
    pub fn new(material: Option<&'a dyn Material>, noise: ReadingNoise, seed: u64) -> Self {
        Self {
            material,
            noise,
            seed,
            end: HostEnd::default(),
            scan: None,
            scan_count: 0,
        }
    }

    /// Returns a reading by its index in the scan; None without a material. A repeated reading has the same noise.
    #[must_use]
    pub fn read(&self, index: u16, angles: Angles<f32>) -> Option<Reading> {
        let material = self.material?;
        let mut random = random_stream(self.seed, self.scan_count << 16 | u64::from(index));
        let cos_theta_i = HalfDifference::from_angles(angles).cos_theta_i();
        let brdf = material.at_angles(angles);
        let brdf = self.noise.read(brdf, cos_theta_i, &mut random);
        Some(Reading::new(brdf.map(|value| value.max(0.0))))
    }

    /// Serves a device until one scan is complete. Call again for the next scan.
    ///
    /// # Errors
    /// If the device aborts the scan, speaks another protocol version or closes the connection, or the stream fails.
    pub fn serve(&mut self, stream: &mut (impl Read + Write)) -> Result<ScanReport, ScannerError> {
        let mut frame = [0; FRAME_BYTES];
        let mut byte = [0];
        loop {
            stream
                .read_exact(&mut byte)
                .map_err(|error| match error.kind() {
                    io::ErrorKind::UnexpectedEof => ScannerError::Closed,
                    _ => error.into(),
                })?;
            let mut outcome = None;
            let mut end = std::mem::take(&mut self.end);
            let reply = end.answer(byte[0], &mut frame, |request| {
                let reply;
                (reply, outcome) = self.handle_request(request);
                Some(reply)
            });
            self.end = end;
            if let Some(reply) = reply {
                stream.write_all(reply)?;
                stream.flush()?;
            }
            if let Some(outcome) = outcome {
                return outcome;
            }
        }
    }

    /// Handles a request. Returns the reply, and the result of a scan that has ended.
    fn handle_request(
        &mut self,
        request: Request,
    ) -> (Reply, Option<Result<ScanReport, ScannerError>>) {
        let welcome = Reply::Welcome { protocol: PROTOCOL };
        match request {
            Request::Hello { protocol, .. } if protocol != PROTOCOL => {
                return (welcome, Some(Err(ScannerError::Protocol(protocol))));
            }
            Request::Hello { model, recipe, .. } => {
                self.scan_count += 1;
                let previous = self.scan.take().filter(|scan| scan.recipe == recipe);
                self.scan = Some(ScanState {
                    model,
                    recipe,
                    readings: previous.map_or_else(BTreeMap::new, |scan| scan.readings),
                    samples: BTreeSet::new(),
                    values: Vec::new(),
                    total: 0,
                });
                return (welcome, None);
            }
            Request::Failed(report) => {
                self.scan = None;
                return (Reply::Accepted, Some(Err(ScannerError::Device(report))));
            }
            _ => {}
        }
        let Some(scan) = &mut self.scan else {
            return (Reply::Refused(ErrorCode::RefusedNoScan), None);
        };
        let reply = match request {
            Request::Restored { index, reading } => scan.accept_restored(index, reading),
            Request::Measure {
                purpose,
                index,
                directions,
            } => self.measure(purpose, index, directions),
            Request::Progress(_) => Reply::Accepted,
            Request::Values {
                offset,
                total,
                values,
            } => scan.receive(offset, total, &values),
            Request::Finished(residual) => {
                if scan.total > 0 && scan.values.len() == usize::from(scan.total) {
                    let samples = scan.samples.iter();
                    let report = ScanReport {
                        model: scan.model,
                        recipe: scan.recipe,
                        readings: samples.map(|index| scan.readings[index]).collect(),
                        values: std::mem::take(&mut scan.values),
                        residual,
                    };
                    self.scan = None;
                    return (Reply::Accepted, Some(Ok(report)));
                }
                Reply::Refused(ErrorCode::RefusedValues)
            }
            _ => Reply::Refused(ErrorCode::RefusedRequest),
        };
        (reply, None)
    }

    fn measure(&mut self, purpose: Purpose, index: u16, directions: Directions<f32>) -> Reply {
        let Some(angles) = angles_of(&directions) else {
            return Reply::Refused(ErrorCode::RefusedDirections);
        };
        let Some(reading) = self.read(index, angles) else {
            return Reply::Refused(ErrorCode::RefusedRequest);
        };
        if purpose == Purpose::Dark {
            let reading = Reading::new([0.0; 3]);
            return Reply::Measured { index, reading };
        }
        let scan_reading = ScanReading {
            directions,
            angles,
            reading,
        };
        if let Some(scan) = &mut self.scan {
            scan.readings.insert(index, scan_reading);
            scan.samples.insert(index);
        }
        Reply::Measured { index, reading }
    }
}
