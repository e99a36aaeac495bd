//! Readings in arrays, interpreted like the trainer's measurement files.

use std::path::{Path, PathBuf};

use glimpse_fitting::measurement::{
    AngleArgs, CountCalibration, LabReading, LargerSpot, NamedRecipe, ReadingQuantity, Readings,
    Rows, rusinkiewicz,
};
use pyo3::prelude::*;

use crate::arrays::{Pairs, numbers, shape_text};
use crate::choices::choose;
use crate::error::{Result, reject, reject_unused};

/// Arguments that describe readings.
#[derive(Default)]
pub(crate) struct ReadingArgs<'a, 'py> {
    pub(crate) quantity: Option<&'a str>,
    pub(crate) saturated: Option<&'a Bound<'py, PyAny>>,
    pub(crate) noise: Option<&'a Bound<'py, PyAny>>,
    pub(crate) wavelengths: Option<&'a Bound<'py, PyAny>>,
    pub(crate) white: Option<&'a Bound<'py, PyAny>>,
    pub(crate) white_directions: Option<&'a Bound<'py, PyAny>>,
    pub(crate) footprint: Option<&'a str>,
    pub(crate) dark: Option<&'a Bound<'py, PyAny>>,
    pub(crate) white_reflectance: Option<&'a Bound<'py, PyAny>>,
    pub(crate) saturation: Option<f32>,
}

impl<'py> ReadingArgs<'_, 'py> {
    /// Takes the readings of a recipe's samples: those of an array at `directions`, or of a file.
    pub(crate) fn readings(
        &self,
        given: &NamedRecipe,
        readings: &Bound<'py, PyAny>,
        directions: Option<&Bound<'py, PyAny>>,
    ) -> Result<Readings> {
        let path = readings.extract::<PathBuf>().ok();
        let rows = match &path {
            Some(path) => self.read(path, directions.is_some())?,
            None => self.rows(given, readings, directions)?,
        };
        let quantity = match self.white {
            None => self.multiple(&rows)?,
            Some(white) => {
                let count = path.is_none().then(|| readings.len()).transpose()?;
                self.counts(self.white_rows(white, count, directions)?)?
            }
        };
        Ok(Readings::new(given, rows, quantity)?)
    }

    /// Reads a file of readings.
    fn read(&self, path: &Path, has_directions: bool) -> Result<Rows> {
        reject_unused(
            true,
            "the file of readings states it",
            &[
                ("directions", has_directions),
                ("wavelengths", self.wavelengths.is_some()),
                ("saturated", self.saturated.is_some()),
                ("noise", self.noise.is_some()),
            ],
        )?;
        Ok(Rows::read(path, &AngleArgs::default())?)
    }

    /// Takes the readings of an array.
    fn rows(
        &self,
        given: &NamedRecipe,
        argument: &Bound<'py, PyAny>,
        directions: Option<&Bound<'py, PyAny>>,
    ) -> Result<Rows> {
        let wavelengths = self.wavelengths.map(|nm| numbers(nm, "wavelengths"));
        let wavelengths = wavelengths.transpose()?.unwrap_or_default();
        let wavelengths: Vec<f32> = wavelengths.iter().map(|nm| *nm as f32).collect();
        if !wavelengths.is_sorted_by(|one, other| one < other) {
            return reject("wavelengths must be in nm, in ascending order");
        }
        let channels = if wavelengths.is_empty() {
            3
        } else {
            wavelengths.len()
        };
        let mut readings = values(argument, "readings", channels)?;
        let (count, samples) = (readings.len(), given.file.recipe().samples());
        if directions.is_none() && given.is_any() {
            return reject("pass directions, because the recipe has none");
        }
        if directions.is_none() && count != samples {
            return reject(format!(
                "readings must have the shape ({samples}, {channels}), one row for each of the recipe's samples and NaN \
                 for a missing one, not ({count}, {channels}); or pass directions"
            ));
        }
        place(&mut readings, directions)?;
        if let Some(flags) = self.saturated {
            let flags = numbers(flags, "saturated")?;
            if flags.shape() != [count] || flags.iter().any(|flag| ![0.0, 1.0].contains(flag)) {
                return reject(format!(
                    "saturated must be {count} booleans, one for each of the readings"
                ));
            }
            for (reading, flag) in readings.iter_mut().zip(&flags) {
                reading.saturated = *flag == 1.0;
            }
        }
        if let Some(noise) = self.noise {
            let noise = numbers(noise, "noise")?;
            if noise.shape() != [count] || !noise.iter().all(|level| (0.0..=10.0).contains(level)) {
                return reject(format!(
                    "noise must be {count} standard deviations relative to the readings, each 0 to 10"
                ));
            }
            for (reading, level) in readings.iter_mut().zip(&noise) {
                reading.noise = Some(*level as f32);
            }
        }
        Ok(Rows::from_array("readings", wavelengths, readings))
    }

    /// Returns the quantity of readings that are not counts.
    fn multiple(&self, rows: &Rows) -> Result<ReadingQuantity> {
        reject_unused(
            true,
            "it requires white, the counts of a white reference",
            &[
                ("white_directions", self.white_directions.is_some()),
                ("footprint", self.footprint.is_some()),
                ("dark", self.dark.is_some()),
                ("saturation", self.saturation.is_some()),
            ],
        )?;
        let name = self.quantity;
        let multiple = name.map(|name| choose("quantity", name));
        let reflectance = optional(self.white_reflectance, "white_reflectance")?;
        let quantity = ReadingQuantity::of_values(multiple.transpose()?, reflectance, rows);
        quantity.map_or_else(
            || reject("white_reflectance requires white, or it is one number, and quantity is a reflectance factor"),
            Ok,
        )
    }

    /// Returns the quantity of counts, relative to those of a white reference.
    fn counts(&self, white: Rows) -> Result<ReadingQuantity> {
        if self.quantity.is_some() {
            return reject("quantity has no effect with white: the readings are counts then");
        }
        if self.saturation.is_some_and(|level| !level.is_finite()) {
            return reject("saturation must be a finite number of counts");
        }
        let name = self.footprint;
        let footprint = name.map(|name| choose::<LargerSpot>("footprint", name));
        Ok(ReadingQuantity::Counts(CountCalibration::new(
            white,
            footprint.transpose()?.map(Into::into),
            optional(self.dark, "dark")?,
            optional(self.white_reflectance, "white_reflectance")?,
            self.saturation,
        )))
    }

    /// Takes the counts of a white reference, of each of `count` readings in an array or of a single pair of directions.
    fn white_rows(
        &self,
        white: &Bound<'_, PyAny>,
        count: Option<usize>,
        directions: Option<&Bound<'py, PyAny>>,
    ) -> Result<Rows> {
        if self.white_directions.is_some() != self.footprint.is_some() {
            return reject(
                "white_directions and footprint describe a white reference that was read once: pass both",
            );
        }
        let Some(once) = self.white_directions else {
            let mut white = values(white, "white", 3)?;
            let count = count.unwrap_or(white.len());
            if white.len() != count {
                return reject(format!(
                    "white must have the shape ({count}, 3), the white reference at each of the readings, not ({}, 3); or \
                     pass white_directions and footprint of a white reference that was read once",
                    white.len()
                ));
            }
            place(&mut white, directions)?;
            return Ok(Rows::from_array("white", Vec::new(), white));
        };
        let Pairs { pairs, shape } = Pairs::from_arrays(once, None)?;
        let ([[incoming, outgoing]], []) = (&pairs[..], &shape[..]) else {
            return reject(format!(
                "white_directions must have the shape (2, 3), not {}",
                shape_text(&[&shape[..], &[2, 3]].concat())
            ));
        };
        let reading = LabReading {
            angles: Some(rusinkiewicz(*incoming, *outgoing)),
            numbers: channels(white, "white")?.to_vec(),
            ..LabReading::default()
        };
        Ok(Rows::from_array("white", Vec::new(), vec![reading]))
    }
}

