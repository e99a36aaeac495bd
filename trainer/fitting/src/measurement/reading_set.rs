//! Readings that are planned and evaluated together: those of instruments, and lines of a goniometer.

use clap::ValueEnum;

use super::angles::vector;
use super::instrument::{Geometry, Instrument};
use crate::choice::Choice;

/// A set of readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReadingSet {
    /// Those of an instrument: one, or for a multi-angle instrument six aspecular angles with the light at 45 degrees.
    Of(Instrument),
    /// A goniometer's line in the plane of incidence: the light at 45 degrees, and the sensor from -80 to 80.
    InPlane,
    /// Five such lines, with the light at 5, 20, 40, 60 and 75 degrees.
    FiveLines,
}

/// A reading of a set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlannedReading {
    /// The instrument; None for a goniometer.
    pub instrument: Option<Instrument>,
    /// theta_i, and theta_o, which is positive on the side of the mirror direction, degrees; None for an instrument that
    /// determines its directions.
    pub degrees: Option<[f64; 2]>,
}

impl ReadingSet {
    /// The readings of a laboratory of paint: a multi-angle instrument, a sphere, and gloss at three angles.
    pub const PAINT_LAB: [Self; 6] = [
        Self::Of(Instrument::Gloss20),
        Self::Of(Instrument::Gloss60),
        Self::Of(Instrument::Gloss85),
        Self::Of(Instrument::Sci),
        Self::Of(Instrument::Sce),
        Self::Of(Instrument::MultiAngle),
    ];

    /// Returns the sets of names that are separated by commas: `paint-lab`, `in-plane`, `five-lines` and instruments. None if one
    /// is unknown.
    pub fn parse(names: &str) -> Option<Vec<Self>> {
        let sets = names.split(',').map(|name| match name.trim() {
            "paint-lab" => Some(Self::PAINT_LAB.to_vec()),
            "in-plane" => Some(vec![Self::InPlane]),
            "five-lines" => Some(vec![Self::FiveLines]),
            name => Some(vec![Self::Of(Instrument::from_str(name, true).ok()?)]),
        });
        let sets: Option<Vec<_>> = sets.collect();
        Some(sets?.concat())
    }

    /// Returns the name.
    pub fn name(self) -> String {
        match self {
            Self::Of(instrument) => instrument.name(),
            Self::InPlane => "in-plane".to_owned(),
            Self::FiveLines => "five-lines".to_owned(),
        }
    }

    /// Returns the readings.
    pub fn readings(self) -> Vec<PlannedReading> {
        let line = |theta_i: f64| {
            let sensor = (-16..=16).map(|step| f64::from(5 * step));
            // The sensor cannot be in front of the light.
            let free = sensor.filter(move |theta_o| (theta_i + theta_o).abs() >= 4.0);
            free.map(move |theta_o| Some([theta_i, theta_o]))
        };
        let aspecular = [60.0, 30.0, 20.0, 0.0, -30.0, -65.0];
        let (instrument, degrees) = match self {
            Self::Of(Instrument::MultiAngle) => {
                let degrees = aspecular.map(|theta_o| Some([45.0, theta_o]));
                (Some(Instrument::MultiAngle), degrees.to_vec())
            }
            Self::Of(instrument) => (Some(instrument), vec![None]),
            Self::InPlane => (None, line(45.0).collect()),
            Self::FiveLines => {
                let lights = [5.0, 20.0, 40.0, 60.0, 75.0].into_iter();
                (None, lights.flat_map(line).collect())
            }
        };
        let readings = degrees.into_iter().map(|degrees| PlannedReading {
            instrument,
            degrees,
        });
        readings.collect()
    }

    /// Returns a CSV sheet for the readings of instruments, `instrument,theta_i,theta_o,r,g,b,value`, with angles in degrees.
    pub fn blank_sheet(readings: &[PlannedReading]) -> String {
        let rows = readings.iter().map(|reading| {
            let instrument = reading.instrument.as_ref().map(Choice::name);
            let angles = reading.degrees.map(|[i, o]| format!("{i},{o}"));
            let cells = [instrument, angles.or(Some(",".to_owned()))];
            cells.map(Option::unwrap_or_default).join(",") + ",,,,\n"
        });
        let header = "instrument,theta_i,theta_o,r,g,b,value\n".to_owned();
        header + &rows.collect::<String>()
    }

    /// Returns the geometry of the readings of sets, with both arms of exact directions displaced by an angle in degrees. Those
    /// below the horizon are omitted.
    pub fn geometries(sets: &[Self], displacement: f64) -> Vec<Geometry> {
        let readings = sets.iter().flat_map(|set| set.readings());
        readings
            .filter_map(|reading| reading.geometry(displacement))
            .collect()
    }
}

impl PlannedReading {
    /// Returns the geometry, with both arms of exact directions displaced by an angle in degrees. None if one is below the
    /// horizon.
    pub(super) fn geometry(&self, displacement: f64) -> Option<Geometry> {
        let Some([theta_i, theta_o]) = self.degrees else {
            return self.instrument?.geometry();
        };
        let [light, sensor] =
            [theta_i, -theta_o].map(|theta| vector((theta + displacement).to_radians(), 0.0));
        Geometry::new(light, sensor, [0.0; 2])
    }
}
