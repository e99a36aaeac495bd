//! Angles from a CSV file, in degrees.

use std::fs;
use std::path::Path;

use anyhow::{Context, anyhow, bail, ensure};
use csv::{Position, ReaderBuilder, StringRecord, Trim};
use glimpse_core::geometry::{Angles, HalfDifference};

/// Rusinkiewicz angles.
const HALF_DIFFERENCE: [&str; 3] = ["theta_h", "theta_d", "phi_d"];
/// Each direction's angle to the normal, and its azimuth.
const DIRECTIONS: [&str; 4] = ["theta_i", "phi_i", "theta_o", "phi_o"];
/// Below this cosine, 6e-8 degrees from the horizon, rounding decides on which side of it a
/// direction is.
const AT_HORIZON: f64 = 1e-9;

/// A file of angles.
pub(super) struct AngleTable {
    /// The names of the columns that hold them.
    pub(super) columns: &'static [&'static str],
    pub(super) rows: Vec<AngleRow>,
}

/// A pair of directions.
pub(super) struct AngleRow {
    /// As they were given.
    pub(super) cells: Vec<String>,
    /// In radians; None where one of the directions is not above the horizon.
    pub(super) angles: Option<Angles<f32>>,
}

/// Reads one pair of directions a row.
///
/// The first line names the columns: theta_h, theta_d, phi_d, or theta_i, phi_i, theta_o, phi_o,
/// in any order; others are passed over.
///
/// # Errors
/// If the file cannot be read, lacks columns or has them twice, or a cell is no angle.
pub(super) fn read_angles(path: &Path) -> anyhow::Result<AngleTable> {
    let bytes = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    parse(&bytes).with_context(|| path.display().to_string())
}

fn parse(bytes: &[u8]) -> anyhow::Result<AngleTable> {
    let mut reader = ReaderBuilder::new().trim(Trim::All).from_reader(bytes);
    let unreadable = |error: csv::Error| unreadable(&error, line(bytes, error.position()));
    let columns = Columns::of(reader.headers().map_err(unreadable)?)?;
    let rows = reader
        .records()
        .map(|row| {
            let row = row.map_err(unreadable)?;
            let angles = columns
                .angles(&row)
                .map_err(|what| anyhow!("line {}, {what}", line(bytes, row.position())))?;
            let cells = columns.places().iter();
            let cells = cells.map(|place| row.get(*place).unwrap_or_default().to_owned());
            Ok(AngleRow {
                cells: cells.collect(),
                angles: above_horizon(angles),
            })
        })
        .collect::<anyhow::Result<_>>()?;
    Ok(AngleTable {
        columns: columns.names(),
        rows,
    })
}

/// The line of a row whose reading began at `position`, on empty lines before it perhaps.
fn line(bytes: &[u8], position: Option<&Position>) -> u64 {
    let Some(position) = position else {
        return 1;
    };
    let begin = usize::try_from(position.byte()).unwrap_or(usize::MAX);
    let rest = bytes.get(begin..).unwrap_or_default();
    let ends = rest.iter().take_while(|byte| matches!(byte, b'\r' | b'\n'));
    position.line() + ends.filter(|byte| **byte == b'\n').count() as u64
}

/// Where the angles are in a row.
enum Columns {
    HalfDifference([usize; 3]),
    Directions([usize; 4]),
}

impl Columns {
    fn of(header: &StringRecord) -> anyhow::Result<Self> {
        match (find(header, HALF_DIFFERENCE)?, find(header, DIRECTIONS)?) {
            (Some(columns), None) => Ok(Self::HalfDifference(columns)),
            (None, Some(columns)) => Ok(Self::Directions(columns)),
            (Some(_), Some(_)) => bail!(
                "it has columns {} as well as {}; remove or rename those that are not meant",
                HALF_DIFFERENCE.join(", "),
                DIRECTIONS.join(", ")
            ),
            (None, None) => bail!(
                "its first line should name columns {}, or {} (angles in degrees), but names {}",
                HALF_DIFFERENCE.join(", "),
                DIRECTIONS.join(", "),
                header.iter().collect::<Vec<_>>().join(", ")
            ),
        }
    }

