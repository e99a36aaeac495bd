//! The material that an instance stands for, and the rooms that a page shares with it.

use core::fmt::Write;

use glimpse_core::fit::AnyModel;
use glimpse_core::geometry::{Angles, Directions, HalfDifference};
use glimpse_core::model::linear::Basis;
use glimpse_core::model::loss::cosine_weighted_log_error;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{FinishError, Fitted, Reading, Scan};
use heapless::String;

use crate::error::SceneError;
use crate::room::Room;
use crate::single::Single;

/// The largest recipe has room; what of it is not used is never touched, and takes no memory.
static MEMORY: Single<[f32; 600_000]> = Single::new([0.0; 600_000]);

/// The coefficients that make a table's components channels.
const CHANNELS: [&[f32]; 3] = [&[1.0], &[0.0, 1.0], &[0.0, 0.0, 1.0]];

/// Numbers of a direction that a loss is judged at: three angles, three channels.
const JUDGED: usize = 6;
/// Numbers of a reading: three channels, and whether it is there.
const READING: usize = 4;

/// Rooms, by their numbers.
const RECIPE: usize = 0;
const BASIS: usize = 1;
const TABLE: usize = 2;
const JUDGE: usize = 3;
const NUMBERS: usize = 4;

/// A material, and what is needed to change it.
pub(crate) struct Scene {
    rooms: [Option<Room>; 5],
    scan: Option<Scan<'static, AnyModel>>,
    table: Option<Basis<'static>>,
    message: String<400>,
}

/// A material that can be looked at.
pub(crate) enum Shown<'a> {
    Fitted(Fitted<'a, AnyModel>),
    Table(&'a Basis<'static>),
}

impl Shown<'_> {
    /// The BRDF in linear RGB, sr^-1, not times the cosine; 0 below the horizon.
    pub(crate) fn brdf(&self, directions: &Directions<f32>) -> [f32; 3] {
        let found = match self {
            Self::Fitted(fitted) => fitted.brdf(directions),
            Self::Table(table) => {
                HalfDifference::from_directions(directions).and_then(|at| table.brdf(CHANNELS, &at))
            }
        };
        found.unwrap_or_default()
    }
}

impl Scene {
    pub(crate) const fn new() -> Self {
        Self {
            rooms: [const { None }; 5],
            scan: None,
            table: None,
            message: String::new(),
        }
    }

    /// Room for so many bytes.
    pub(crate) fn room(&mut self, slot: u32, bytes: usize) -> Option<&mut [u8]> {
        let place = self.rooms.get_mut(slot as usize)?;
        let again = place.take().and_then(|room| room.again(bytes));
        *place = again.or_else(|| Room::new(bytes));
        place.as_mut().map(Room::bytes)
    }

    /// Keeps what went wrong as a sentence, and says whether something did.
    pub(crate) fn told(&mut self, outcome: Result<(), SceneError>) -> u32 {
        self.message.clear();
        let Err(error) = outcome else {
            return 0;
        };
        // A sentence that is too long is cut.
        let _ = write!(self.message, "{error}");
        1
    }

    pub(crate) fn message(&self) -> &str {
        &self.message
    }

