//! Readings in arrays, as the trainer takes those of files.

use glimpse_core::geometry::{Angles, Directions};
use glimpse_core::gonio::Quantity;
use glimpse_trainer::measurement::{Counts, Meaning, Measured, Taken, White};
use pyo3::prelude::*;

use crate::arrays::{Pairs, numbers, rows, shown};
use crate::choices::{FOOTPRINTS, QUANTITIES, choose};
use crate::error::{raised, refused};

/// How far a reading may be from its sample unless told, degrees: what arms of a lab are off by.
const TOLERANCE: f64 = 0.5;

/// What is said of readings.
pub(crate) struct ReadingArgs<'a, 'py> {
    pub(crate) readings: &'a Bound<'py, PyAny>,
    pub(crate) directions: Option<&'a Bound<'py, PyAny>>,
    pub(crate) quantity: Option<&'a str>,
    /// Degrees.
    pub(crate) tolerance: Option<f64>,
    pub(crate) saturated: Option<&'a Bound<'py, PyAny>>,
    pub(crate) white: Option<&'a Bound<'py, PyAny>>,
    pub(crate) white_directions: Option<&'a Bound<'py, PyAny>>,
    pub(crate) footprint: Option<&'a str>,
    pub(crate) dark: Option<&'a Bound<'py, PyAny>>,
    pub(crate) white_reflectance: Option<&'a Bound<'py, PyAny>>,
    pub(crate) saturation: Option<f32>,
}

impl ReadingArgs<'_, '_> {
    /// By the samples of a pattern.
    pub(crate) fn measured(&self, pattern: &[Angles<f32>]) -> PyResult<Measured> {
        let values = values(self.readings, "readings")?;
        let count = values.len();
        let pairs = match self.directions {
            None => {
                if count != pattern.len() {
                    return refused(format!(
                        "readings should have the shape ({}, 3), one for each of the recipe's samples, NaN where \
                         nothing was read, not ({count}, 3); or give directions",
                        pattern.len()
                    ));
                }
                if self.tolerance.is_some() {
                    return refused("tolerance_degrees has no effect without directions");
                }
                None
            }
            Some(given) => {
                let Pairs { pairs, shape } = Pairs::of(given, None)?;
                if shape != [count] {
                    return refused(format!(
                        "directions should have the shape ({count}, 2, 3), one pair for each of the readings, not {}",
                        shown(&[&shape[..], &[2, 3]].concat())
                    ));
                }
                Some(pairs)
            }
        };
        let saturated = match self.saturated {
            None => vec![false; count],
            Some(given) => {
                let flags = numbers(given, "saturated")?;
                if flags.shape() != [count] || flags.iter().any(|flag| ![0.0, 1.0].contains(flag)) {
                    return refused(format!(
                        "saturated should be {count} booleans, one for each of the readings"
                    ));
                }
                flags.iter().map(|flag| *flag == 1.0).collect()
            }
        };
        let taken = values.into_iter().zip(saturated).enumerate();
        let taken = taken.map(|(row, (values, saturated))| Taken {
            sample: pairs.is_none().then_some(row),
            at: pairs.as_ref().map(|pairs| pairs[row]),
            values,
            saturated,
        });
        let tolerance = self.tolerance.unwrap_or(TOLERANCE);
        if !(tolerance > 0.0 && tolerance <= 180.0) {
            return refused("tolerance_degrees should be above 0, at most 180");
        }
        let meaning = self.meaning(pattern.len())?;
        let taken: Vec<Taken> = taken.collect();
        Measured::of(&taken, pattern, tolerance.to_radians(), &meaning).map_err(raised)
    }

    /// What the numbers are.
    fn meaning(&self, samples: usize) -> PyResult<Meaning> {
        let Some(white) = self.white else {
            let given = [
                ("white_directions", self.white_directions.is_some()),
                ("footprint", self.footprint.is_some()),
                ("dark", self.dark.is_some()),
                ("white_reflectance", self.white_reflectance.is_some()),
                ("saturation", self.saturation.is_some()),
            ];
            if let Some((name, _)) = given.iter().find(|(_, given)| *given) {
                return refused(format!(
                    "{name} has no effect without white, by which counts become a BRDF"
                ));
            }
            let quantity = self
                .quantity
                .map(|word| choose("quantity", word, &QUANTITIES));
            return Ok(Meaning::Values(
                quantity.transpose()?.unwrap_or(Quantity::Brdf),
            ));
        };
        if self.quantity.is_some() {
            return refused("quantity has no effect with white: the numbers are counts then");
        }
        if self.saturation.is_some_and(|level| !level.is_finite()) {
            return refused("saturation should be a finite number of counts");
        }
        let channels = |given: Option<&Bound<'_, PyAny>>, what, default: f32| match given {
            None => Ok([default; 3]),
            Some(given) => channels(given, what),
        };
        Ok(Meaning::Counts(Counts {
            dark: channels(self.dark, "dark", 0.0)?,
            reflectance: channels(self.white_reflectance, "white_reflectance", 0.99)?,
            saturation: self.saturation,
            white: self.white(white, samples)?,
        }))
    }

    fn white(&self, white: &Bound<'_, PyAny>, samples: usize) -> PyResult<White> {
        let (Some(at), Some(footprint)) = (self.white_directions, self.footprint) else {
            if self.white_directions.is_some() || self.footprint.is_some() {
                return refused(
                    "white_directions and footprint go together: they are of a white that was read once",
                );
            }
            let each = values(white, "white")?;
            if each.len() != samples {
                return refused(format!(
                    "white should have the shape ({samples}, 3), the white at each of the recipe's samples, not \
                     ({}, 3); or give white_directions and footprint, of a white that was read once",
                    each.len()
                ));
            }
            return Ok(White::Each(
                each.into_iter().map(|white| [white, None]).collect(),
            ));
        };
        let footprint = choose("footprint", footprint, &FOOTPRINTS)?;
        match &Pairs::of(at, None)? {
            Pairs { pairs, shape } if shape.is_empty() => {
                let [incoming, outgoing] = pairs[0].map(|vector| vector.map(|entry| entry as f32));
                let at = Directions { incoming, outgoing };
                Ok(White::Once(channels(white, "white")?, at, footprint))
            }
            Pairs { shape, .. } => refused(format!(
                "white_directions should have the shape (2, 3), not {}",
                shown(&[&shape[..], &[2, 3]].concat())
            )),
        }
    }
}

/// Rows of three channels; None where nothing was read.
fn values(given: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec<Option<[f32; 3]>>> {
    let each = rows(given, what)?.into_iter().enumerate().map(|(row, rgb)| {
        let absent = rgb.map(f64::is_nan);
        match absent {
            [false, false, false] => Ok(Some(rgb.map(|value| value as f32))),
            [true, true, true] => Ok(None),
            _ => refused(format!(
                "{what}: row {row} is NaN in some channels and not in the others; give all three, or NaN for all \
                 if nothing was read"
            )),
        }
    });
    each.collect()
}

/// One number for all channels, or one for each.
fn channels(given: &Bound<'_, PyAny>, what: &str) -> PyResult<[f32; 3]> {
    let given: Vec<f64> = numbers(given, what)?.iter().copied().collect();
    match given[..] {
        [one] => Ok([one as f32; 3]),
        [r, g, b] => Ok([r, g, b].map(|number| number as f32)),
        _ => refused(format!("{what} should be one number, or three")),
    }
}
