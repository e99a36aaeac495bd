//! Instruments with apertures of a standard: gloss meters, spheres, and hand-held colorimeters.

use std::f64::consts::PI;
use std::sync::Arc;

use clap::ValueEnum;
use glimpse_core::geometry::Angles;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use super::angles::{above_horizon, rusinkiewicz, vector};
use super::columns::is_same;
use crate::linear::Aperture;

/// An instrument, as the column `instrument` names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Instrument {
    /// A gloss meter at 20 degrees (ISO 2813, ASTM D523).
    #[value(name = "gloss-20")]
    #[serde(rename = "gloss-20")]
    Gloss20,
    /// A gloss meter at 60 degrees.
    #[value(name = "gloss-60")]
    #[serde(rename = "gloss-60")]
    Gloss60,
    /// A gloss meter at 85 degrees.
    #[value(name = "gloss-85")]
    #[serde(rename = "gloss-85")]
    Gloss85,
    /// A sphere d:8, specular reflection included.
    Sci,
    /// A sphere d:8, specular reflection excluded by a trap of 5 degrees around it.
    Sce,
    /// Light at 45 degrees, from one side or all, and the sensor at the normal, each in a cone of 10 degrees (CIE 15).
    ///
    /// Spreadsheets take the name for a time.
    #[value(name = "45:0", aliases = ["45:00", "45:00:00"])]
    #[serde(rename = "45:0")]
    Light45,
    /// Light at the normal, and the sensor at 45 degrees.
    #[value(name = "0:45", aliases = ["00:45", "0:45:00", "00:45:00"])]
    #[serde(rename = "0:45")]
    Sensor45,
    /// A multi-angle instrument (ASTM E2194, E2539), whose directions are in further columns.
    MultiAngle,
}

/// The geometry of a reading: exact directions, or an aperture around them.
#[derive(Clone, Debug, PartialEq)]
pub struct Geometry {
    /// The directions, or those in the middle of the aperture, angles in radians.
    pub angles: Angles<f32>,
    /// The aperture; None for exact directions.
    pub aperture: Option<Arc<Aperture>>,
}

/// The full angles of a gloss meter's source, in the plane of incidence and across it, degrees (ISO 2813).
const SOURCE: [f64; 2] = [0.75, 2.5];
/// The standard deviation of a gloss meter's number, whose last digit is a tenth, gloss units.
const GLOSS_RESOLUTION: f64 = 0.05;
/// The light's polar angle in a sphere d:8, by reciprocity, and half the angle of its trap, degrees.
const SPHERE: [f64; 2] = [8.0, 5.0];
/// The polar angle at which the sphere's sensor is placed for the estimate of a point, degrees.
const SPHERE_SENSOR: f64 = 45.0;
/// The numbers of nodes of a quadrature: along the plane of incidence or the angle from the mirror direction, and across
/// or around it on one side of the plane. An isotropic material is the same on the other.
///
/// With GGX lobes of roughness 0.01 to 0.3, they are within 1 % of Monte Carlo integrals over source and receptor, at 85 degrees
/// within 1.6 %.
const NODES: [usize; 2] = [17, 8];
/// The degree by which nodes are denser around the mirror direction, for a gloss meter and a sphere.
const DENSITY: [f64; 2] = [5.0, 6.0];

impl Instrument {
    /// Returns the instrument of a name, which may have other capitals and separators of words; None if it is unknown.
    pub fn parse(name: &str) -> Option<Self> {
        let mut all = Self::value_variants().iter().copied();
        all.find(|instrument| {
            let value = instrument.to_possible_value();
            value.is_some_and(|value| value.get_name_and_aliases().any(|own| is_same(own, name)))
        })
    }

    /// Returns the polar angle of a gloss meter, the full angles of its receptor in the plane of incidence and across it, degrees,
    /// and the reflectance of black glass with the index 1.567 there; None for other instruments.
    fn gloss(self) -> Option<(f64, [f64; 2], f64)> {
        Some(match self {
            Self::Gloss20 => (20.0, [1.8, 3.6], 0.049_078),
            Self::Gloss60 => (60.0, [4.4, 11.7], 0.100_056),
            Self::Gloss85 => (85.0, [4.0, 6.0], 0.619_148),
            _ => return None,
        })
    }

