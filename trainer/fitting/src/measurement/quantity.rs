//! Conversion of a file's numbers to the BRDF.

use clap::ValueEnum;
use glimpse_core::error::Error;
use glimpse_core::geometry::{Angles, Directions};
use glimpse_core::gonio::{Calibration, Footprint, Quantity, Reading, Repeated};
use serde::{Deserialize, Serialize};

use super::angles::to_directions;
use super::rows::{LabReading, Rows};
use super::table::TableError;
use crate::choice::Choice;

const COUNTS_OF_BANDS: &str = "it has counts of bands; divide them by those of the tile, and state reflectance-factor as their quantity";
/// The name of sensor counts in the column `quantity`.
const COUNTS: &str = "counts";

/// A quantity in a unit, as named on the command line, in the column `quantity` and in Python.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ValueEnum)]
pub enum Multiple {
    /// The BRDF, sr^-1.
    Brdf,
    /// The BRDF times cos(theta_i).
    BrdfCosI,
    /// The BRDF times cos(theta_o).
    #[value(alias = "brdf-cos")]
    BrdfCosO,
    /// Pi times the BRDF.
    ReflectanceFactor,
    /// Pi times the BRDF, in percent.
    ReflectancePercent,
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
    /// Returns the quantity, and its value for the number 1.
    fn quantity(self) -> (Quantity, f32) {
        match self {
            Self::Brdf => (Quantity::Brdf, 1.0),
            Self::BrdfCosI => (Quantity::BrdfTimesCosThetaI, 1.0),
            Self::BrdfCosO => (Quantity::BrdfTimesCosThetaO, 1.0),
            Self::ReflectanceFactor => (Quantity::ReflectanceFactor, 1.0),
            Self::ReflectancePercent => (Quantity::ReflectanceFactor, 0.01),
        }
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
pub enum ReadingQuantity {
    /// A function of the BRDF, and the reflectance of the tile that a reflectance factor is relative to.
    Values(Multiple, f32),
    /// Counts of a sensor, relative to the counts of a white tile.
    Counts(CountCalibration),
}

/// The conversion of counts to the BRDF.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct CountCalibration {
    /// Counts without light, of red, green and blue.
    pub dark: [f32; 3],
    /// The white's reflectance, above 0 and at most 2.
    pub reflectance: [f32; 3],
    /// The lowest count of a saturated sensor, if it is known.
    pub saturation: Option<f32>,
    /// Counts of the white, at the directions of the readings, or in a single row if there is a footprint.
    pub white: Rows,
    /// The larger of the two spots on a sample whose white was read once.
    pub footprint: Option<Footprint>,
}

impl ReadingQuantity {
    /// Returns a function of the BRDF.
    #[must_use]
    pub const fn of(multiple: Multiple) -> Self {
        Self::Values(multiple, 1.0)
    }

