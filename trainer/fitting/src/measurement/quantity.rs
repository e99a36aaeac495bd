//! Conversion of a file's numbers to the BRDF.

use std::path::Path;

use glimpse_core::error::Error;
use glimpse_core::geometry::{Angles, Directions};
use glimpse_core::gonio::{Calibration, Footprint, Quantity, Reading, Repeated};

use super::convention::AngleArgs;
use super::matched_rows::MatchedRow;
use super::rows::{Rows, SATURATED_WHITE};
use super::table::TableError;

const COUNTS_OF_BANDS: &str = "it has counts of bands; divide them by those of the tile, and state reflectance-factor as their quantity";
/// The name of sensor counts in the column `quantity`.
const COUNTS: &str = "counts";

/// The quantities of readings by name, on the command line, in the column `quantity` and in Python.
pub const QUANTITIES: [(&str, Multiple); 5] = [
    ("brdf", Multiple::of(Quantity::Brdf)),
    ("brdf-cos-i", Multiple::of(Quantity::BrdfTimesCosThetaI)),
    ("brdf-cos-o", Multiple::of(Quantity::BrdfTimesCosThetaO)),
    (
        "reflectance-factor",
        Multiple::of(Quantity::ReflectanceFactor),
    ),
    (
        "reflectance-percent",
        Multiple {
            of: Quantity::ReflectanceFactor,
            unit: 0.01,
        },
    ),
];
/// The spots on the material by name, on the command line and in Python.
pub const FOOTPRINTS: [(&str, Footprint); 2] = [
    ("light", Footprint::LightLarger),
    ("sensor", Footprint::SensorLarger),
];

/// A quantity in a unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Multiple {
    of: Quantity,
    unit: f32,
}

impl Multiple {
    /// Returns a quantity in its own unit.
    #[must_use]
    pub const fn of(of: Quantity) -> Self {
        Self { of, unit: 1.0 }
    }
}

/// The physical quantity of a file's numbers.
#[derive(Clone, Debug)]
pub enum ReadingQuantity {
    /// A function of the BRDF, and the reflectance of the tile that a reflectance factor is relative to.
    Values(Multiple, f32),
    /// Counts of a sensor, relative to the counts of a white tile.
    Counts(CountCalibration),
}

/// The conversion of counts to the BRDF.
#[derive(Clone, Debug)]
pub struct CountCalibration {
    /// Counts without light, of red, green and blue.
    pub dark: [f32; 3],
    /// The white's reflectance, above 0 and at most 2.
    pub reflectance: [f32; 3],
    /// The lowest count of a saturated sensor, if it is known.
    pub saturation: Option<f32>,
    /// Counts of the white.
    pub white: WhiteReference,
}

/// Counts of a white tile.
#[derive(Clone, Debug)]
pub enum WhiteReference {
    /// Counts at the directions of each sample; None if the white was not read there.
    PerSample(Vec<Option<[f32; 3]>>),
    /// Counts at one pair of directions, and the larger of the two spots on the sample.
    Single([f32; 3], Directions<f32>, Footprint),
}

impl WhiteReference {
    /// Reads a file of white readings. With a footprint, the file has a single reading. Without one, it has readings at
    /// a recipe's directions, which are matched like those of a material.
    ///
    /// # Errors
    /// If the file cannot be read, a row matches no sample, or a reading is saturated.
    pub fn read(
        path: &Path,
        args: &AngleArgs,
        pattern: &[Angles<f32>],
        footprint: Option<Footprint>,
    ) -> Result<Self, TableError> {
        let rows = Rows::read(path, args)?;
        rows.check_quantity(COUNTS)?;
        if !rows.wavelengths().is_empty() {
            return Err(rows.file_error(COUNTS_OF_BANDS.to_owned()));
        }
        if let Some(footprint) = footprint {
            let (directions, counts) = rows.single_reading(pattern)?;
            return Ok(Self::Single(counts, directions, footprint));
        }
        let all = rows
            .match_to_pattern(pattern)
            .map_err(|error| match error {
                TableError::Damaged { path, message }
                | TableError::OffPattern { path, message } => TableError::Damaged {
                    path,
                    message: message
                        + ". For a white that was read once, at other directions, give --footprint \
                           light or sensor",
                },
                other => other,
            })?;
        let mut whites = vec![Repeated::new(); pattern.len()];
        for matched in &all {
            if let Some(values) = matched.row.values {
                if matched.row.saturated {
                    return Err(rows.line_error(matched.row.line, SATURATED_WHITE));
                }
                let added = whites[matched.sample].add(values, false);
                added.map_err(|error| rows.reading_error(matched.row.line, error, values))?;
            }
        }
        Ok(Self::PerSample(whites.iter().map(Repeated::mean).collect()))
    }
}

