//! Conversion of a file's numbers to the BRDF.

use std::f32::consts::FRAC_1_PI;

use clap::ValueEnum;
use glimpse_core::error::Error;
use glimpse_core::geometry::{Angles, Directions};
use glimpse_core::gonio::{Calibration, Footprint, Quantity, Reading, Repeated};
use serde::{Deserialize, Serialize};

use super::angles::to_directions;
use super::rows::{LabReading, ReadingRows};
use super::table::TableError;
use crate::choice::Choice;

const COUNTS_OF_BANDS: &str = "it has counts of bands; divide them by those of the tile, and state reflectance-factor as their quantity";
/// The name of sensor counts in the column `quantity`.
const COUNTS: &str = "counts";

/// The meaning of a number, as named on the command line, in the column `quantity` and in Python.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Multiple {
    /// The BRDF, sr^-1.
    Brdf,
    /// The BRDF times cos(theta_i).
    BrdfCosI,
    /// The BRDF times cos(theta_o).
    #[value(alias = "brdf-cos")]
    BrdfCosO,
    /// The BRDF times both cosines.
    #[value(name = "brdf-cos-i-o")]
    BrdfCosIO,
    /// Pi times the BRDF.
    ReflectanceFactor,
    /// Pi times the BRDF, in percent.
    ReflectancePercent,
    /// Pi times the BRDF, in the encoding of sRGB, 0 to 1.
    Srgb,
}

/// A spot on the material that is larger than the other at all angles, as named on the command line and in Python.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum LargerSpot {
    /// The light's spot.
    Light,
    /// The sensor's spot.
    Sensor,
}

impl Multiple {
    /// The quantities that a number has to be divided by, and the unit that it has to be multiplied with first.
    const fn factors(self) -> (&'static [Quantity], f32) {
        use Quantity::{BrdfTimesCosThetaI, BrdfTimesCosThetaO, ReflectanceFactor};

        match self {
            Self::Brdf => (&[], 1.0),
            Self::BrdfCosI => (&[BrdfTimesCosThetaI], 1.0),
            Self::BrdfCosO => (&[BrdfTimesCosThetaO], 1.0),
            Self::BrdfCosIO => (&[BrdfTimesCosThetaI, BrdfTimesCosThetaO], 1.0),
            Self::ReflectanceFactor | Self::Srgb => (&[ReflectanceFactor], 1.0),
            Self::ReflectancePercent => (&[ReflectanceFactor], 0.01),
        }
    }

    /// Returns true if numbers are relative to a white tile.
    fn is_relative(self) -> bool {
        self.factors().0 == [Quantity::ReflectanceFactor]
    }

    /// Converts numbers at directions to the BRDF.
    fn to_brdf(
        self,
        numbers: [f32; 3],
        reflectance: f32,
        at: &Directions<f32>,
    ) -> Result<[f32; 3], Error> {
        let (quantities, unit) = self.factors();
        let values = numbers.map(|number| match self {
            Self::Srgb => reflectance * linear(number),
            _ => reflectance * number * unit,
        });
        let mut quantities = quantities.iter();
        quantities.try_fold(values, |values, quantity| quantity.to_brdf(values, at))
    }

    /// Returns the BRDF of the number 1, about.
    pub(super) fn brightness(self) -> f32 {
        let (_, unit) = self.factors();
        let relative = if self.is_relative() { FRAC_1_PI } else { 1.0 };
        let decoded = if self == Self::Srgb { 0.5 } else { 1.0 };
        unit * relative * decoded
    }
}

/// Decodes a value of sRGB (IEC 61966-2-1).
fn linear(value: f32) -> f32 {
    if value <= 0.040_45 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    }
}

impl From<LargerSpot> for Footprint {
    fn from(spot: LargerSpot) -> Self {
        match spot {
            LargerSpot::Light => Self::LightLarger,
            LargerSpot::Sensor => Self::SensorLarger,
        }
    }
}

/// The physical quantity of a file's numbers.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[expect(clippy::large_enum_variant, reason = "a fit has one quantity")]
pub enum ReadingQuantity {
    /// A function of the BRDF, and the reflectance of the tile that a reflectance factor is relative to.
    Values(Multiple, f32),
    /// Counts of a sensor, relative to the counts of a white tile.
    Counts(CountCalibration),
}

/// The conversion of counts to the BRDF.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct CountCalibration {
    /// Counts without light, of red, green and blue; 0 by default.
    pub dark: Option<[f32; 3]>,
    /// The white's reflectance, above 0 and at most 2; 0.99 by default.
    pub reflectance: Option<[f32; 3]>,
    /// The lowest count of a saturated sensor, if it is known.
    pub saturation: Option<f32>,
    /// Counts of the white, at the directions of the readings, or in a single row if there is a footprint.
    pub white: ReadingRows,
    /// The larger of the two spots on a sample whose white was read once.
    pub footprint: Option<Footprint>,
}