    /// Their names.
    fn names(&self) -> &'static [&'static str] {
        match self {
            Self::HalfDifference(_) => &HALF_DIFFERENCE,
            Self::Directions(_) => &DIRECTIONS,
        }
    }

    /// Where they are, in the order of the names.
    fn places(&self) -> &[usize] {
        match self {
            Self::HalfDifference(places) => places,
            Self::Directions(places) => places,
        }
    }

    /// A row's Rusinkiewicz angles, in radians.
    fn angles(&self, row: &StringRecord) -> anyhow::Result<Angles<f64>> {
        match *self {
            Self::HalfDifference(columns) => {
                let [theta_h, theta_d, phi_d] = cells(row, HALF_DIFFERENCE, columns, 90.0)?;
                Ok(Angles {
                    theta_h,
                    theta_d,
                    phi_d,
                })
            }
            Self::Directions(columns) => {
                Ok(angles_between(cells(row, DIRECTIONS, columns, 180.0)?))
            }
        }
    }
}

/// Says what is wrong with the file as CSV.
fn unreadable(error: &csv::Error, line: u64) -> anyhow::Error {
    match error.kind() {
        csv::ErrorKind::UnequalLengths {
            expected_len, len, ..
        } => anyhow!(
            "line {line} has {len} cells where the first line names {expected_len}; give every \
             row as many"
        ),
        csv::ErrorKind::Utf8 { .. } => anyhow!("line {line} is not UTF-8; save the file as that"),
        _ => anyhow!("line {line} cannot be read: {error}"),
    }
}

/// Where the columns of these names are; None if not all are there.
fn find<const N: usize>(
    header: &StringRecord,
    names: [&str; N],
) -> anyhow::Result<Option<[usize; N]>> {
    let mut columns = [0; N];
    for (column, name) in columns.iter_mut().zip(names) {
        let mut places = (0..header.len()).filter(|place| header.get(*place) == Some(name));
        match (places.next(), places.next()) {
            (Some(place), None) => *column = place,
            (Some(_), Some(_)) => bail!("it has two columns {name}; remove or rename one"),
            (None, _) => return Ok(None),
        }
    }
    Ok(Some(columns))
}

/// A row's angles, from degrees to radians; thetas are 0 to `largest_theta`.
fn cells<const N: usize>(
    row: &StringRecord,
    names: [&str; N],
    columns: [usize; N],
    largest_theta: f64,
) -> anyhow::Result<[f64; N]> {
    let mut angles = [0.0; N];
    for ((angle, name), column) in angles.iter_mut().zip(names).zip(columns) {
        let cell = row.get(column).unwrap_or_default();
        let degrees: f64 = cell.parse().map_err(|_| {
            anyhow!("column {name}: `{cell}` is no number; give an angle in degrees")
        })?;
        ensure!(
            degrees.is_finite(),
            "column {name}: `{cell}` is no angle; give it in degrees"
        );
        ensure!(
            name.starts_with("phi") || (0.0..=largest_theta).contains(&degrees),
            "column {name}: {cell} is out of range; give 0 to {largest_theta} degrees"
        );
        *angle = degrees.to_radians();
    }
    Ok(angles)
}

/// Rusinkiewicz angles of two directions.
fn angles_between([theta_i, phi_i, theta_o, phi_o]: [f64; 4]) -> Angles<f64> {
    let direction = |theta: f64, phi: f64| {
        let (sin, cos) = theta.sin_cos();
        [sin * phi.cos(), sin * phi.sin(), cos]
    };
    let (incoming, outgoing) = (direction(theta_i, phi_i), direction(theta_o, phi_o));
    let sum: [f64; 3] = std::array::from_fn(|i| incoming[i] + outgoing[i]);
    let difference: [f64; 3] = std::array::from_fn(|i| incoming[i] - outgoing[i]);
    let length = |[x, y, z]: [f64; 3]| x.hypot(y).hypot(z);
    let theta_h = sum[0].hypot(sum[1]).atan2(sum[2]);
    let phi_h = sum[1].atan2(sum[0]);
    // The incoming direction, turned so that the half vector is the z axis.
    let [x, y, z] = incoming;
    let (sin, cos) = phi_h.sin_cos();
    let (along, across) = (x * cos + y * sin, y * cos - x * sin);
    Angles {
        theta_h,
        theta_d: length(difference).atan2(length(sum)),
        phi_d: across.atan2(along * theta_h.cos() - z * theta_h.sin()),
    }
}

/// The angles in single precision, phi_d in \[0, 2 pi), if both directions are above the horizon.
fn above_horizon(angles: Angles<f64>) -> Option<Angles<f32>> {
    let at = HalfDifference::from_angles(angles);
    let above = at.cos_theta_i() > AT_HORIZON && at.cos_theta_o() > AT_HORIZON;
    above.then_some(Angles {
        theta_h: angles.theta_h as f32,
        theta_d: angles.theta_d as f32,
        phi_d: angles.phi_d.rem_euclid(std::f64::consts::TAU) as f32,
    })
}
