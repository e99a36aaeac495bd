//! Quality over the seconds of a scan, for patterns trained with and without a budget for the time of motion.

use glimpse_core::gonio::Limits;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;
use glimpse_trainer::report::{
    Axis, Cell, Column, Compare, Highlight, Marker, Plot, Scale, Series, SeriesColor, Table,
};
use glimpse_training::meta::plan::Schedule;
use glimpse_training::route::{Axes, Machine, Order, Route, stops};

use super::case::{Approach, Case, MOTION_SPEED, TrainingRun};
use super::findings::Findings;
use super::plots::metric_axis;
use super::store::{Store, TestSet};
use super::{METRICS, SCHEDULE, metric_values, powers_of_two};

/// Indices in [`METRICS`] of the plotted metrics: Loss and Delta E.
const PLOTTED_METRICS: [usize; 2] = [0, 4];
const MODEL: ModelKind = ModelKind::Linear;
/// Budgets for motion in training, in seconds at [`MOTION_SPEED`].
const BUDGETS: [u32; 3] = [5, 10, 20];

/// A machine whose axes have the same speed.
struct NamedMachine {
    name: &'static str,
    /// Degrees per second.
    speed: f64,
    /// Seconds.
    settle: f64,
}

/// All axes of a machine have the same speed, so that the pattern that moves least on one machine does so on the other,
/// and one training serves both.
const MACHINES: [NamedMachine; 2] = [
    NamedMachine {
        name: "slow",
        speed: MOTION_SPEED,
        settle: 0.5,
    },
    NamedMachine {
        name: "fast",
        speed: 60.0,
        settle: 0.1,
    },
];

impl NamedMachine {
    /// Returns the seconds of a scan of all samples in the fastest order.
    fn seconds(&self, recipe: &Recipe<'_>, seed: u64) -> anyhow::Result<f64> {
        let machine = Machine {
            speeds: Axes::from_array([self.speed; 4]),
            settle: self.settle,
            ..Machine::default()
        };
        let stops = stops(recipe, &Limits::NONE, false)
            .map_err(|_| anyhow::anyhow!("a sample is below the horizon"))?;
        Ok(Route::new(&machine, &stops, Order::Travel, seed).total())
    }

    fn describe(&self) -> String {
        let Self {
            name,
            speed,
            settle,
        } = self;
        format!("{name} machine: {speed} degrees per second, {settle} s to settle")
    }
}

/// One trained pattern.
struct Point {
    samples: usize,
    /// Seconds of a scan, for each of [`MACHINES`].
    seconds: [f64; MACHINES.len()],
    /// In the order of [`METRICS`].
    metrics: [f64; METRICS.len()],
}

/// The trained patterns of one kind, for each n.
struct Curve {
    name: String,
    color: SeriesColor,
    marker: Marker,
    points: Vec<Point>,
}

pub(super) fn run(store: &Store<'_>, max_samples: usize) -> anyhow::Result<Findings> {
    let mut findings = Findings::new(
        store,
        "Quality over the seconds of a scan",
        &[SCHEDULE, Schedule::Prior],
    );
    findings.text(format!(
        "Linear, n = 1, 2, 4, ... {max_samples}; each point is a separate training. Patterns that were trained for \
         samples are scanned in the fastest order. Those that were trained for seconds keep to a budget of motion at \
         {MOTION_SPEED} degrees per second. A scan starts with the light and the sensor along the normal, and ends with \
         the last reading."
    ));
    let sets = std::iter::once(store.test).chain(store.additional);
    for (number, set) in sets.enumerate() {
        findings.set_test_set(store, set);
        let suffix = match number {
            0 => String::new(),
            number => format!("-{number}"),
        };
        let curves = curves(store, set, max_samples)?;
        for (index, machine) in MACHINES.iter().enumerate() {
            for metric in PLOTTED_METRICS {
                let short = METRICS[metric].0.to_lowercase().replace(' ', "-");
                findings.plot(
                    format!("{}-{short}{suffix}", machine.name),
                    plot(&curves, index, metric),
                );
            }
        }
        findings.table(format!("seconds{suffix}"), table(&curves));
    }
    Ok(findings)
}