    /// Returns the mean BRDF over the aperture for one gloss unit; None for other instruments.
    ///
    /// The number is 100 times the reflected flux in the receptor, relative to that of black glass, which is its Fresnel
    /// reflectance times the light: 100 / R(theta) times the integral of f cos(theta_o).
    pub fn brdf_of_gloss_unit(self) -> Option<f64> {
        let (theta, receptor, black_glass) = self.gloss()?;
        let nodes = gloss_nodes(theta, receptor);
        let integral: f64 = nodes.iter().map(|(_, weight)| weight).sum();
        Some(0.01 * black_glass / integral)
    }

    /// Returns the geometry of a reading; None for an instrument whose directions are its rows'.
    pub fn geometry(self) -> Option<Geometry> {
        let to = |theta: f64, phi: f64| vector(theta.to_radians(), phi.to_radians());
        let [sphere, trap] = SPHERE;
        let (light, sensor, nodes) = match self {
            Self::Gloss20 | Self::Gloss60 | Self::Gloss85 => {
                let (theta, receptor, _) = self.gloss()?;
                let nodes = gloss_nodes(theta, receptor);
                (to(theta, 0.0), to(theta, 180.0), nodes)
            }
            Self::Sci => (to(sphere, 0.0), to(SPHERE_SENSOR, 90.0), sphere_nodes(0.0)),
            Self::Sce => (to(sphere, 0.0), to(SPHERE_SENSOR, 90.0), sphere_nodes(trap)),
            Self::Light45 => return Geometry::new(to(45.0, 0.0), to(0.0, 0.0), [10.0; 2]),
            Self::Sensor45 => return Geometry::new(to(0.0, 0.0), to(45.0, 0.0), [10.0; 2]),
            Self::MultiAngle => return None,
        };
        let pairs = nodes.into_iter();
        let pairs = pairs.map(|(sensor, weight)| (light, sensor, weight));
        let gloss_unit = self.brdf_of_gloss_unit();
        Geometry::of_nodes([light, sensor], pairs, gloss_unit)
    }
}

impl Geometry {
    /// Returns the geometry of a reading exactly at directions, angles in radians.
    pub const fn exact(angles: Angles<f32>) -> Self {
        Self {
            angles,
            aperture: None,
        }
    }

    /// Returns the geometry of light and sensor in cones of these full angles in degrees, up to 0 for an exact direction; None
    /// if a direction is not above the horizon.
    pub fn new(light: [f64; 3], sensor: [f64; 3], spread: [f64; 2]) -> Option<Self> {
        if spread == [0.0; 2] {
            return above_horizon(rusinkiewicz(light, sensor)).map(Self::exact);
        }
        let [lights, sensors] =
            [(light, spread[0], 0.0), (sensor, spread[1], 0.5)].map(|(axis, spread, turn)| {
                let radius = 0.5 * spread.to_radians();
                // A rule of degree 5 on the disc: its center, and six points.
                let ring = (0..6).map(move |step| {
                    let phi = (f64::from(step) + turn) * PI / 3.0;
                    (around(axis, radius * f64::sqrt(2.0 / 3.0), phi), 0.125)
                });
                let ring = ring.take(if spread > 0.0 { 6 } else { 0 });
                ring.chain([(axis, 0.25)]).collect::<Vec<_>>()
            });
        let pairs = lights.iter().flat_map(|(light, share)| {
            let sensors = sensors.iter();
            sensors.map(move |(sensor, other)| (*light, *sensor, share * other))
        });
        Self::of_nodes([light, sensor], pairs, None)
    }

    /// Returns the geometry of weighted pairs of light and sensor, without those below the horizon. Readings in gloss units are
    /// gray.
    fn of_nodes(
        [light, sensor]: [[f64; 3]; 2],
        pairs: impl Iterator<Item = ([f64; 3], [f64; 3], f64)>,
        gloss_unit: Option<f64>,
    ) -> Option<Self> {
        let pairs = pairs.filter_map(|(light, sensor, weight)| {
            Some((above_horizon(rusinkiewicz(light, sensor))?, weight))
        });
        let mut directions: Vec<(Angles<f32>, f64)> = pairs.collect();
        let sum: f64 = directions.iter().map(|(_, weight)| weight).sum();
        directions.iter_mut().for_each(|(_, weight)| *weight /= sum);
        Some(Self {
            angles: above_horizon(rusinkiewicz(light, sensor))?,
            aperture: Some(Arc::new(Aperture {
                directions,
                is_gray: gloss_unit.is_some(),
                resolution: GLOSS_RESOLUTION * gloss_unit.unwrap_or_default(),
            })),
        })
    }
}