/// Places readings at `directions`, or else at the recipe's samples.
fn place(readings: &mut [LabReading], directions: Option<&Bound<'_, PyAny>>) -> Result<()> {
    let Some(directions) = directions else {
        for (index, reading) in readings.iter_mut().enumerate() {
            reading.index = Some(index);
        }
        return Ok(());
    };
    let (count, Pairs { pairs, shape }) = (readings.len(), Pairs::from_arrays(directions, None)?);
    if shape != [count] {
        return reject(format!(
            "directions must have the shape ({count}, 2, 3), one pair for each of the readings, not {}",
            shape_text(&[&shape[..], &[2, 3]].concat())
        ));
    }
    for (reading, [incoming, outgoing]) in readings.iter_mut().zip(pairs) {
        reading.angles = Some(rusinkiewicz(incoming, outgoing));
    }
    Ok(())
}

/// Returns the readings in the rows of an array of channels or bands, without numbers if they are missing.
fn values(argument: &Bound<'_, PyAny>, name: &str, channels: usize) -> Result<Vec<LabReading>> {
    let array = numbers(argument, name)?;
    if array.ndim() != 2 || array.shape()[1] != channels {
        return reject(format!(
            "{name} must have the shape (n, {channels}), or one column for each of wavelengths, not {}",
            shape_text(array.shape())
        ));
    }
    let rows = (0..).zip(array.outer_iter()).map(|(line, values)| {
        let missing = values.iter().filter(|value| value.is_nan()).count();
        if missing > 0 && missing < channels {
            return reject(format!(
                "{name}: row {line} is NaN in some channels only: pass all values, or NaN for all if the reading is missing"
            ));
        }
        let present = values.iter().filter(|value| !value.is_nan());
        Ok(LabReading {
            line,
            numbers: present.map(|value| *value as f32).collect(),
            ..LabReading::default()
        })
    });
    rows.collect()
}

/// Reads [`channels`], unless the argument is None.
fn optional(argument: Option<&Bound<'_, PyAny>>, name: &str) -> Result<Option<[f32; 3]>> {
    argument
        .map(|argument| channels(argument, name))
        .transpose()
}

/// Reads one number for all channels, or one for each.
fn channels(argument: &Bound<'_, PyAny>, name: &str) -> Result<[f32; 3]> {
    let values: Vec<f64> = numbers(argument, name)?.iter().copied().collect();
    match values[..] {
        [value] => Ok([value as f32; 3]),
        [r, g, b] => Ok([r, g, b].map(|value| value as f32)),
        _ => reject(format!(
            "{name} must be one number, or three, not {}",
            values.len()
        )),
    }
}
