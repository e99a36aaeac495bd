//! The optics of a reading: its instrument, or a goniometer's cones of light and sensor.

use glimpse_core::geometry::{Angles, HalfDifference};
use serde::{Deserialize, Serialize};

use super::angles::above_horizon;
use super::instrument::{Geometry, Instrument};
use crate::choice::Choice;

/// The columns of instruments in tables of a fit.
pub(super) const COLUMNS: &str = "instrument,spread_i,spread_o,value,";

/// The instrument of a reading, and the cones of its light and sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Optics {
    /// The instrument; None for a goniometer.
    pub instrument: Option<Instrument>,
    /// The full angles of the cones, in degrees, 0 to 60.
    pub spread: [f64; 2],
}

impl Optics {
    /// Returns the instrument, if it determines its directions.
    pub fn fixed(self) -> Option<Instrument> {
        self.instrument.filter(|one| *one != Instrument::MultiAngle)
    }

    /// Returns the mean BRDF over the aperture for one gloss unit; None for instruments other than gloss meters.
    pub fn gloss_unit(self) -> Option<f64> {
        self.instrument?.brdf_of_gloss_unit()
    }

    /// Returns the cells of [`COLUMNS`], with the gloss of a mean BRDF.
    pub(super) fn to_csv(self, brdf: Option<[f32; 3]>) -> String {
        let name = self.instrument.as_ref().map(Choice::name);
        let gloss = self.gloss_unit().zip(brdf);
        let gloss = gloss.map(|(unit, [brdf, ..])| format!("{:.4}", f64::from(brdf) / unit));
        let ([light, sensor], name) = (self.spread, name.unwrap_or_default());
        format!("{name},{light},{sensor},{},", gloss.unwrap_or_default())
    }

    /// Returns the geometry of a reading at directions, in radians, which a fixed instrument does not need. None if they are
    /// missing, or not above the horizon.
    pub fn geometry(self, angles: Option<Angles<f64>>) -> Option<Geometry> {
        if let Some(instrument) = self.fixed() {
            return instrument.geometry();
        }
        if self.spread == [0.0; 2] {
            return above_horizon(angles?).map(Geometry::exact);
        }
        let pair = HalfDifference::from_angles(angles?).directions();
        Geometry::new(pair.incoming, pair.outgoing, self.spread)
    }
}