/// Returns the direction at an angle from an axis, and at an azimuth around it, both in radians.
fn around(axis: [f64; 3], angle: f64, azimuth: f64) -> [f64; 3] {
    let [x, y, z] = axis;
    let sine = x.hypot(y);
    let (cos, sin) = if sine > 1e-9 {
        (x / sine, y / sine)
    } else {
        (1.0, 0.0)
    };
    let (along, across) = (angle.sin() * azimuth.cos(), angle.sin() * azimuth.sin());
    let polar = [cos * z, sin * z, -sine];
    [0, 1, 2].map(|i| angle.cos() * axis[i] + along * polar[i] + across * [-sin, cos, 0.0][i])
}

/// Returns nodes from 0 to 1, or with a second half from -1 to 1, and their weights in an integral: those of Gauss and Legendre
/// after the substitution x = sinh(d t) / sinh(d), by which they are denser around 0.
fn nodes(count: usize, is_symmetric: bool, density: f64) -> Vec<(f64, f64)> {
    // Golub and Welsch 1969: the eigenvalues of the recurrence's matrix, and the first entries of its eigenvectors.
    let entry = |i: usize, j: usize| {
        let k = i.max(j) as f64;
        if i.abs_diff(j) == 1 {
            k / (4.0 * k * k - 1.0).sqrt()
        } else {
            0.0
        }
    };
    let eigen = DMatrix::from_fn(count, count, entry).symmetric_eigen();
    let first = eigen.eigenvectors.row(0);
    let pairs = eigen.eigenvalues.iter().zip(first.iter());
    let nodes = pairs.map(|(node, first)| {
        let (t, weight) = if is_symmetric {
            (*node, 2.0 * first * first)
        } else {
            (0.5 * (node + 1.0), first * first)
        };
        let scale = density.sinh();
        (
            (density * t).sinh() / scale,
            weight * density * (density * t).cosh() / scale,
        )
    });
    nodes.collect()
}

/// Returns directions of a gloss meter's sensor, and their shares of the integral of f cos(theta_o) for the light at
/// (theta, 0), whose angles are in degrees. A pair of points in source and receptor counts as the light in the middle of the
/// source, and the sensor at their difference.
fn gloss_nodes(theta: f64, receptor: [f64; 2]) -> Vec<([f64; 3], f64)> {
    let [along, across] = [0, 1].map(|side: usize| {
        let (wide, narrow) = (
            receptor[side].max(SOURCE[side]),
            receptor[side].min(SOURCE[side]),
        );
        let end = 0.5 * (wide + narrow);
        let nodes = nodes(NODES[side], side == 0, DENSITY[0]).into_iter();
        let nodes =
            nodes.map(|(x, weight)| (end * x, weight * (end * (1.0 - x.abs()) / narrow).min(1.0)));
        let nodes: Vec<(f64, f64)> = nodes.collect();
        // All pairs have the angle of the wider one in common; across, half of them are on one side.
        let sum: f64 = nodes.iter().map(|(_, weight)| weight).sum();
        let scale = wide.to_radians() / sum;
        nodes
            .into_iter()
            .map(|(x, weight)| (x.to_radians(), scale * weight))
            .collect::<Vec<_>>()
    });
    let nodes = along.iter().flat_map(|(x, width)| {
        across.iter().map(move |(y, height)| {
            let [sx, _, sz] = vector(theta.to_radians() + x, PI);
            let sensor = [sx * y.cos(), y.sin(), sz * y.cos()];
            (sensor, width * height * y.cos() * sensor[2].max(0.0))
        })
    });
    nodes.collect()
}

/// Returns directions of a sphere's sensor, and their weights cos(theta_o) d omega, without those within an angle in degrees of
/// the mirror direction.
fn sphere_nodes(trap: f64) -> Vec<([f64; 3], f64)> {
    let mirror = vector(SPHERE[0].to_radians(), PI);
    let (first, end) = (trap.to_radians(), PI / 2.0 + SPHERE[0].to_radians());
    let nodes = nodes(NODES[0], false, DENSITY[1]).into_iter();
    let nodes = nodes.flat_map(|(x, width)| {
        (0..NODES[1]).map(move |step| {
            let azimuth = PI * (step as f64 + 0.5) / NODES[1] as f64;
            let angle = first + (end - first) * x;
            let sensor = around(mirror, angle, azimuth);
            (sensor, width * angle.sin() * sensor[2].max(0.0))
        })
    });
    nodes.collect()
}

#[cfg(test)]
mod tests {
    use glimpse_core::geometry::HalfDifference;
    use glimpse_core::model::ModelKind;
    use glimpse_materials::{Brdf, FittedBrdf, Procedural};