impl ReadingQuantity {
    /// Returns the quantity that the rows state, or else the BRDF.
    #[must_use]
    pub fn stated(rows: &Rows) -> Self {
        let name = match rows.stated_quantity() {
            Some("brdf-cos") => "brdf-cos-o",
            Some(name) => name,
            None => "brdf",
        };
        let named = QUANTITIES.iter().find(|(known, _)| *known == name);
        Self::Values(
            named.map_or(Multiple::of(Quantity::Brdf), |(_, multiple)| *multiple),
            1.0,
        )
    }

    /// Returns a function of the BRDF.
    #[must_use]
    pub const fn of(quantity: Quantity) -> Self {
        Self::Values(Multiple::of(quantity), 1.0)
    }

    /// Returns a reflectance factor relative to a tile of this reflectance. None if it is not one, or channels differ.
    #[must_use]
    pub fn relative_to(self, [red, green, blue]: [f32; 3]) -> Option<Self> {
        match self {
            Self::Values(multiple, _)
                if multiple.of == Quantity::ReflectanceFactor && red == green && red == blue =>
            {
                Some(Self::Values(multiple, red))
            }
            _ => None,
        }
    }

    /// Returns the name in the column `quantity`.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Values(multiple, _) => {
                let named = QUANTITIES.iter().find(|(_, other)| other == multiple);
                named.map_or("unknown", |(name, _)| name)
            }
            Self::Counts(_) => COUNTS,
        }
    }

    /// Converts a row's numbers to the BRDF.
    pub(super) fn to_brdf(
        &self,
        rows: &Rows,
        matched: &MatchedRow<'_>,
        values: [f32; 3],
    ) -> Result<Reading, TableError> {
        let reading = match self {
            Self::Values(Multiple { of, unit }, reflectance) => {
                let values = values.map(|value| value * unit * reflectance);
                of.to_brdf(values, &matched.directions).map(Reading::new)
            }
            Self::Counts(counts) => {
                counts.to_brdf(counts.white_at(rows, matched)?, matched, values)
            }
        };
        let mut reading =
            reading.map_err(|error| rows.reading_error(matched.row.line, error, values))?;
        reading.saturated |= matched.row.saturated;
        Ok(reading)
    }

    /// Converts a row's numbers of bands to the BRDF.
    pub(super) fn bands_to_brdf(
        &self,
        rows: &Rows,
        matched: &MatchedRow<'_>,
    ) -> Result<Vec<f32>, TableError> {
        if let (false, Self::Counts(_)) = (matched.row.bands.is_empty(), self) {
            return Err(rows.file_error(COUNTS_OF_BANDS.to_owned()));
        }
        let mut brdf = Vec::with_capacity(matched.row.bands.len());
        for (band, wavelength) in matched.row.bands.iter().zip(rows.wavelengths()) {
            let [value, ..] = self.to_brdf(rows, matched, [*band; 3])?.brdf;
            if value < -1.0 {
                return Err(rows.line_error(
                    matched.row.line,
                    &format!("band {wavelength} nm: {band} is too far below 0; correct the row or remove it"),
                ));
            }
            brdf.push(value);
        }
        Ok(brdf)
    }
}

impl CountCalibration {
    /// Creates the conversion. By default, the dark counts are 0, and the reflectance is 0.99.
    #[must_use]
    pub fn new(
        white: WhiteReference,
        dark: Option<[f32; 3]>,
        reflectance: Option<[f32; 3]>,
        saturation: Option<f32>,
    ) -> Self {
        Self {
            dark: dark.unwrap_or([0.0; 3]),
            reflectance: reflectance.unwrap_or([0.99; 3]),
            saturation,
            white,
        }
    }

    /// Returns the counts of the white for a row.
    fn white_at(&self, rows: &Rows, matched: &MatchedRow) -> Result<[f32; 3], TableError> {
        match &self.white {
            WhiteReference::Single(white, ..) => Ok(*white),
            WhiteReference::PerSample(whites) => whites.get(matched.sample).copied().flatten().ok_or_else(|| {
                let message = format!(
                    "sample {} has no white reading; read the white at these directions as well, or remove the row",
                    matched.sample
                );
                rows.line_error(matched.row.line, &message)
            }),
        }
    }

    fn to_brdf(
        &self,
        white: [f32; 3],
        matched: &MatchedRow<'_>,
        values: [f32; 3],
    ) -> Result<Reading, Error> {
        let calibration = Calibration::new(self.dark, white, self.reflectance)?;
        let calibration = match self.saturation {
            Some(level) => calibration.saturating_at(level)?,
            None => calibration,
        };
        match &self.white {
            WhiteReference::PerSample(_) => calibration.reading(values),
            WhiteReference::Single(_, directions, footprint) => calibration
                .read_once_at(directions, *footprint)?
                .reading(values, &matched.directions),
        }
    }
}
