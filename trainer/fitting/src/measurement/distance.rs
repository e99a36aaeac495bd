//! The distance between two pairs of directions.

use glimpse_core::geometry::Arms;

use crate::route::wrapped;

/// The distance between two pairs of directions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AngularDistance {
    /// The largest difference of the three angles, in degrees.
    pub degrees: f64,
    /// The angle that differs most.
    pub angle: &'static str,
}

impl AngularDistance {
    /// Returns the distance between two positions of the arms in degrees: the largest of three differences. These are the
    /// differences of theta_i, of theta_o, and of phi_o - phi_i times the smallest sine of the polar angles. The sine is
    /// small near the normal, where azimuths matter little.
    #[must_use]
    pub fn between(one: &Arms<f64>, other: &Arms<f64>) -> Self {
        let azimuth = wrapped(one.phi_o - one.phi_i - (other.phi_o - other.phi_i));
        let polar = [one.theta_i, one.theta_o, other.theta_i, other.theta_o];
        let sines = polar.map(|theta| theta.to_radians().sin());
        let differences = [
            ("theta_i", one.theta_i - other.theta_i),
            ("theta_o", one.theta_o - other.theta_o),
            (
                "phi_o - phi_i, scaled by the smallest sine of a polar angle",
                azimuth * sines.into_iter().fold(1.0, f64::min),
            ),
        ];
        let distances = differences.map(|(angle, difference)| Self {
            degrees: difference.abs(),
            angle,
        });
        // NaN counts as the largest distance. Of equal ones, the first counts.
        let distances = distances.into_iter().rev();
        let largest = distances.max_by(|one, other| one.degrees.total_cmp(&other.degrees));
        largest.unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn degrees(theta_i: f64, theta_o: f64, phi_o: f64) -> Arms<f64> {
        Arms {
            theta_i,
            phi_i: 0.0,
            theta_o,
            phi_o,
        }
    }

    #[test]
    fn distance_weights_azimuth_by_smallest_sine() {
        let azimuth = Some("phi_o - phi_i");
        for (to, degrees_off, angle) in [
            (degrees(30.2, 60.1, 179.0), 0.2, Some("theta_i")),
            (degrees(30.1, 59.6, 179.0), 0.4, Some("theta_o")),
            // The azimuths differ by 2 degrees, across 180; times sin(30 degrees).
            (degrees(30.0, 60.0, -179.0), 1.0, azimuth),
            (degrees(30.0, 60.0, 179.0 + 720.0), 0.0, Some("theta_i")),
        ] {
            let distance = AngularDistance::between(&degrees(30.0, 60.0, 179.0), &to);
            assert!(
                (distance.degrees - degrees_off).abs() < 1e-6,
                "{distance:?}"
            );
            assert_eq!(distance.angle.split(',').next(), angle);
        }
        // At the normal the azimuth does not matter.
        let normal = AngularDistance::between(&degrees(0.0, 60.0, 0.0), &degrees(0.0, 60.0, 90.0));
        assert!(normal.degrees < 1e-12);
    }
}
