//! What the numbers of a file are, and the BRDF that they tell.

use std::path::Path;

use glimpse_core::geometry::{Angles, Directions};
use glimpse_core::gonio::{Calibrated, Calibration, Footprint, Quantity, Repeated};

use super::rows::{Matched, Rows, SATURATED_WHITE};
use super::table::TableError;

/// What a column `quantity` calls counts.
const COUNTS: &str = "counts";

/// What numbers are.
#[derive(Clone, Debug)]
pub enum Meaning {
    /// A function of the BRDF.
    Values(Quantity),
    /// A sensor's counts, beside those of a white.
    Counts(Counts),
}

/// How counts become a BRDF.
#[derive(Clone, Debug)]
pub struct Counts {
    /// Counts without light.
    pub dark: [f32; 3],
    /// The white's reflectance, above 0 and at most 2.
    pub reflectance: [f32; 3],
    /// The level at and above which a reading is saturated, if it is known.
    pub saturation: Option<f32>,
    /// Counts of the white.
    pub white: White,
}

/// Counts of a white tile.
#[derive(Clone, Debug)]
pub enum White {
    /// At the directions of each sample, and at the same with light and sensor exchanged, under which
    /// counts are others; None where it was not read.
    Each(Vec<[Option<[f32; 3]>; 2]>),
    /// Once, at these directions, with one spot on the sample larger than the other.
    Once([f32; 3], Directions<f32>, Footprint),
}

impl White {
    /// Reads a file of white readings: at a recipe's directions, matched as those of a material are,
    /// or, with a footprint, a single one.
    ///
    /// # Errors
    /// If the file cannot be read, or a row is of no sample.
    pub fn read(
        path: &Path,
        pattern: &[Angles<f32>],
        tolerance: f64,
        footprint: Option<Footprint>,
    ) -> Result<Self, TableError> {
        let rows = Rows::read(path)?;
        rows.refuse_other_than(COUNTS)?;
        if let Some(footprint) = footprint {
            let (at, counts) = rows.single(pattern)?;
            return Ok(Self::Once(counts, at, footprint));
        }
        let matched = rows
            .matched(pattern, tolerance)
            .map_err(|error| match error {
                TableError::Damaged { path, what } => TableError::Damaged {
                    path,
                    what: what
                        + ". (A white that was read once, at directions of its own, takes \
                       --footprint light or sensor)",
                },
                other => other,
            })?;
        let mut whites = vec![[Repeated::new(); 2]; pattern.len()];
        for row in &matched {
            if let Some(values) = row.values {
                if row.saturated {
                    return Err(rows.wrong(row.line, SATURATED_WHITE));
                }
                let white = &mut whites[row.sample][usize::from(row.exchanged)];
                let added = white.add(values, false);
                added.map_err(|error| {
                    rows.wrong(row.line, &format!("{error}; correct the row or remove it"))
                })?;
            }
        }
        let means = whites
            .iter()
            .map(|white| white.each_ref().map(Repeated::mean));
        Ok(Self::Each(means.collect()))
    }
}

impl Meaning {
    /// What a column `quantity` calls it.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Values(Quantity::Brdf) => "brdf",
            Self::Values(Quantity::BrdfTimesCosThetaI) => "brdf-cos-i",
            Self::Values(Quantity::BrdfTimesCosThetaO) => "brdf-cos-o",
            Self::Values(Quantity::ReflectanceFactor) => "reflectance-factor",
            Self::Values(_) => "unknown", // of a newer core
            Self::Counts(_) => COUNTS,
        }
    }

    /// The BRDF of a row's numbers; or why they tell none, in words.
    pub(super) fn brdf(&self, row: &Matched, values: [f32; 3]) -> Result<Calibrated, String> {
        let mut read = match self {
            Self::Values(quantity) => {
                let brdf = quantity.to_brdf(values, &row.at);
                Calibrated {
                    brdf: brdf.map_err(|error| error.to_string())?,
                    saturated: false,
                }
            }
            Self::Counts(counts) => counts.brdf(row, values)?,
        };
        read.saturated |= row.saturated;
        Ok(read)
    }
}

impl Counts {
    fn brdf(&self, row: &Matched, values: [f32; 3]) -> Result<Calibrated, String> {
        let white = match &self.white {
            White::Once(white, ..) => *white,
            White::Each(all) => {
                let white = all.get(row.sample).copied().unwrap_or_default();
                white[usize::from(row.exchanged)].ok_or_else(|| {
                    let exchanged = match row.exchanged {
                        true => ", with light and sensor exchanged",
                        false => "",
                    };
                    format!(
                        "it is of sample {}{exchanged}, at whose directions there is no white \
                         reading: read the white there too",
                        row.sample
                    )
                })?
            }
        };
        let calibrate = || {
            let calibration = Calibration::new(self.dark, white, self.reflectance)?;
            let calibration = match self.saturation {
                Some(level) => calibration.saturating_at(level)?,
                None => calibration,
            };
            match &self.white {
                White::Each(_) => calibration.brdf(values),
                White::Once(_, at, footprint) => calibration
                    .read_once_at(at, *footprint)?
                    .brdf(values, &row.at),
            }
        };
        calibrate().map_err(|error| error.to_string())
    }
}