fn curves(store: &Store<'_>, set: &TestSet<'_>, max_samples: usize) -> anyhow::Result<Vec<Curve>> {
    let ours = Approach::Ours(SCHEDULE);
    let completed = Approach::Ours(Schedule::Prior);
    let mut kinds = vec![
        (format!("{}, for samples", ours.title()), ours, None),
        (
            format!("{}, for samples", completed.title()),
            completed,
            None,
        ),
    ];
    kinds.extend(BUDGETS.map(|seconds| {
        let name = format!("{}, {seconds} s of motion", completed.title());
        (name, completed, Some(seconds))
    }));
    let styles = [
        (SeriesColor::Black, Marker::Cross),
        (SeriesColor::Blue, Marker::Ring),
        (SeriesColor::Vermillion, Marker::Triangle),
        (SeriesColor::Orange, Marker::Disc),
        (SeriesColor::Green, Marker::Disc),
    ];
    let mut curves = Vec::new();
    for ((name, approach, motion), (color, marker)) in kinds.into_iter().zip(styles) {
        let mut points = Vec::new();
        for samples in powers_of_two(max_samples) {
            let case = Case {
                motion,
                ..Case::new(approach, MODEL, samples)
            };
            let evaluation = store.evaluation_on(set, &case)?;
            points.push(Point {
                samples,
                seconds: scan_seconds(store, &case)?,
                metrics: metric_values(&evaluation.metrics),
            });
        }
        curves.push(Curve {
            name,
            color,
            marker,
            points,
        });
    }
    Ok(curves)
}

/// Returns the seconds of a scan for each of [`MACHINES`].
fn scan_seconds(store: &Store<'_>, case: &Case) -> anyhow::Result<[f64; MACHINES.len()]> {
    let mut seconds = [0.0; MACHINES.len()];
    if let Some(training) = TrainingRun::for_case(case)
        && store.mode.evaluates()
    {
        let learned = store.recipe(&training)?;
        for (seconds, machine) in seconds.iter_mut().zip(&MACHINES) {
            *seconds = machine.seconds(&learned.file.recipe(), store.settings.seed)?;
        }
    }
    Ok(seconds)
}

fn plot(curves: &[Curve], machine: usize, metric: usize) -> Plot {
    let series = |curve: &Curve| Series {
        name: curve.name.clone(),
        color: curve.color,
        marker: curve.marker,
        points: curve
            .points
            .iter()
            .map(|point| [point.seconds[machine], point.metrics[metric]])
            .collect(),
    };
    let name = METRICS[metric].0;
    Plot {
        title: format!("{name} over seconds, {}", MACHINES[machine].describe()),
        x: Axis {
            title: "seconds of a scan".into(),
            scale: Scale::Log10,
        },
        y: metric_axis(name),
        series: curves.iter().map(series).collect(),
    }
}

fn table(curves: &[Curve]) -> Table {
    let mut columns = vec![
        Column::text("Trained"),
        Column::number("n", 0, Highlight::None),
    ];
    columns.extend(
        MACHINES.map(|machine| {
            Column::number(format!("seconds, {}", machine.name), 1, Highlight::None)
        }),
    );
    columns.extend(PLOTTED_METRICS.map(|metric| {
        let (title, decimals, _) = METRICS[metric];
        Column::number(title, decimals, Highlight::None)
    }));
    let rows = curves.iter().flat_map(|curve| {
        curve.points.iter().map(|point| {
            let mut row = vec![
                Cell::Text(curve.name.clone()),
                Cell::Number(point.samples as f64),
            ];
            row.extend(point.seconds.map(Cell::Number));
            row.extend(PLOTTED_METRICS.map(|metric| Cell::Number(point.metrics[metric])));
            row
        })
    });
    let machines: Vec<String> = MACHINES.iter().map(NamedMachine::describe).collect();
    Table {
        caption: format!("Linear. {}", machines.join("; ")),
        columns,
        rows: rows.collect(),
        compare: Compare::WithinColumn,
    }
}
