//! Readings in arrays, interpreted like the trainer's measurement files.

use std::path::PathBuf;

use glimpse_fitting::choice::Choice;
use glimpse_fitting::measurement::{
    AngleArgs, CountCalibration, LabReading, LargerSpot, NamedRecipe, Optics, ReadingQuantity,
    ReadingRows, Readings, TableArgs, rusinkiewicz,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Pairs, channels, numbers, rows};
use crate::choices::choose;
use crate::error::{Result, reject};
use crate::interruptible::run_detached;

/// The keyword arguments of `Recipe.fit` that describe readings. Each is taken once; those that remain have no effect.
pub(crate) struct ReadingArgs<'py>(pub(crate) Bound<'py, PyDict>);

impl<'py> ReadingArgs<'py> {
    /// Takes the readings of a recipe's samples: those of an array at `directions`, or of a file.
    pub(crate) fn readings(
        &self,
        given: &NamedRecipe,
        readings: &Bound<'py, PyAny>,
        directions: Option<&Bound<'py, PyAny>>,
    ) -> Result<Readings> {
        let path = readings.extract::<PathBuf>().ok();
        // One number for all readings, or else an array.
        let noise = self.0.get_item("noise")?;
        let noise = noise.and_then(|noise| noise.extract::<f32>().ok());
        if let Some(noise) = noise {
            if !(0.0..=1.0).contains(&noise) {
                return reject(format!("noise must be 0 to 1, not {noise}"));
            }
            self.0.del_item("noise")?;
        }
        let mut rows = match &path {
            Some(_) if directions.is_some() => {
                return reject("directions has no effect: the file of readings states them");
            }
            Some(path) => {
                let names = |name| -> Result<Vec<String>> {
                    let names = self.take(name)?.map(|names| names.extract());
                    Ok(names.transpose()?.unwrap_or_default())
                };
                let convention = names("convention")?;
                let convention = convention
                    .iter()
                    .map(|name| choose("convention", Some(name)));
                let convention = convention.collect::<Result<Vec<_>>>()?;
                let args = TableArgs {
                    angles: AngleArgs {
                        unit: self.take_choice("unit")?,
                        azimuth_unit: self.take_choice("azimuth_unit")?,
                        convention: convention.into_iter().flatten().collect(),
                    },
                    ignore: names("ignore")?,
                };
                ReadingRows::read(path, &args)?
            }
            None => self.rows(given, readings, directions)?,
        };
        rows.noise = noise;
        let quantity = match self.take("white")? {
            None => self.multiple(&rows)?,
            Some(white) => {
                let count = path.is_none().then(|| readings.len()).transpose()?;
                self.counts(&white, count, directions)?
            }
        };
        self.finish()?;
        let new = || Readings::new(given, rows, quantity);
        Ok(run_detached(self.0.py(), new)??)
    }