impl ReadingQuantity {
    /// Returns a function of the BRDF.
    #[must_use]
    pub const fn of(multiple: Multiple) -> Self {
        Self::Values(multiple, 1.0)
    }

    /// Returns this multiple, or else the one that the rows state, or else with instruments percent, as they show it, or else the
    /// BRDF. With a tile's reflectance, it is relative to that tile. None if it is not a reflectance factor then, or the channels
    /// of the tile differ.
    #[must_use]
    pub fn of_values(
        multiple: Option<Multiple>,
        reflectance: Option<[f32; 3]>,
        rows: &ReadingRows,
    ) -> Option<Self> {
        let stated = rows.quantities.first();
        let stated = stated.and_then(|(_, _, name)| Multiple::from_str(name, false).ok());
        let mut instruments = rows.readings.iter().map(|row| row.optics.instrument);
        let is_shown = instruments.any(|one| one.is_some());
        let shown = is_shown.then_some(Multiple::ReflectancePercent);
        let multiple = multiple.or(stated).or(shown).unwrap_or(Multiple::Brdf);
        let [red, green, blue] = reflectance.unwrap_or([1.0; 3]);
        let is_valid =
            reflectance.is_none() || multiple.is_relative() && red == green && red == blue;
        is_valid.then_some(Self::Values(multiple, red))
    }

    /// Returns true for the same multiple of the BRDF at all directions.
    fn is_without_cosines(&self) -> bool {
        let is_relative = |quantity: &Quantity| *quantity == Quantity::ReflectanceFactor;
        matches!(self, Self::Values(multiple, _) if multiple.factors().0.iter().all(is_relative))
    }

    /// Returns the name in the column `quantity`.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::Values(multiple, _) => multiple.name(),
            Self::Counts(_) => COUNTS.to_owned(),
        }
    }
}

impl CountCalibration {
    fn with_white(&self, white: [f32; 3]) -> Result<Calibration, Error> {
        let reflectance = self.reflectance.unwrap_or([0.99; 3]);
        Calibration::new(self.dark.unwrap_or_default(), white, reflectance)
    }

    /// Returns the counts of a row at an exposure of 1 s, or as they are without an exposure.
    fn exposed(&self, row: &LabReading, counts: [f32; 3]) -> [f32; 3] {
        let dark = self.dark.unwrap_or_default();
        let Some(exposure) = row.exposure else {
            return counts;
        };
        std::array::from_fn(|channel| dark[channel] + (counts[channel] - dark[channel]) / exposure)
    }

    /// Checks that all readings and all rows of the white have exposures, or none.
    fn check_exposures(&self, rows: &ReadingRows) -> Result<(), TableError> {
        let all = rows.readings.iter().chain(&self.white.readings);
        if all.clone().all(|row| row.exposure.is_some())
            || all.clone().all(|row| row.exposure.is_none())
        {
            return Ok(());
        }
        let message = "some counts have an exposure, and others none; give that of all rows, also of the white";
        Err(rows.file_error(message.to_owned()))
    }

    /// Returns true if a count is that of a saturated sensor.
    fn saturates(&self, counts: [f32; 3]) -> bool {
        let level = self.saturation.unwrap_or(f32::INFINITY);
        counts.into_iter().any(|count| count >= level)
    }

    /// Returns the white counts of each sample, None where the white was not read.
    fn by_sample(&self, directions: &[Angles<f32>]) -> Result<Vec<Option<[f32; 3]>>, TableError> {
        let rows = &self.white;
        let placement = rows.match_to_pattern(directions.to_vec());
        let placement = placement.map_err(|unmatched| {
            rows.file_error(format!(
                "{}. For a white that was read once, at other directions, give --footprint light or sensor",
                unmatched.message
            ))
        })?;
        let mut whites = vec![Repeated::default(); directions.len()];
        for (row, sample) in rows.readings.iter().zip(placement.of_rows) {
            let added = whites[sample].add(self.counts(row)?, false);
            added.map_err(|error| rows.reading_error(row, error))?;
        }
        Ok(whites.iter().map(Repeated::mean).collect())
    }

    /// Returns the directions and the counts of the only row. If the row has only an index, the directions are those of
    /// the sample.
    fn single(
        &self,
        directions: &[Angles<f32>],
    ) -> Result<(Directions<f32>, [f32; 3]), TableError> {
        let rows = &self.white;
        let [row] = &rows.readings[..] else {
            return Err(rows.file_error(format!(
                "it has {} rows, but with --footprint the white is read once; give one row",
                rows.readings.len()
            )));
        };
        let sample = row.index.and_then(|index| directions.get(index));
        let angles = row
            .angles
            .or_else(|| sample.map(|angles| angles.map(f64::from)))
            .ok_or_else(|| rows.line_error(row.line, "the directions are missing; give them"))?;
        Ok((to_directions(angles), self.counts(row)?))
    }

