//! Readings in arrays, interpreted like the trainer's measurement files.

use std::path::PathBuf;

use glimpse_core::geometry::{Angles, Directions};
use glimpse_fitting::measurement::{
    AngleArgs, ChosenRecipe, CountCalibration, FOOTPRINTS, LabReading, Measurements, NamedRecipe,
    QUANTITIES, ReadingQuantity, Rows, WhiteReference,
};
use pyo3::prelude::*;

use crate::arrays::{Pairs, numbers, rows, shape_text};
use crate::choices::choose;
use crate::error::{reject, reject_unused, to_exception};

/// Arguments that describe readings.
pub(crate) struct ReadingArgs<'a, 'py> {
    pub(crate) readings: &'a Bound<'py, PyAny>,
    pub(crate) directions: Option<&'a Bound<'py, PyAny>>,
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

impl<'a, 'py> ReadingArgs<'a, 'py> {
    /// Creates arguments of BRDFs at directions, without further information.
    pub(crate) fn new(readings: &'a Bound<'py, PyAny>, directions: &'a Bound<'py, PyAny>) -> Self {
        Self {
            readings,
            directions: Some(directions),
            quantity: None,
            saturated: None,
            noise: None,
            wavelengths: None,
            white: None,
            white_directions: None,
            footprint: None,
            dark: None,
            white_reflectance: None,
            saturation: None,
        }
    }

    /// Chooses the recipe of the readings, and assigns them to its samples.
    pub(crate) fn measurements(
        &self,
        given: &NamedRecipe,
    ) -> PyResult<(ChosenRecipe, Measurements)> {
        let mut rows = self.rows(given)?;
        let chosen = given.choose(&mut rows).map_err(to_exception)?;
        let pattern: Vec<Angles<f32>> = chosen.recipe.file.recipe().pattern().collect();
        let meaning = self.meaning(pattern.len(), &rows)?;
        let measurements = Measurements::new(&rows, &pattern, &meaning).map_err(to_exception)?;
        Ok((chosen, measurements))
    }

    fn rows(&self, given: &NamedRecipe) -> PyResult<Rows> {
        if let Ok(path) = self.readings.extract::<PathBuf>() {
            reject_unused(
                true,
                "the file of readings states it",
                &[
                    ("directions", self.directions.is_some()),
                    ("wavelengths", self.wavelengths.is_some()),
                    ("saturated", self.saturated.is_some()),
                    ("noise", self.noise.is_some()),
                ],
            )?;
            return Rows::read(&path, &AngleArgs::default()).map_err(to_exception);
        }
        let wavelengths = self
            .wavelengths
            .map(|wavelengths| numbers(wavelengths, "wavelengths"));
        let wavelengths = wavelengths.transpose()?.unwrap_or_default();
        let wavelengths: Vec<f32> = wavelengths.iter().map(|each| *each as f32).collect();
        if !wavelengths.is_sorted_by(|one, other| one < other) {
            return reject("wavelengths must be in nm, in ascending order");
        }
        let values = match wavelengths.len() {
            0 => {
                let rows = values(self.readings, "readings")?.into_iter();
                rows.map(|rgb| rgb.map(Vec::from)).collect()
            }
            bands => bands_of(self.readings, bands)?,
        };
        let count = values.len();
        let samples = given.file.recipe().samples();
        let pairs = match self.directions {
            None => {
                if count != samples || given.is_any() {
                    let remedy = match given.is_any() {
                        true => "pass directions, because the recipe has none".to_owned(),
                        false => format!(
                            "readings must have the shape ({samples}, 3), one row for each of the recipe's samples \
                             and NaN for a missing one, not ({count}, 3); or pass directions"
                        ),
                    };
                    return reject(remedy);
                }
                None
            }
            Some(directions) => {
                let Pairs { pairs, shape } = Pairs::from_arrays(directions, None)?;
                if shape != [count] {
                    return reject(format!(
                        "directions must have the shape ({count}, 2, 3), one pair for each of the readings, not {}",
                        shape_text(&[&shape[..], &[2, 3]].concat())
                    ));
                }
                Some(pairs)
            }
        };
        let saturated = match self.saturated {
            None => vec![false; count],
            Some(flags) => {
                let flags = numbers(flags, "saturated")?;
                if flags.shape() != [count] || flags.iter().any(|flag| ![0.0, 1.0].contains(flag)) {
                    return reject(format!(
                        "saturated must be {count} booleans, one for each of the readings"
                    ));
                }
                flags.iter().map(|flag| *flag == 1.0).collect()
            }
        };
        let noise = match self.noise {
            None => None,
            Some(noise) => {
                let noise = numbers(noise, "noise")?;
                if noise.shape() != [count] || !noise.iter().all(|each| (0.0..=10.0).contains(each))
                {
                    return reject(format!(
                        "noise must be {count} standard deviations relative to the readings, each 0 to 10"
                    ));
                }
                Some(noise.iter().map(|each| *each as f32).collect::<Vec<f32>>())
            }
        };
        let readings = values.into_iter().zip(saturated).enumerate();
        let readings = readings.map(|(row, (values, saturated))| LabReading {
            sample: pairs.is_none().then_some(row),
            directions: pairs.as_ref().map(|pairs| pairs[row]),
            values,
            saturated,
            noise: noise.as_ref().map(|noise| noise[row]),
        });
        let readings: Vec<LabReading> = readings.collect();
        Ok(Rows::from_readings(&readings, &wavelengths))
    }