    pub(crate) fn begin(&mut self) -> Result<(), SceneError> {
        let recipe = self.rooms[RECIPE].take().ok_or(SceneError::NoRoom)?;
        let recipe = Recipe::parse(recipe.into_bytes())?;
        let basis = self.rooms[BASIS].take().map(Room::into_bytes);
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

    pub(crate) fn look_at_table(&mut self) -> Result<(), SceneError> {
        let table = self.rooms[TABLE].take().ok_or(SceneError::NoRoom)?;
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
        let readings = self.rooms[NUMBERS].as_mut().map(Room::numbers);
        let readings = readings.and_then(|numbers| numbers.get(..READING * samples));
        let (readings, _) = readings.ok_or(SceneError::NoRoom)?.as_chunks::<READING>();
        scan.restart();
        for (index, &[red, green, blue, is_there]) in (0..).zip(readings) {
            if is_there != 0.0 {
                scan.record(index, Reading::new([red, green, blue]))?;
            }
        }
        let mut fit = scan.fit()?;
        fit.advance(u32::MAX);
        match fit.finish() {
            // The page shows an implausible fit too.
            Ok(_) | Err(FinishError::Implausible(_)) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }

    pub(crate) fn values(&mut self) -> usize {
        let fitted = self.scan.as_ref().and_then(Scan::fitted);
        let (Some(fitted), Some(room)) = (fitted, self.rooms[NUMBERS].as_mut()) else {
            return 0;
        };
        let places = room.numbers();
        let count = fitted.values().count();
        if count > places.len() {
            return 0;
        }
        for (place, value) in places.iter_mut().zip(fitted.values()) {
            *place = value;
        }
        count
    }

    pub(crate) fn predicted_loss(&self) -> f32 {
        let fitted = self.scan.as_ref().and_then(Scan::fitted);
        let predicted = fitted.and_then(|fitted| fitted.predicted_loss());
        predicted.unwrap_or(f32::NAN)
    }

    pub(crate) fn residual(&self) -> f32 {
        let fitted = self.scan.as_ref().and_then(Scan::fitted);
        fitted.map_or(f32::NAN, |fitted| fitted.residual().mean)
    }

    pub(crate) fn loss(&mut self) -> f64 {
        let judge = self.rooms[JUDGE].as_mut().map(Room::numbers);
        let judge = judge.unwrap_or_default();
        let (judged, _) = judge.as_chunks::<JUDGED>();
        let Some(shown) = shown(self.scan.as_ref(), self.table.as_ref()) else {
            return f64::NAN;
        };
        let mut sum = 0.0;
        for &[theta_h, theta_d, phi_d, red, green, blue] in judged {
            let at = HalfDifference::from_angles(Angles {
                theta_h,
                theta_d,
                phi_d,
            });
            let modeled = shown.brdf(&at.directions());
            let cosine = at.cos_theta_i();
            let error = cosine_weighted_log_error([red, green, blue], modeled, cosine, 1.0);
            sum += f64::from(error.error.value());
        }
        match judged.len() {
            0 => f64::NAN,
            count => sum / (3 * count) as f64,
        }
    }

    pub(crate) fn at_samples(&mut self) -> usize {
        let samples = self.samples();
        let Some(recipe) = self.scan.as_ref().map(|scan| *scan.recipe()) else {
            return 0;
        };
        let mut places = recipe.directions().map(|(_, directions)| directions);
        let is_done = self.draw(3 * samples, |shown, numbers| {
            for (place, directions) in numbers.iter_mut().zip(&mut places) {
                *place = shown.brdf(&directions);
            }
        });
        if is_done { samples } else { 0 }
    }

    /// Goes on with the material, if there is one, and room for so many numbers, by threes.
    pub(crate) fn draw(
        &mut self,
        count: usize,
        go_on: impl FnOnce(&Shown<'_>, &mut [[f32; 3]]),
    ) -> bool {
        let numbers = self.rooms[NUMBERS].as_mut().map(Room::numbers);
        let numbers = numbers.and_then(|numbers| numbers.get_mut(..count));
        let (Some(numbers), Some(shown)) =
            (numbers, shown(self.scan.as_ref(), self.table.as_ref()))
        else {
            return false;
        };
        go_on(&shown, numbers.as_chunks_mut().0);
        true
    }
}

/// What there is to look at.
fn shown<'a>(
    scan: Option<&'a Scan<'static, AnyModel>>,
    table: Option<&'a Basis<'static>>,
) -> Option<Shown<'a>> {
    match table {
        Some(table) => Some(Shown::Table(table)),
        None => scan?.fitted().map(Shown::Fitted),
    }
}