    use super::*;
    use crate::linear::{MIN_NOISE, Posterior, PosteriorReading};
    use crate::measurement::{NamedRecipe, ReadingSet};

    fn posterior(readings: &[PosteriorReading]) -> Posterior {
        let prior = NamedRecipe::any(ModelKind::Linear).prior;
        Posterior::new(&prior, readings).expect("finite")
    }

    /// Iterated linearization converges: the fit has the means that were read, up to the resolution of gloss.
    #[test]
    fn fit_has_the_means_over_apertures() {
        let geometries = ReadingSet::geometries(&ReadingSet::PAINT_LAB, 0.0);
        for material in Procedural::set(4, 11) {
            let readings = geometries.iter().map(|geometry| PosteriorReading {
                brdf: match &geometry.aperture {
                    None => material.at_angles(geometry.angles),
                    Some(aperture) => aperture.mean(&material),
                },
                aperture: geometry.aperture.clone(),
                noise: MIN_NOISE,
                angles: geometry.angles,
            });
            let readings: Vec<PosteriorReading> = readings.collect();
            let posterior = posterior(&readings);
            let basis = posterior.basis().with_kernels(posterior.kernels());
            let values = posterior.coefficients().concat();
            let fit = FittedBrdf::new(ModelKind::Linear, values, Some(&basis));
            let fit = fit.expect("values of the basis");
            for reading in &readings {
                let (fitted, resolution) = match &reading.aperture {
                    None => (fit.at_angles(reading.angles), 0.0),
                    Some(aperture) => (aperture.mean(&fit), aperture.resolution as f32),
                };
                for (fitted, read) in fitted.iter().zip(reading.brdf) {
                    let error = (fitted - read).abs();
                    assert!(error < 0.002 * read + resolution, "{fitted} {read}");
                }
            }
        }
    }

    /// If an aperture of one direction is gray, the color remains that of the prior.
    #[test]
    fn aperture_of_one_direction_is_a_reading_there() {
        let material = Procedural::new(3, 7);
        let angles = Angles::from_array([0.2, 0.5, 1.0]);
        let exact = PosteriorReading::new(angles, material.at_angles(angles));
        let with = |is_gray: bool| {
            let aperture = Aperture {
                directions: vec![(angles, 1.0)],
                is_gray,
                resolution: 0.0,
            };
            let aperture = Some(Arc::new(aperture));
            let reading = PosteriorReading {
                aperture,
                ..exact.clone()
            };
            posterior(&[reading]).coefficients()
        };
        let (expected, found) = (
            posterior(std::slice::from_ref(&exact)).coefficients(),
            with(false),
        );
        for (one, other) in found.iter().flatten().zip(expected.iter().flatten()) {
            assert!(
                (one - other).abs() < 1e-4 * (1.0 + other.abs()),
                "{one} {other}"
            );
        }
        let [red, green, blue] = with(true);
        assert!(red == green && green == blue && red != expected[0]);
    }

    /// The number of a mirror is that of black glass, divided by its reflectance, and a perfect diffuser's is the receptor's
    /// projected solid angle over pi, relative to it. A perfect diffuser has a mean BRDF of 1 / pi in each geometry.
    #[test]
    fn numbers_of_standards_are_known() {
        let white = |_: &HalfDifference<f32>| [std::f32::consts::FRAC_1_PI; 3];
        let gloss = [
            (Instrument::Gloss20, 2037.6, 1.8 * 3.6, 20.0),
            (Instrument::Gloss60, 999.44, 4.4 * 11.7, 60.0),
            (Instrument::Gloss85, 161.51, 4.0 * 6.0, 85.0),
        ];
        for (instrument, mirror, square_degrees, theta) in gloss {
            let solid = square_degrees * f64::to_radians(1.0).powi(2);
            let expected = mirror * solid * f64::to_radians(theta).cos() / PI;
            let unit = instrument.brdf_of_gloss_unit().expect("gloss");
            let ratio = 1.0 / PI / unit / expected;
            assert!((ratio - 1.0).abs() < 0.01, "{instrument:?}: {ratio}");
        }
        for instrument in Instrument::value_variants() {
            let aperture = instrument.geometry().and_then(|geometry| geometry.aperture);
            if let Some(aperture) = aperture {
                let [mean, ..] = aperture.mean(&white);
                assert!(
                    (mean * std::f32::consts::PI - 1.0).abs() < 1e-5,
                    "{instrument:?}"
                );
            }
        }
    }
}