    /// Returns the quantity of the readings.
    fn meaning(&self, samples: usize, rows: &Rows) -> PyResult<ReadingQuantity> {
        let Some(white) = self.white else {
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
            let quantity = match self.quantity {
                Some(name) => ReadingQuantity::Values(choose("quantity", name, &QUANTITIES)?, 1.0),
                None => ReadingQuantity::stated(rows),
            };
            let Some(reflectance) = self.white_reflectance else {
                return Ok(quantity);
            };
            let relative = quantity.relative_to(channels(reflectance, "white_reflectance")?);
            return relative.map_or_else(
                || reject("white_reflectance requires white, or it is one number, and quantity is a reflectance factor"),
                Ok,
            );
        };
        if self.quantity.is_some() {
            return reject("quantity has no effect with white: the readings are counts then");
        }
        if self.saturation.is_some_and(|level| !level.is_finite()) {
            return reject("saturation must be a finite number of counts");
        }
        let channels = |argument: Option<&Bound<'_, PyAny>>, name| {
            argument
                .map(|argument| channels(argument, name))
                .transpose()
        };
        Ok(ReadingQuantity::Counts(CountCalibration::new(
            self.white(white, samples)?,
            channels(self.dark, "dark")?,
            channels(self.white_reflectance, "white_reflectance")?,
            self.saturation,
        )))
    }

    fn white(&self, white: &Bound<'_, PyAny>, samples: usize) -> PyResult<WhiteReference> {
        let (Some(directions), Some(footprint)) = (self.white_directions, self.footprint) else {
            if self.white_directions.is_some() || self.footprint.is_some() {
                return reject(
                    "white_directions and footprint describe a white reference that was read once: pass both",
                );
            }
            let white = values(white, "white")?;
            if white.len() != samples {
                return reject(format!(
                    "white must have the shape ({samples}, 3), the white reference at each of the recipe's samples, \
                     not ({}, 3); or pass white_directions and footprint of a white reference that was read once",
                    white.len()
                ));
            }
            return Ok(WhiteReference::PerSample(white));
        };
        let footprint = choose("footprint", footprint, &FOOTPRINTS)?;
        match &Pairs::from_arrays(directions, None)? {
            Pairs { pairs, shape } if shape.is_empty() => {
                let [incoming, outgoing] = pairs[0].map(|vector| vector.map(|entry| entry as f32));
                Ok(WhiteReference::Single(
                    channels(white, "white")?,
                    Directions { incoming, outgoing },
                    footprint,
                ))
            }
            Pairs { shape, .. } => reject(format!(
                "white_directions must have the shape (2, 3), not {}",
                shape_text(&[&shape[..], &[2, 3]].concat())
            )),
        }
    }
}

/// Returns rows of three channels, with None for missing readings.
fn values(argument: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<Option<[f32; 3]>>> {
    let values = rows(argument, name)?.into_iter().enumerate().map(|(row, rgb)| {
        match rgb.map(f64::is_nan) {
            [false, false, false] => Ok(Some(rgb.map(|value| value as f32))),
            [true, true, true] => Ok(None),
            _ => reject(format!(
                "{name}: row {row} is NaN in some channels only: pass all three values, or NaN for all if the \
                 reading is missing"
            )),
        }
    });
    values.collect()
}

/// Returns rows of bands, with None for missing readings.
fn bands_of(argument: &Bound<'_, PyAny>, bands: usize) -> PyResult<Vec<Option<Vec<f32>>>> {
    let array = numbers(argument, "readings")?;
    if array.ndim() != 2 || array.shape()[1] != bands {
        return reject(format!(
            "readings must have the shape (n, {bands}), one column for each of wavelengths, not {}",
            shape_text(array.shape())
        ));
    }
    let rows = array.outer_iter().enumerate().map(|(row, values)| {
        match values.iter().filter(|value| value.is_nan()).count() {
            0 => Ok(Some(values.iter().map(|value| *value as f32).collect())),
            missing if missing == bands => Ok(None),
            _ => reject(format!(
                "readings: row {row} is NaN in some bands only: pass all, or NaN for all"
            )),
        }
    });
    rows.collect()
}

/// Reads one number for all channels, or one for each.
fn channels(argument: &Bound<'_, PyAny>, name: &str) -> PyResult<[f32; 3]> {
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
