//! The directions of common instruments.

use clap::ValueEnum;
use glimpse_core::geometry::Angles;

use super::angles::{above_horizon, from_spherical};

/// An instrument whose directions are fixed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Instrument {
    /// A handheld multi-angle instrument: the light at 45 degrees, and six aspecular angles (ASTM E2539).
    MultiAngle,
    /// The same, and specular gloss at 20, 60 and 80 degrees.
    MultiAngleGloss,
    /// A goniometer's line in the plane of incidence: the light at 45 degrees, and the sensor from -80 to 80.
    InPlane,
    /// Five such lines, with the light at 5, 20, 40, 60 and 75 degrees.
    FiveLines,
}

impl Instrument {
    /// Returns the directions: theta_i, and theta_o, which is positive on the side of the mirror direction, in degrees.
    fn degrees(self) -> Vec<[f64; 2]> {
        let line = |theta_i: f64| {
            let sensor = (-16..=16).map(|step| f64::from(5 * step));
            // The sensor cannot be in front of the light.
            let free = sensor.filter(move |theta_o| (theta_i + theta_o).abs() >= 4.0);
            free.map(move |theta_o| [theta_i, theta_o])
        };
        match self {
            Self::MultiAngle => [60.0, 30.0, 20.0, 0.0, -30.0, -65.0]
                .map(|o| [45.0, o])
                .into(),
            Self::MultiAngleGloss => {
                let gloss = [20.0, 60.0, 80.0].map(|theta| [theta, theta]);
                [Self::MultiAngle.degrees(), gloss.into()].concat()
            }
            Self::InPlane => line(45.0).collect(),
            Self::FiveLines => [5.0, 20.0, 40.0, 60.0, 75.0]
                .into_iter()
                .flat_map(line)
                .collect(),
        }
    }

    /// Returns the directions with both arms displaced by an angle in degrees. Those below the horizon are omitted.
    #[must_use]
    pub fn directions(self, displacement: f64) -> Vec<Angles<f32>> {
        let degrees = self.degrees().into_iter();
        let angles = degrees.filter_map(|[theta_i, theta_o]| {
            let [theta_i, theta_o] =
                [theta_i, -theta_o].map(|theta| (theta + displacement).to_radians());
            above_horizon(from_spherical([theta_i, 0.0, theta_o, 0.0]))
        });
        angles.collect()
    }
}