    /// Returns this multiple, or else the one that the rows state, or else the BRDF. With a tile's reflectance, it is
    /// relative to that tile. None if it is not a reflectance factor then, or the channels of the tile differ.
    #[must_use]
    pub fn of_values(
        multiple: Option<Multiple>,
        reflectance: Option<[f32; 3]>,
        rows: &Rows,
    ) -> Option<Self> {
        let stated = || Multiple::from_str(rows.stated_quantity()?, false).ok();
        let multiple = multiple.or_else(stated).unwrap_or(Multiple::Brdf);
        let [red, green, blue] = reflectance.unwrap_or([1.0; 3]);
        let is_valid = reflectance.is_none()
            || multiple.quantity().0 == Quantity::ReflectanceFactor && red == green && red == blue;
        is_valid.then_some(Self::Values(multiple, red))
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
    /// Creates the conversion with a white. By default, the dark counts are 0, and the reflectance is 0.99.
    #[must_use]
    pub fn new(
        white: Rows,
        footprint: Option<Footprint>,
        dark: Option<[f32; 3]>,
        reflectance: Option<[f32; 3]>,
        saturation: Option<f32>,
    ) -> Self {
        Self {
            dark: dark.unwrap_or([0.0; 3]),
            reflectance: reflectance.unwrap_or([0.99; 3]),
            saturation,
            white,
            footprint,
        }
    }

    fn with_white(&self, white: [f32; 3]) -> Result<Calibration, Error> {
        let calibration = Calibration::new(self.dark, white, self.reflectance)?;
        match self.saturation {
            Some(level) => calibration.saturating_at(level),
            None => Ok(calibration),
        }
    }

    /// Returns the white counts of each sample, None where the white was not read.
    fn by_sample(&self, directions: &[Angles<f32>]) -> Result<Vec<Option<[f32; 3]>>, TableError> {
        let rows = &self.white;
        let placement = rows
            .match_to_pattern(directions.iter().copied())
            .map_err(|error| match error {
                TableError::OffPattern { path, message }
                | TableError::Damaged { path, message } => TableError::Damaged {
                    path,
                    message: message
                        + ". For a white that was read once, at other directions, give --footprint \
                           light or sensor",
                },
                other => other,
            })?;
        let mut whites = vec![Repeated::default(); directions.len()];
        for (row, sample) in rows.readings().iter().zip(placement.of_rows) {
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
        let [row] = rows.readings() else {
            return Err(rows.file_error(format!(
                "it has {} rows, but with --footprint the white is read once; give one row",
                rows.readings().len()
            )));
        };
        let sample = row.index.and_then(|index| directions.get(index));
        let angles = row
            .angles
            .or_else(|| sample.map(|angles| angles.map(f64::from)))
            .ok_or_else(|| rows.line_error(row.line, "the directions are missing; give them"))?;
        Ok((to_directions(angles), self.counts(row)?))
    }

    /// Returns the counts of a row of the white.
    fn counts(&self, row: &LabReading) -> Result<[f32; 3], TableError> {
        if row.saturated {
            let message =
                "column saturated: the white reading is saturated; read the white with less light";
            return Err(self.white.line_error(row.line, message));
        }
        Ok(self.white.rgb(row))
    }
}

/// The counts of the white for a conversion.
pub(super) enum White {
    /// The counts at each sample; None if the white was not read there.
    BySample(Vec<Option<[f32; 3]>>),
    /// The counts at one pair of directions, and the larger spot.
    Once([f32; 3], Directions<f32>, Footprint),
}

/// The conversion of the rows of a file to BRDFs.
pub(super) enum Conversion<'a> {
    Values(&'a Rows, Multiple, f32),
    Counts(&'a Rows, &'a CountCalibration, White),
}

impl<'a> Conversion<'a> {
    /// Prepares the conversion of rows of a quantity at samples.
    pub(super) fn new(
        rows: &'a Rows,
        quantity: &'a ReadingQuantity,
        directions: &[Angles<f32>],
    ) -> Result<Self, TableError> {
        let calibration = match quantity {
            ReadingQuantity::Values(multiple, reflectance) => {
                return Ok(Self::Values(rows, *multiple, *reflectance));
            }
            ReadingQuantity::Counts(calibration) => calibration,
        };
        let white = &calibration.white;
        white.check_quantity(COUNTS)?;
        for rows in [rows, white] {
            if !rows.wavelengths().is_empty() {
                return Err(rows.file_error(COUNTS_OF_BANDS.to_owned()));
            }
        }
        let white = match calibration.footprint {
            None => White::BySample(calibration.by_sample(directions)?),
            Some(footprint) => {
                let (at, counts) = calibration.single(directions)?;
                White::Once(counts, at, footprint)
            }
        };
        Ok(Self::Counts(rows, calibration, white))
    }

    /// Converts numbers of a row at directions to the BRDF.
    pub(super) fn to_brdf(
        &self,
        row: &LabReading,
        sample: usize,
        at: &Directions<f32>,
        values: [f32; 3],
    ) -> Result<Reading, TableError> {
        let (rows, reading) = match self {
            Self::Values(rows, multiple, reflectance) => {
                let (of, unit) = multiple.quantity();
                let values = values.map(|value| value * unit * reflectance);
                (rows, of.to_brdf(values, at).map(Reading::new))
            }
            Self::Counts(rows, calibration, White::Once(counts, white_at, footprint)) => {
                let calibration = calibration.with_white(*counts);
                let once = calibration.and_then(|all| all.read_once_at(white_at, *footprint));
                (rows, once.and_then(|once| once.reading(values, at)))
            }
            Self::Counts(rows, calibration, White::BySample(whites)) => {
                let counts = whites.get(sample).copied().flatten().ok_or_else(|| {
                    let message = format!(
                        "sample {sample} has no white reading; read the white at these directions as well, or remove \
                         the row"
                    );
                    rows.line_error(row.line, &message)
                })?;
                let calibration = calibration.with_white(counts);
                (rows, calibration.and_then(|all| all.reading(values)))
            }
        };
        let mut reading = reading.map_err(|error| rows.reading_error(row, error))?;
        reading.saturated |= row.saturated;
        Ok(reading)
    }

    /// Converts the numbers of a row's bands to the BRDF; none without bands.
    pub(super) fn bands_to_brdf(
        &self,
        row: &LabReading,
        sample: usize,
        at: &Directions<f32>,
    ) -> Result<Vec<f32>, TableError> {
        let (Self::Values(rows, ..) | Self::Counts(rows, ..)) = self;
        let convert = |(band, wavelength): (&f32, &f32)| {
            let [value, ..] = self.to_brdf(row, sample, at, [*band; 3])?.brdf;
            if value >= -1.0 {
                return Ok(value);
            }
            let message = format!(
                "band {wavelength} nm: {band} is too far below 0; correct the row or remove it"
            );
            Err(rows.line_error(row.line, &message))
        };
        let bands = row.numbers.iter().zip(rows.wavelengths());
        bands.map(convert).collect()
    }
}
