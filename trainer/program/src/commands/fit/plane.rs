//! Readings in or near the plane of incidence, for plots of lobes.

use std::collections::BTreeSet;

use glimpse_fitting::measurement::{ReadingStatus, SampleReading};
use glimpse_fitting::route::relative_arms;
use glimpse_materials::luminance;

use crate::report::ReadingMark;

/// The number of plotted polar angles of the light.
const COUNT: usize = 3;
/// Polar angles of the light without readings in the plane. All polar angles are in tenths of a degree.
const DEFAULT_THETA_I: [i32; COUNT] = [150, 450, 750];
/// The smallest distance of a default angle from those of readings.
const MIN_SPACING: i32 = 100;
/// The largest distance of a plotted reading from the plane, and of its light from that of the plot.
const MAX_DISTANCE: i32 = 20;

/// A reading in the plane of incidence.
pub(super) struct PlaneReading {
    /// The polar angles of light and sensor.
    theta: [i32; 2],
    /// -1 if the sensor is on the light's side of the normal, or else 1.
    side: i32,
    luminance: f32,
    is_used: bool,
}

impl PlaneReading {
    /// Creates a reading; None if it is missing or not in the plane.
    pub(super) fn new(sample: &SampleReading) -> Option<Self> {
        let arms = relative_arms(sample.angles);
        let (sin_phi, cos_phi) = arms.phi_o.to_radians().sin_cos();
        let sin_theta = arms.theta_i.min(arms.theta_o).to_radians().sin();
        let from_plane = (sin_theta * sin_phi.abs()).asin().to_degrees();
        let is_near = 10.0 * from_plane <= MAX_DISTANCE.into();
        Some(Self {
            luminance: luminance(sample.brdf.mean().filter(|_| is_near)?),
            theta: [arms.theta_i, arms.theta_o].map(|degrees| (10.0 * degrees).round() as i32),
            side: if cos_phi > 0.0 { -1 } else { 1 },
            is_used: sample.status == ReadingStatus::Used,
        })
    }

    /// Returns the polar angles of light and sensor, exchanged if that brings the light nearer to `theta_i`. None if the
    /// light is too far from it.
    fn arms_near(&self, theta_i: i32) -> Option<[i32; 2]> {
        let mut arms = self.theta;
        arms.sort_by_key(|theta| (theta - theta_i).abs());
        ((arms[0] - theta_i).abs() <= MAX_DISTANCE).then_some(arms)
    }

    /// Returns the mark of the reading in the plot of a light; None if its light is elsewhere.
    pub(super) fn mark(&self, theta_i: i32) -> Option<ReadingMark> {
        let [_, theta_o] = self.arms_near(theta_i)?;
        Some(ReadingMark {
            point: [radians(self.side * theta_o), self.luminance],
            is_used: self.is_used,
        })
    }
}

/// Converts an angle from tenths of a degree.
pub(super) fn radians(tenths: i32) -> f32 {
    (tenths as f32 / 10.0).to_radians()
}

/// Returns up to three polar angles of the light, ascending. They are the most frequent ones of readings, and with few of
/// them default ones.
pub(super) fn plotted_theta_i(readings: &[PlaneReading]) -> Vec<i32> {
    let mut plotted = Vec::new();
    let mut rest: Vec<&PlaneReading> = readings.iter().collect();
    for _ in 0..COUNT {
        let candidates: BTreeSet<i32> = rest.iter().flat_map(|reading| reading.theta).collect();
        let best = candidates.into_iter().max_by_key(|theta_i| {
            let near = rest
                .iter()
                .filter_map(|reading| reading.arms_near(*theta_i));
            let weights = near.map(|[light, _]| 1 + MAX_DISTANCE - (light - theta_i).abs());
            (weights.sum::<i32>(), DEFAULT_THETA_I.contains(theta_i))
        });
        plotted.extend(best);
        rest.retain(|reading| best.is_some_and(|best| reading.arms_near(best).is_none()));
    }
    for theta_i in DEFAULT_THETA_I {
        let is_far = |other: &i32| (theta_i - other).abs() >= MIN_SPACING;
        if plotted.len() < COUNT && plotted.iter().all(is_far) {
            plotted.push(theta_i);
        }
    }
    plotted.sort_unstable();
    plotted
}

#[cfg(test)]
mod tests {
    use glimpse_core::geometry::{Arms, HalfDifference};
    use glimpse_materials::angles_of;

    use super::*;

    fn reading([theta_i, theta_o, phi]: [f32; 3]) -> Option<PlaneReading> {
        let arms = Arms::from_array([theta_i, 0.0, theta_o, phi].map(f32::to_radians));
        let at = HalfDifference::from_directions(&arms.directions());
        let mut sample = SampleReading::new(angles_of(&at.expect("not opposite")));
        sample.brdf.add([0.5; 3], false).expect("a valid reading");
        PlaneReading::new(&sample)
    }

    #[test]
    fn lights_of_scans_are_plotted() {
        let line: Vec<PlaneReading> = (-16..=16_i8)
            .filter_map(|step| reading([20.0, 5.0 * f32::from(step), 180.0]))
            .collect();
        assert_eq!(line.len(), 33);
        assert_eq!(plotted_theta_i(&line), [200, 450, 750]);
        let marks = line.iter().filter_map(|reading| reading.mark(200));
        let angles = marks.map(|mark| mark.point[0].to_degrees().round() as i32);
        assert!(angles.eq((-16..=16).map(|step| 5 * step)));
        // The light and the sensor are exchanged.
        let marks = line.iter().filter_map(|reading| reading.mark(750));
        assert_eq!(marks.count(), 2);
        assert!(reading([60.0, 50.0, 175.0]).is_none() && reading([60.0, 1.0, 90.0]).is_some());
        assert_eq!(plotted_theta_i(&[]), DEFAULT_THETA_I);
    }
}
