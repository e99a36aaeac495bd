//! The material of a module instance, and the buffers that the page shares with it.

use core::fmt::Write;

use glimpse_core::fit::AnyModel;
use glimpse_core::geometry::{Angles, Directions, HalfDifference};
use glimpse_core::gonio::Reading;
use glimpse_core::model::linear::Basis;
use glimpse_core::model::loss::cosine_weighted_log_error;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Fitted, Scan};
use heapless::String;

use crate::buffer::Buffer;
use crate::error::SceneError;
use crate::single_threaded::SingleThreaded;

/// Fit memory for the largest recipe. Unused pages are never touched and take no physical memory.
static MEMORY: SingleThreaded<[f32; 600_000]> = SingleThreaded::new([0.0; 600_000]);

/// Coefficients that select a table's components as channels.
const CHANNELS: [&[f32]; 3] = [&[1.0], &[0.0, 1.0], &[0.0, 0.0, 1.0]];

/// Numbers per reference value of the loss: three angles, three channels.
const REFERENCE_NUMBERS: usize = 6;
/// Numbers per reading: three channels, and 1 for a reading or 0 for a missing one.
const READING_NUMBERS: usize = 4;

/// Indices of the buffers.
const RECIPE: usize = 0;
const BASIS: usize = 1;
const TABLE: usize = 2;
const REFERENCE_VALUES: usize = 3;
const NUMBERS: usize = 4;

/// The state of a module instance.
pub(crate) struct Scene {
    buffers: [Option<Buffer>; 5],
    scan: Option<Scan<'static, AnyModel>>,
    table: Option<Basis<'static>>,
    message: String<400>,
}

/// A BRDF to display.
pub(crate) enum Surface<'a> {
    Fitted(Fitted<'a, AnyModel>),
    Table(&'a Basis<'static>),
}

impl Surface<'_> {
    /// Returns the BRDF in linear RGB, sr^-1, not times the cosine. None below the horizon, or if it is not finite.
    pub(crate) fn brdf(&self, directions: &Directions<f32>) -> Option<[f32; 3]> {
        match self {
            Self::Fitted(fitted) => fitted.brdf(directions),
            Self::Table(table) => {
                table.brdf(CHANNELS, &HalfDifference::from_directions(directions)?)
            }
        }
    }
}

impl Scene {
    pub(crate) const fn new() -> Self {
        Self {
            buffers: [const { None }; 5],
            scan: None,
            table: None,
            message: String::new(),
        }
    }

    /// Allocates buffer `slot` with `bytes` bytes, and reuses its memory if it is large enough.
    pub(crate) fn allocate(&mut self, slot: u32, bytes: usize) -> Option<&mut [u8]> {
        let buffer = self.buffers.get_mut(slot as usize)?;
        let resized = buffer.take().and_then(|buffer| buffer.resized(bytes));
        *buffer = resized.or_else(|| Buffer::new(bytes));
        buffer.as_mut().map(Buffer::bytes)
    }

    /// Makes a call, and stores its error message, if any. Returns 0 on success, 1 on failure.
    pub(crate) fn run(&mut self, call: fn(&mut Self) -> Result<(), SceneError>) -> u32 {
        self.message.clear();
        let Err(error) = call(self) else {
            return 0;
        };
        // A message that is too long is cut.
        let _ = write!(self.message, "{error}");
        1
    }

    pub(crate) fn message(&self) -> &str {
        &self.message
    }

    pub(crate) fn load_recipe(&mut self) -> Result<(), SceneError> {
        let recipe = self.buffers[RECIPE].take().ok_or(SceneError::NoBuffer)?;
        let recipe = Recipe::parse(recipe.into_bytes())?;
        let basis = self.buffers[BASIS].take().map(Buffer::into_bytes);
        let basis = basis.map(Basis::parse).transpose()?;
        let memory = match self.scan.take() {
            Some(scan) => scan.into_memory(),
            None => MEMORY.with(|memory| &mut memory[..]),
        };
        let mut scan = Scan::new(recipe, memory)?;
        if let Some(basis) = basis {
            scan = scan.with_basis(basis)?;
        }
        self.scan = Some(scan);
        Ok(())
    }

    pub(crate) fn load_table(&mut self) -> Result<(), SceneError> {
        let table = self.buffers[TABLE].take().ok_or(SceneError::NoBuffer)?;
        let table = Basis::parse(table.into_bytes())?;
        self.table = Some(table);
        Ok(())
    }

    pub(crate) fn samples(&self) -> usize {
        self.scan.as_ref().map_or(0, |scan| scan.recipe().samples())
    }

