//! Export of a route as CSV, JSON, and a blank sheet for readings.

use glimpse_core::geometry::Arms;
use serde_json::{Value, json};

use super::machine::TimedMachine;
use super::visit::{Route, Visit};

/// Rounds an angle in degrees to four decimals, finer than the resolution of arms, and removes the sign of -0.
fn round(angle: f64) -> f64 {
    (1e4 * angle).round() / 1e4 + 0.0
}

/// Returns the names of the axes that a machine has.
fn csv_names(arms: &Arms<Option<f64>>) -> String {
    let axes = Arms::NAMES.into_iter().zip(arms.to_array());
    let names = axes.filter_map(|(name, angle)| angle.map(|_| name));
    names.collect::<Vec<_>>().join(",")
}

fn csv_angles(arms: &Arms<Option<f64>>) -> String {
    let angles = arms.to_array().into_iter().flatten();
    let angles = angles.map(|angle| format!("{:.4}", round(angle)));
    angles.collect::<Vec<_>>().join(",")
}

/// Returns a CSV sheet for readings at any directions, `theta_i,phi_i,theta_o,phi_o,r,g,b`, with positions in degrees. A
/// machine in one plane has no azimuths.
#[must_use]
pub fn blank_directions(positions: &[Arms<Option<f64>>]) -> String {
    let header = positions.first();
    let header = header.map_or_else(|| Arms::NAMES.join(","), csv_names);
    let rows = positions
        .iter()
        .map(|arms| format!("{},,,\n", csv_angles(arms)));
    format!("{header},r,g,b\n{}", rows.collect::<String>())
}

impl Route {
    /// Returns the positions of the axes that the machine has.
    fn axes(&self, arms: Arms<f64>) -> Arms<Option<f64>> {
        let azimuth = |angle| Some(angle).filter(|_| !self.in_plane);
        Arms {
            phi_i: azimuth(arms.phi_i),
            phi_o: azimuth(arms.phi_o),
            ..arms.map(Some)
        }
    }

    /// Returns CSV with one row per visit. `header` names the columns after the angles, and `last_cells` returns their
    /// cells.
    fn csv_rows(&self, header: &str, last_cells: impl Fn(&Visit) -> String) -> String {
        let names = csv_names(&self.axes(TimedMachine::START));
        let mut csv = format!("index,{names},{header}\n");
        for visit in &self.visits {
            let (index, angles) = (visit.index, csv_angles(&self.axes(visit.arms)));
            csv += &format!("{index},{angles},{}\n", last_cells(visit));
        }
        csv
    }

    /// Returns a CSV sheet for readings, `index,theta_i,phi_i,theta_o,phi_o,r,g,b`, with one row per visit: the sample's
    /// index from 0, the axis positions in degrees, and three empty cells. A machine in one plane has no azimuths.
    #[must_use]
    pub fn blank_sheet(&self) -> String {
        self.csv_rows("r,g,b", |_| ",,".to_owned())
    }

    /// Returns CSV, `index,theta_i,phi_i,theta_o,phi_o,seconds`, with one row per visit: the sample's index from 0, the
    /// axis positions in degrees, and the time of the reading in seconds after the start. A machine in one plane has no
    /// azimuths.
    #[must_use]
    pub fn to_csv(&self) -> String {
        self.csv_rows("seconds", |visit| format!("{:.3}", visit.seconds))
    }

    /// Returns JSON with the visits, its times, and the machine. Angles are in degrees, times in seconds; azimuths that the
    /// machine lacks are null.
    #[must_use]
    pub fn to_json(&self, machine: &TimedMachine) -> Value {
        let axes = |axes: &Arms<f64>| json!(axes.map(round));
        let limits = &machine.limits;
        let degrees = |radians: f32| round(f64::from(radians).to_degrees());
        let visits = self.visits.iter().map(|visit| {
            let arms = self.axes(visit.arms.map(round));
            let mut record = json!(arms);
            record["index"] = visit.index.into();
            record["seconds"] = visit.seconds.into();
            record
        });
        json!({
            "order": self.order,
            "samples": self.visits.len(),
            "seconds": self.total(),
            "moving_seconds": self.travel,
            "settling_seconds": self.settling,
            "machine": {
                "degrees_per_second": axes(&machine.speeds),
                "settle_seconds": machine.settle,
                "start": axes(&TimedMachine::START),
                "full_turns": machine.full_turns,
                "max_theta_i": degrees(limits.max_theta_i),
                "max_theta_o": degrees(limits.max_theta_o),
                "min_separation": degrees(limits.min_separation),
                "in_plane": limits.in_plane,
            },
            "visits": visits.collect::<Vec<_>>(),
        })
    }
}