    /// Returns the counts of a row of the white, at an exposure of 1 s if it is stated.
    fn counts(&self, row: &LabReading) -> Result<[f32; 3], TableError> {
        let counts = self.white.rgb(row);
        if row.saturated || self.saturates(counts) {
            let message = "the white reading is saturated; read the white with less light";
            return Err(self.white.line_error(row.line, message));
        }
        Ok(self.exposed(row, counts))
    }
}

/// The conversion of the rows of a file to BRDFs.
pub(super) struct Conversion<'a> {
    pub(super) rows: &'a ReadingRows,
    pub(super) quantity: &'a ReadingQuantity,
    /// For counts, the counts of the white for each sample; None where it was not read.
    whites: Vec<Option<[f32; 3]>>,
    /// The directions of a white that was read once, with the larger spot.
    white_at: Option<(Directions<f32>, Footprint)>,
}

impl<'a> Conversion<'a> {
    /// Prepares the conversion of rows of a quantity at samples.
    pub(super) fn new(
        rows: &'a ReadingRows,
        quantity: &'a ReadingQuantity,
        directions: &[Angles<f32>],
    ) -> Result<Self, TableError> {
        let (mut whites, mut white_at) = (Vec::new(), None);
        if let ReadingQuantity::Counts(calibration) = quantity {
            calibration.white.check_quantity(COUNTS)?;
            calibration.check_exposures(rows)?;
            for rows in [rows, &calibration.white] {
                if !rows.wavelengths.is_empty() {
                    return Err(rows.file_error(COUNTS_OF_BANDS.to_owned()));
                }
            }
            if let Some(footprint) = calibration.footprint {
                let (at, counts) = calibration.single(directions)?;
                whites = vec![Some(counts); directions.len()];
                white_at = Some((at, footprint));
            } else {
                whites = calibration.by_sample(directions)?;
            }
        }
        Ok(Self {
            rows,
            quantity,
            whites,
            white_at,
        })
    }

    /// Returns the conversion of the same rows as another quantity that is not counts.
    pub(super) fn of<'b>(&'b self, quantity: &'b ReadingQuantity) -> Conversion<'b> {
        Conversion {
            rows: self.rows,
            quantity,
            whites: self.whites.clone(),
            white_at: self.white_at,
        }
    }

    /// Converts numbers of a row at directions to the BRDF.
    pub(super) fn to_brdf(
        &self,
        row: &LabReading,
        sample: usize,
        at: &Directions<f32>,
        values: [f32; 3],
    ) -> Result<Reading, TableError> {
        let mut saturated = row.saturated;
        let reading = match self.quantity {
            _ if let Some(unit) = row.optics.gloss_unit() => {
                let is_valid = |number: &f32| *number >= 0.0 && *number == row.numbers[0];
                if !row.numbers.iter().all(is_valid) {
                    let message = "gloss is one number of 0 or more; give it in column value";
                    return Err(self.rows.line_error(row.line, message));
                }
                Ok(Reading::new(values.map(|value| value * unit as f32)))
            }
            quantity if row.optics.fixed().is_some() && !quantity.is_without_cosines() => {
                let name = quantity.name();
                let message = format!("{name} needs one pair of directions; give percent");
                return Err(self.rows.line_error(row.line, &message));
            }
            ReadingQuantity::Values(multiple, reflectance) => {
                let brdf = multiple.to_brdf(values, *reflectance, at);
                brdf.map(Reading::new)
            }
            ReadingQuantity::Counts(calibration) => {
                let white = self.whites[sample].ok_or_else(|| {
                    let message = format!(
                        "sample {sample} has no white reading; read the white at these directions as well, or remove \
                         the row"
                    );
                    self.rows.line_error(row.line, &message)
                })?;
                saturated |= calibration.saturates(values);
                let values = calibration.exposed(row, values);
                let calibration = calibration.with_white(white);
                calibration.and_then(|calibration| match &self.white_at {
                    None => calibration.reading(values),
                    Some((white_at, footprint)) => calibration
                        .read_once_at(white_at, *footprint)?
                        .reading(values, at),
                })
            }
        };
        let mut reading = reading.map_err(|error| self.rows.reading_error(row, error))?;
        reading.saturated |= saturated;
        Ok(reading)
    }

    /// Converts the numbers of a row's bands to the BRDF; none without bands.
    pub(super) fn bands_to_brdf(
        &self,
        row: &LabReading,
        sample: usize,
        at: &Directions<f32>,
    ) -> Result<Vec<f32>, TableError> {
        let convert = |(band, wavelength): (&f32, &f32)| {
            let [value, ..] = self.to_brdf(row, sample, at, [*band; 3])?.brdf;
            if value >= -1.0 {
                return Ok(value);
            }
            let message = format!(
                "band {wavelength} nm: {band} is too far below 0; correct the row or remove it"
            );
            Err(self.rows.line_error(row.line, &message))
        };
        let bands = row.numbers.iter().zip(&self.rows.wavelengths);
        bands.map(convert).collect()
    }
}
