//! Export of a route as CSV, JSON, and a blank sheet for readings.

use glimpse_core::geometry::Arms;
use serde_json::{Value, json};

use super::machine::TimedMachine;
use super::visit::{Route, Visit};

/// Rounds an angle in degrees to four decimals, finer than the resolution of arms, and removes the sign of -0.
fn round(angle: f64) -> f64 {
    (1e4 * angle).round() / 1e4 + 0.0
}

fn csv_angles(arms: &Arms<f64>) -> String {
    arms.to_array()
        .map(|angle| format!("{:.4}", round(angle)))
        .join(",")
}

/// Returns CSV with one row per visit. `header` names the columns after the angles, and `last_cells` returns their
/// cells.
fn csv_rows(header: &str, visits: &[Visit], last_cells: impl Fn(&Visit) -> String) -> String {
    let mut csv = format!("index,{},{header}\n", Arms::NAMES.join(","));
    for visit in visits {
        let (index, angles) = (visit.index, csv_angles(&visit.arms));
        csv += &format!("{index},{angles},{}\n", last_cells(visit));
    }
    csv
}

/// Returns a CSV sheet for readings, `index,theta_i,phi_i,theta_o,phi_o,r,g,b`, with one row per visit: the sample's
/// index from 0, the axis positions in degrees, and three empty cells.
#[must_use]
pub fn blank_sheet(visits: &[Visit]) -> String {
    csv_rows("r,g,b", visits, |_| ",,".to_owned())
}

/// Returns a CSV sheet for readings at any directions, `theta_i,phi_i,theta_o,phi_o,r,g,b`, with positions in degrees.
#[must_use]
pub fn blank_directions(positions: &[Arms<f64>]) -> String {
    let rows = positions
        .iter()
        .map(|arms| format!("{},,,\n", csv_angles(arms)));
    format!(
        "{},r,g,b\n{}",
        Arms::NAMES.join(","),
        rows.collect::<String>()
    )
}

impl Route {
    /// Returns CSV, `index,theta_i,phi_i,theta_o,phi_o,seconds`, with one row per visit: the sample's index from 0, the
    /// axis positions in degrees, and the time of the reading in seconds after the start.
    #[must_use]
    pub fn to_csv(&self) -> String {
        csv_rows("seconds", &self.visits, |visit| {
            format!("{:.3}", visit.seconds)
        })
    }

    /// Returns JSON with the visits, its times, and the machine. Angles are in
    /// degrees, times in seconds.
    #[must_use]
    pub fn to_json(&self, machine: &TimedMachine) -> Value {
        let axes = |axes: &Arms<f64>| json!(axes.map(round));
        let limits = &machine.limits;
        let degrees = |radians: f32| round(f64::from(radians).to_degrees());
        let visits = self.visits.iter().map(|visit| Visit {
            arms: visit.arms.map(round),
            ..*visit
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