    pub(crate) fn fit(&mut self) -> Result<(), SceneError> {
        let scan = self.scan.as_mut().ok_or(SceneError::NoScan)?;
        let samples = scan.recipe().samples();
        let readings = self.buffers[NUMBERS].as_mut().map(Buffer::numbers);
        let readings = readings.and_then(|numbers| numbers.get(..READING_NUMBERS * samples));
        let (readings, _) = readings
            .ok_or(SceneError::NoBuffer)?
            .as_chunks::<READING_NUMBERS>();
        scan.restart();
        for (index, &[red, green, blue, is_present]) in (0..).zip(readings) {
            if is_present != 0.0 {
                scan.record(index, Reading::new([red, green, blue]))?;
            }
        }
        let mut fit = scan.fit()?;
        fit.advance(u32::MAX);
        match fit.finish() {
            // The page also displays implausible fits.
            Err(error) if !error.is_implausible() => Err(error.into()),
            _ => Ok(()),
        }
    }

    pub(crate) fn values(&mut self) -> usize {
        let fitted = self.scan.as_ref().and_then(Scan::fitted);
        let (Some(fitted), Some(buffer)) = (fitted, self.buffers[NUMBERS].as_mut()) else {
            return 0;
        };
        let numbers = buffer.numbers();
        let count = fitted.values().count();
        if count > numbers.len() {
            return 0;
        }
        for (number, value) in numbers.iter_mut().zip(fitted.values()) {
            *number = value;
        }
        count
    }

    /// Returns the fit, if there is one.
    pub(crate) fn fitted(&self) -> Option<Fitted<'_, AnyModel>> {
        self.scan.as_ref()?.fitted()
    }

    pub(crate) fn loss(&mut self) -> f64 {
        let numbers = self.buffers[REFERENCE_VALUES].as_mut().map(Buffer::numbers);
        let numbers = numbers.unwrap_or_default();
        let (reference_values, _) = numbers.as_chunks::<REFERENCE_NUMBERS>();
        let Some(surface) = surface(self.scan.as_ref(), self.table.as_ref()) else {
            return f64::NAN;
        };
        let mut sum = 0.0;
        for &[theta_h, theta_d, phi_d, red, green, blue] in reference_values {
            let at = HalfDifference::from_angles(Angles::from_array([theta_h, theta_d, phi_d]));
            // The page shows no loss of a BRDF that is not finite.
            let Some(modeled) = surface.brdf(&at.directions()) else {
                return f64::NAN;
            };
            let cosine = at.cos_theta_i();
            let error = cosine_weighted_log_error([red, green, blue], modeled, cosine, 1.0);
            sum += f64::from(error.error.value());
        }
        match reference_values.len() {
            0 => f64::NAN,
            count => sum / (3 * count) as f64,
        }
    }

    pub(crate) fn brdf_at_samples(&mut self) -> usize {
        let samples = self.samples();
        let Some(recipe) = self.scan.as_ref().map(|scan| *scan.recipe()) else {
            return 0;
        };
        let mut pattern = recipe.directions().map(|(_, directions)| directions);
        let is_done = self.with_surface(3 * samples, |surface, numbers| {
            for (value, directions) in numbers.iter_mut().zip(&mut pattern) {
                *value = surface.brdf(&directions).unwrap_or_default();
            }
        });
        if is_done { samples } else { 0 }
    }

    /// Passes the displayed surface and `count` numbers of the result buffer, in groups of three, to `f`. Returns false
    /// without a surface, or if the buffer is too small.
    pub(crate) fn with_surface(
        &mut self,
        count: usize,
        f: impl FnOnce(&Surface<'_>, &mut [[f32; 3]]),
    ) -> bool {
        let numbers = self.buffers[NUMBERS].as_mut().map(Buffer::numbers);
        let numbers = numbers.and_then(|numbers| numbers.get_mut(..count));
        let (Some(numbers), Some(surface)) =
            (numbers, surface(self.scan.as_ref(), self.table.as_ref()))
        else {
            return false;
        };
        f(&surface, numbers.as_chunks_mut().0);
        true
    }
}

/// Returns the surface to display: the table, or else the fit.
fn surface<'a>(
    scan: Option<&'a Scan<'static, AnyModel>>,
    table: Option<&'a Basis<'static>>,
) -> Option<Surface<'a>> {
    match table {
        Some(table) => Some(Surface::Table(table)),
        None => scan?.fitted().map(Surface::Fitted),
    }
}
