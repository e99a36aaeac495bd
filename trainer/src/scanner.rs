//! A virtual scanner: motors and sensor, played from a material, over the firmware's link.
//!
//! It is the host's side of [`glimpse_core::link`], on any stream of bytes.

use std::collections::BTreeMap;
use std::io::{self, Read, Write};

use glimpse_core::geometry::{Angles, Directions, HalfDifference};
use glimpse_core::link::{
    FRAME_BYTES, FailureReport, FrameError, PROTOCOL, Received, RecipeBytes, Refusal, Reply,
    Request, Server,
};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Reading, Residual};
use glimpse_materials::basis::Basis;
use glimpse_materials::loss::{directions, mean_log_error};
use glimpse_materials::{Fitted, Material};
use glimpse_training::meta::start::standard_normal;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Why a scan did not come to its end. The next one may.
#[derive(Debug, thiserror::Error)]
pub enum ScannerError {
    /// The stream fails.
    #[error("the link to the device fails: {0}")]
    Link(#[from] io::Error),
    /// The stream ended.
    #[error("the device hung up")]
    Closed,
    /// The device gave up.
    #[error("the device gave up: {0}")]
    Device(#[from] FailureReport),
    /// The device speaks another version of the protocol.
    #[error("the device speaks version {0} of the protocol, this host version {PROTOCOL}")]
    Protocol(u16),
    /// A reply does not fit into a frame.
    #[error(transparent)]
    Frame(#[from] FrameError),
}

/// How the scanner errs.
#[derive(Clone, Copy, Debug, Default)]
pub struct ScannerNoise {
    /// Standard deviation of Gaussian noise on each channel, relative to its value.
    pub deviation: f32,
    /// Seed of the noise.
    pub seed: u64,
}

/// One reading that was asked for and given.
#[derive(Clone, Copy, Debug)]
pub struct Taken {
    /// Where.
    pub directions: Directions<f32>,
    /// The same as angles in radians.
    pub angles: Angles<f32>,
    /// What.
    pub reading: Reading,
}

/// A completed scan, as the device told it.
#[derive(Clone, Debug)]
pub struct ScanReport {
    /// The model that was fitted.
    pub model: ModelKind,
    /// The checksum of the recipe that it was fitted by.
    pub recipe: u32,
    /// What was read, in the order of the recipe's pattern.
    pub readings: Vec<Taken>,
    /// The fitted values: a model's parameters in its order, or Linear's coefficients, m for red, m
    /// for green, m for blue.
    pub values: Vec<f32>,
    /// How well they explain the readings.
    pub residual: Residual,
}

impl ScanReport {
    /// What the device has found, as a BRDF. Of Linear the basis of its recipe makes one: None
    /// without it.
    #[must_use]
    pub fn fitted(&self, basis: Option<&Basis>) -> Option<Fitted> {
        Fitted::new(self.model, self.values.clone(), basis)
    }

    /// The loss of that BRDF against a material, over the same directions as `trainer evaluate` takes.
    #[must_use]
    pub fn loss(&self, basis: Option<&Basis>, material: &dyn Material) -> Option<f64> {
        let fitted = self.fitted(basis)?;
        let at: Vec<_> = directions()
            .into_iter()
            .map(HalfDifference::from_angles)
            .collect();
        let mut reference = vec![[0.0; 3]; at.len()];
        material.brdf_batch(&at, &mut reference);
        Some(mean_log_error(&fitted, &at, &reference))
    }
}

/// The angles of a pair of directions, phi_d in \[0, 2 pi). None if they have no half vector or
/// one of them is below the horizon.
#[must_use]
pub fn angles_of(directions: &Directions<f32>) -> Option<Angles<f32>> {
    let at = HalfDifference::from_directions(directions).filter(HalfDifference::is_valid)?;
    Some(glimpse_materials::angles_of(&at))
}

/// What is known of the scan under way.
#[derive(Debug)]
struct Scanning {
    model: ModelKind,
    recipe: u32,
    /// What was read, by index.
    readings: BTreeMap<u16, Taken>,
    /// What was read by the same recipe before the device said hello once more: it may have
    /// been reset, and have kept this.
    before: BTreeMap<u16, Taken>,
    values: Vec<f32>,
    /// How many values the device said that there are.
    total: u16,
}

impl Scanning {
    /// All that was read, in this scan and before it.
    fn all(mut self) -> BTreeMap<u16, Taken> {
        self.before.append(&mut self.readings);
        self.before
    }

    /// Takes some of the values; what comes once more replaces what came before.
    fn receive(&mut self, offset: u16, total: u16, values: &[f32]) -> Reply {
        let begin = usize::from(offset);
        let possible = self
            .model
            .parameters()
            .map_or(total.is_multiple_of(3), |all| all == usize::from(total));
        if !possible || begin > self.values.len() || begin + values.len() > usize::from(total) {
            return Reply::Refused(Refusal::Values);
        }
        self.values.truncate(begin);
        self.values.extend_from_slice(values);
        self.total = total;
        Reply::Accepted
    }

    /// All values came.
    fn is_told(&self) -> bool {
        self.total > 0 && self.values.len() == usize::from(self.total)
    }

    /// Takes over a reading that the device has kept, if it is the one that was given to it.
    fn keep(&mut self, index: u16, reading: Reading) -> Reply {
        let bits = |reading: Reading| reading.brdf.map(f32::to_bits);
        match self.before.get(&index) {
            Some(taken)
                if bits(taken.reading) == bits(reading)
                    && taken.reading.saturated == reading.saturated =>
            {
                self.readings.insert(index, *taken);
                Reply::Accepted
            }
            _ => Reply::Refused(Refusal::Saved),
        }
    }
}

/// What becomes of a scan by a request.
enum Outcome {
    GoesOn,
    Ends(ScanReport),
    Fails(ScannerError),
}

/// Plays a scanner in front of one material.
pub struct VirtualScanner<'a> {
    material: &'a dyn Material,
    noise: ScannerNoise,
    server: Server,
    scan: Option<Scanning>,
    scans: u64,
    recipe: Option<Vec<u8>>,
}

impl<'a> VirtualScanner<'a> {
    /// In front of `material`.
    #[must_use]
    pub fn new(material: &'a dyn Material, noise: ScannerNoise) -> Self {
        Self {
            material,
            noise,
            server: Server::new(),
            scan: None,
            scans: 0,
            recipe: None,
        }
    }

    /// Offers a recipe to devices that can store one.
    #[must_use]
    pub fn offering(self, recipe: Vec<u8>) -> Self {
        let recipe = Some(recipe);
        Self { recipe, ..self }
    }

    /// Serves a device until it has completed one scan. Call again for the next.
    ///
    /// # Errors
    /// If the device gives up, speaks another protocol or hangs up, or the stream fails.
    pub fn serve(&mut self, stream: &mut (impl Read + Write)) -> Result<ScanReport, ScannerError> {
        let mut frame = [0; FRAME_BYTES];
        let mut bytes = [0; 512];
        loop {
            let count = match stream.read(&mut bytes) {
                Ok(0) => return Err(ScannerError::Closed),
                Ok(count) => count,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) => return Err(error.into()),
            };
            // What follows a request in the same bytes can only be the request once more.
            for byte in &bytes[..count] {
                let (reply, outcome) = match self.server.receive(*byte) {
                    Some(Ok(Received::New(request))) => self.reply(request),
                    Some(Ok(Received::Duplicate(reply))) => (reply, Outcome::GoesOn),
                    // No request takes time here, so none is pending; the device repeats damaged ones.
                    Some(Ok(_) | Err(_)) | None => continue,
                };
                stream.write_all(self.server.reply(reply, &mut frame)?)?;
                stream.flush()?;
                match outcome {
                    Outcome::GoesOn => {}
                    Outcome::Ends(report) => return Ok(report),
                    Outcome::Fails(error) => return Err(error),
                }
            }
        }
    }

    fn reply(&mut self, request: Request) -> (Reply, Outcome) {
        let reply = match (request, &mut self.scan) {
            (Request::Hello { protocol, .. }, _) if protocol != PROTOCOL => {
                let welcome = Reply::Welcome { protocol: PROTOCOL };
                return (welcome, Outcome::Fails(ScannerError::Protocol(protocol)));
            }
            (Request::Hello { model, recipe, .. }, scan) => {
                self.scans += 1;
                let before = scan.take().filter(|scan| scan.recipe == recipe);
                *scan = Some(Scanning {
                    model,
                    recipe,
                    readings: BTreeMap::new(),
                    before: before.map(Scanning::all).unwrap_or_default(),
                    values: Vec::new(),
                    total: 0,
                });
                Reply::Welcome { protocol: PROTOCOL }
            }
            (Request::Failed(report), _) => {
                self.scan = None;
                return (Reply::Accepted, Outcome::Fails(report.into()));
            }
            (_, None) => Reply::Refused(Refusal::NoScan),
            (Request::Saved { index, reading }, Some(scan)) => scan.keep(index, reading),
            (Request::Measure { index, directions }, Some(_)) => self.measure(index, directions),
            (Request::Progress(_), Some(_)) => Reply::Accepted,
            (
                Request::Values {
                    offset,
                    total,
                    values,
                },
                Some(scan),
            ) => scan.receive(offset, total, values.as_slice()),
            (Request::Finished(residual), Some(scan)) => {
                if scan.is_told() {
                    let report = ScanReport {
                        model: scan.model,
                        recipe: scan.recipe,
                        readings: scan.readings.values().copied().collect(),
                        values: std::mem::take(&mut scan.values),
                        residual,
                    };
                    self.scan = None;
                    return (Reply::Accepted, Outcome::Ends(report));
                }
                Reply::Refused(Refusal::Values)
            }
            (Request::Update, Some(_)) => self.offer(),
            (Request::RecipePart { offset }, Some(_)) => self.part(offset),
            (_, Some(_)) => Reply::Refused(Refusal::Request),
        };
        (reply, Outcome::GoesOn)
    }

    /// The recipe that is offered, if there is one.
    fn offer(&self) -> Reply {
        let recipe = self.recipe.as_deref().unwrap_or_default();
        match Recipe::parse(recipe) {
            Ok(parsed) => Reply::Recipe {
                bytes: recipe.len() as u32,
                checksum: parsed.checksum(),
            },
            Err(_) => Reply::Accepted,
        }
    }

    /// The bytes of that recipe from `offset` on.
    fn part(&self, offset: u32) -> Reply {
        let rest = self.recipe.iter().flatten().skip(offset as usize);
        let bytes = RecipeBytes::take_from(rest.copied());
        Reply::RecipePart { offset, bytes }
    }

    fn measure(&mut self, index: u16, directions: Directions<f32>) -> Reply {
        let Some(angles) = angles_of(&directions) else {
            return Reply::Refused(Refusal::Directions);
        };
        // The same noise however often this reading of this scan is taken.
        let mut random = ChaCha8Rng::seed_from_u64(self.noise.seed);
        random.set_stream(self.scans << 16 | u64::from(index));
        let reading = Reading {
            brdf: self.material.brdf(angles).map(|f| {
                (f * (1.0 + self.noise.deviation * standard_normal(&mut random))).max(0.0)
            }),
            saturated: false,
        };
        let taken = Taken {
            directions,
            angles,
            reading,
        };
        if let Some(scan) = &mut self.scan {
            scan.readings.insert(index, taken);
        }
        Reply::Measured { index, reading }
    }
}