    /// Takes an argument, or None.
    fn take(&self, name: &str) -> Result<Option<Bound<'py, PyAny>>> {
        let value = self.0.call_method1("pop", (name, self.0.py().None()))?;
        Ok(Some(value).filter(|value| !value.is_none()))
    }

    /// Takes an array, or nothing. `meaning` describes valid numbers.
    fn take_numbers(
        &self,
        name: &str,
        shape: &[usize],
        meaning: &str,
        is_valid: fn(f32) -> bool,
    ) -> Result<Vec<f32>> {
        let Some(argument) = self.take(name)? else {
            return Ok(Vec::new());
        };
        let array = numbers(&argument, name)?;
        let values: Vec<f32> = array.iter().map(|value| *value as f32).collect();
        if array.shape() != shape || !values.iter().copied().all(is_valid) {
            return reject(format!("{name} must be {meaning}"));
        }
        Ok(values)
    }

    /// Takes one number for all channels, or one for each.
    fn take_channels(&self, name: &str) -> Result<Option<[f32; 3]>> {
        let argument = self.take(name)?;
        argument
            .map(|argument| channels(&argument, name))
            .transpose()
    }

    /// Takes the name of a choice.
    fn take_choice<T: Choice>(&self, name: &str) -> Result<Option<T>> {
        let value = self.take(name)?.map(|value| value.extract::<String>());
        choose(name, value.transpose()?.as_deref())
    }

    /// Refuses arguments that were not taken.
    fn finish(&self) -> Result<()> {
        let module = self.0.py().import("glimpse_brdf._arrays")?;
        module.call_method1("refuse_unused", (&self.0,))?;
        Ok(())
    }

    /// Takes the readings of an array.
    fn rows(
        &self,
        given: &NamedRecipe,
        argument: &Bound<'py, PyAny>,
        directions: Option<&Bound<'py, PyAny>>,
    ) -> Result<ReadingRows> {
        let wavelengths = match self.take("wavelengths")? {
            Some(nm) => numbers(&nm, "wavelengths")?.into_iter().collect(),
            None => Vec::new(),
        };
        let wavelengths: Vec<f32> = wavelengths.into_iter().map(|nm| nm as f32).collect();
        if !wavelengths.is_sorted_by(|one, other| one < other) {
            return reject("wavelengths must be in nm, in ascending order");
        }
        let names = self.take("instrument")?.map(|names| names.extract());
        let names: Vec<Option<String>> = names.transpose()?.unwrap_or_default();
        let names = names.iter().map(Option::as_deref);
        let instruments = names.map(|name| choose("instrument", name));
        let instruments = instruments.collect::<Result<Vec<_>>>()?;
        let optics = instruments.into_iter().map(|instrument| Optics {
            instrument,
            ..Optics::default()
        });
        let optics: Vec<Optics> = optics.collect();
        if directions.is_none() && optics.is_empty() && given.is_any() {
            return reject("pass directions, because the recipe has none");
        }
        let channels = if wavelengths.is_empty() {
            3
        } else {
            wavelengths.len()
        };
        let own = directions.is_none().then(|| given.file.recipe().samples());
        let count = Some(optics.len()).filter(|count| *count > 0).or(own);
        let hint = ", one row for each of the recipe's samples and NaN for a missing one, or pass directions";
        let hint = if directions.is_none() { hint } else { "" };
        let shape = (count, channels);
        let mut readings = lab_readings(argument, "readings", shape, hint, directions, &optics)?;
        let count = readings.len();
        let meaning = format!("{count} booleans, one for each of the readings");
        let is_valid = |flag| [0.0, 1.0].contains(&flag);
        let saturated = self.take_numbers("saturated", &[count], &meaning, is_valid)?;
        for (reading, flag) in readings.iter_mut().zip(saturated) {
            reading.saturated = flag == 1.0;
        }
        let meaning = format!("{count} standard deviations relative to the readings, each 0 to 10");
        let is_valid = |level| (0.0..=10.0).contains(&level);
        let noise = self.take_numbers("noise", &[count], &meaning, is_valid)?;
        for (reading, level) in readings.iter_mut().zip(noise) {
            reading.noise = Some(level);
        }
        Ok(ReadingRows::from_array("readings", wavelengths, readings))
    }

    /// Returns the quantity of readings that are not counts.
    fn multiple(&self, rows: &ReadingRows) -> Result<ReadingQuantity> {
        let multiple = self.take_choice("quantity")?;
        let reflectance = self.take_channels("white_reflectance")?;
        ReadingQuantity::of_values(multiple, reflectance, rows).map_or_else(
            || reject("white_reflectance requires white, or it is one number, and quantity is a reflectance factor"),
            Ok,
        )
    }

    /// Returns the quantity of counts, relative to those of a white reference: of each of `count` readings in an array, or of
    /// a single pair of directions.
    fn counts(
        &self,
        white: &Bound<'py, PyAny>,
        count: Option<usize>,
        directions: Option<&Bound<'py, PyAny>>,
    ) -> Result<ReadingQuantity> {
        let footprint: Option<LargerSpot> = self.take_choice("footprint")?;
        let white = match (self.take("white_directions")?, footprint) {
            (None, None) => lab_readings(
                white,
                "white",
                (count, 3),
                ", the white reference at each of the readings, or pass white_directions and footprint of one that was read once",
                directions,
                &[],
            )?,
            (Some(once), Some(_)) => {
                let Pairs { pairs, shape } = Pairs::from_arrays(&once, None, &[])?;
                let ([[incoming, outgoing]], []) = (&pairs[..], &shape[..]) else {
                    return reject("white_directions must have the shape (2, 3)");
                };
                vec![LabReading {
                    angles: Some(rusinkiewicz(*incoming, *outgoing)),
                    numbers: channels(white, "white")?.to_vec(),
                    ..LabReading::default()
                }]
            }
            _ => {
                return reject(
                    "white_directions and footprint describe a white reference that was read once: pass both",
                );
            }
        };
        let meaning = "a finite number of counts";
        let saturation = self.take_numbers("saturation", &[], meaning, f32::is_finite)?;
        Ok(ReadingQuantity::Counts(CountCalibration {
            dark: self.take_channels("dark")?,
            reflectance: self.take_channels("white_reflectance")?,
            saturation: saturation.first().copied(),
            white: ReadingRows::from_array("white", Vec::new(), white),
            footprint: footprint.map(Into::into),
        }))
    }
}

/// Returns the readings in the rows of an array, without numbers if they are missing. They are at `directions`, which those of
/// fixed instruments may lack, or else at the recipe's samples.
fn lab_readings(
    argument: &Bound<'_, PyAny>,
    name: &str,
    shape: (Option<usize>, usize),
    hint: &str,
    directions: Option<&Bound<'_, PyAny>>,
    optics: &[Optics],
) -> Result<Vec<LabReading>> {
    let array = rows(argument, name, shape, hint)?;
    let count = array.shape()[0];
    let free = optics.iter().map(|optics| optics.fixed().is_some());
    let free: Vec<bool> = free.collect();
    let at = directions.map(|directions| Pairs::from_arrays(directions, None, &free));
    let at = at.transpose()?;
    if let Some(Pairs { shape, .. }) = &at
        && *shape != [count]
    {
        return reject(format!(
            "directions must have the shape ({count}, 2, 3), one pair for each of the readings, not {shape:?} pairs"
        ));
    }
    let readings = array.outer_iter().enumerate().map(|(index, values)| {
        let present = values.iter().filter(|value| !value.is_nan());
        let numbers: Vec<f32> = present.map(|value| *value as f32).collect();
        if !numbers.is_empty() && numbers.len() < values.len() {
            return reject(format!(
                "{name}: row {index} is NaN in some channels only: pass all values, or NaN for all if the reading is missing"
            ));
        }
        let pair = at.as_ref().map(|at| at.pairs[index]);
        let stated = pair.filter(|pair| pair.iter().flatten().all(|x| x.is_finite()));
        Ok(LabReading {
            line: index,
            index: (pair.is_none() && optics.is_empty()).then_some(index),
            angles: stated.map(|[incoming, outgoing]| rusinkiewicz(incoming, outgoing)),
            optics: optics.get(index).copied().unwrap_or_default(),
            numbers,
            ..LabReading::default()
        })
    });
    readings.collect()
}
