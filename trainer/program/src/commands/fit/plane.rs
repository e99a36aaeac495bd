//! Readings in or near the plane of incidence, for plots of lobes. All angles are in degrees.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use glimpse_fitting::measurement::{ReadingStatus, SampleReading};
use glimpse_fitting::route::relative_arms;
use glimpse_materials::luminance;

use crate::report::ReadingMark;

/// Polar angles of the light without readings in the plane.
const DEFAULT_THETA_I: [i32; 3] = [15, 45, 75];
/// The smallest distance of a default angle from those of readings.
const MIN_SPACING: i32 = 10;
/// The largest distance of a plotted reading from the plane, and of its light from that of the plot.
const MAX_DISTANCE: f32 = 2.0;

/// A reading in the plane of incidence.
pub(super) struct PlaneReading {
    theta_i: f32,
    theta_o: f32,
    /// -1 if the sensor is on the light's side of the normal, or else 1.
    side: f32,
    luminance: f32,
    is_used: bool,
}

impl PlaneReading {
    /// Creates a reading; None if it is missing, not in the plane, or that of an instrument with many directions.
    pub(super) fn new(sample: &SampleReading) -> Option<Self> {
        let arms = relative_arms(sample.angles);
        let (sin_phi, cos_phi) = arms.phi_o.to_radians().sin_cos();
        let sin_theta = arms.theta_i.min(arms.theta_o).to_radians().sin();
        let from_plane = (sin_theta * sin_phi.abs()).asin().to_degrees();
        let is_near = from_plane <= MAX_DISTANCE.into() && sample.optics.fixed().is_none();
        Some(Self {
            luminance: luminance(sample.brdf.mean().filter(|_| is_near)?),
            theta_i: arms.theta_i as f32,
            theta_o: arms.theta_o as f32,
            side: if cos_phi > 0.0 { -1.0 } else { 1.0 },
            is_used: sample.status == ReadingStatus::Used,
        })
    }

    /// Returns the mark of the reading in the plot of a light, maybe with light and sensor exchanged; None if both are
    /// elsewhere.
    pub(super) fn mark(&self, theta_i: f32) -> Option<ReadingMark> {
        let pairs = [(self.theta_i, self.theta_o), (self.theta_o, self.theta_i)];
        let mut pairs = pairs.into_iter();
        let (_, theta_o) = pairs.find(|(light, _)| (light - theta_i).abs() <= MAX_DISTANCE)?;
        Some(ReadingMark {
            point: [(self.side * theta_o).to_radians(), self.luminance],
            is_used: self.is_used,
        })
    }
}

/// Returns three polar angles of the light, ascending: the most frequent ones of readings, and with few of them default ones.
pub(super) fn plotted_theta_i(readings: &[PlaneReading]) -> Vec<i32> {
    let mut counts = BTreeMap::new();
    for reading in readings {
        *counts.entry(reading.theta_i.round() as i32).or_insert(0) += 1;
    }
    let mut plotted: Vec<(i32, i32)> = counts.into_iter().collect();
    plotted.sort_by_key(|(_, count)| Reverse(*count));
    let plotted = plotted.into_iter().map(|(theta_i, _)| theta_i);
    let mut plotted: Vec<i32> = plotted.take(DEFAULT_THETA_I.len()).collect();
    for theta_i in DEFAULT_THETA_I {
        let is_far = |other: &i32| (theta_i - other).abs() >= MIN_SPACING;
        if plotted.len() < DEFAULT_THETA_I.len() && plotted.iter().all(is_far) {
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
        assert_eq!(plotted_theta_i(&line), [20, 45, 75]);
        let marks = line.iter().filter_map(|reading| reading.mark(20.0));
        let angles = marks.map(|mark| mark.point[0].to_degrees().round() as i32);
        assert!(angles.eq((-16..=16).map(|step| 5 * step)));
        // The light and the sensor are exchanged.
        let marks = line.iter().filter_map(|reading| reading.mark(75.0));
        assert_eq!(marks.count(), 2);
        assert!(reading([60.0, 50.0, 175.0]).is_none() && reading([60.0, 1.0, 90.0]).is_some());
        assert_eq!(plotted_theta_i(&[]), DEFAULT_THETA_I);
    }
}
