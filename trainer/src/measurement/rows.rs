//! Rows of readings, as a file has them, and the samples of a pattern that they belong to.

use std::f64::consts::TAU;
use std::path::Path;

use glimpse_core::geometry::{Angles, Directions, HalfDifference};

use super::angles::{AngleColumns, Given};
use super::matching::{Arms, Distance};
use super::table::{Row, Table, TableError};
use crate::basis::widened;
use crate::foreign::shown;

/// The columns of a sensor with three channels.
const CHANNELS: [&str; 3] = ["r", "g", "b"];
/// The column of a sensor with one.
const MONOCHROME: &str = "value";

/// What is said of a white that says nothing.
pub(super) const SATURATED_WHITE: &str = "column saturated: the white is, so that nothing can be compared with it; read it with less light";

/// A file of readings.
pub(super) struct Rows {
    table: Table,
    rows: Vec<ReadRow>,
}

/// A row: where, as far as it says so, and what.
struct ReadRow {
    line: u64,
    index: Option<usize>,
    given: Option<Given>,
    /// None where the cells are empty: nothing was read.
    values: Option<[f32; 3]>,
    saturated: bool,
}

/// A row of a sample of the pattern.
pub(super) struct Matched {
    pub(super) line: u64,
    pub(super) sample: usize,
    /// Where the row says that it was read, or else the sample's own directions.
    pub(super) at: Directions<f32>,
    /// Whether light and sensor are exchanged.
    pub(super) exchanged: bool,
    /// None where nothing was read.
    pub(super) values: Option<[f32; 3]>,
    pub(super) saturated: bool,
    /// How far its directions are from the sample's; None if it says only its index.
    pub(super) distance: Option<Distance>,
}

/// Where the columns are.
struct Columns {
    index: Option<usize>,
    angles: Option<AngleColumns>,
    values: [usize; 3],
    names: [&'static str; 3],
    saturated: Option<usize>,
}

impl Columns {
    fn of(table: &Table) -> Result<Self, TableError> {
        let index = table.column("index")?;
        let angles = AngleColumns::of(table)?;
        if index.is_none() && angles.is_none() {
            return Err(table.damaged(format!(
                "its first line should say where each reading was taken: theta_h, theta_d, phi_d, \
                 or theta_i, phi_i, theta_o, phi_o (degrees), or index (the sample's number, from \
                 0), and names {}; correct it",
                table.names()
            )));
        }
        let (values, names) = match (table.columns(CHANNELS)?, table.column(MONOCHROME)?) {
            (Some(columns), None) => (columns, CHANNELS),
            (None, Some(column)) => ([column; 3], [MONOCHROME; 3]),
            (Some(_), Some(_)) => {
                return Err(table.damaged(
                    "it has columns r, g, b as well as value; remove or rename what is not meant"
                        .to_owned(),
                ));
            }
            (None, None) => {
                return Err(table.damaged(format!(
                    "its first line should name what was read: r, g, b, or value of a sensor with \
                     one channel, and names {}; correct it",
                    table.names()
                )));
            }
        };
        Ok(Self {
            index,
            angles,
            values,
            names,
            saturated: table.column("saturated")?,
        })
    }

    /// A row; or what is wrong with one of its cells.
    fn row(&self, row: &Row) -> Result<ReadRow, String> {
        let index = self.index.map(|column| row.cell(column));
        let index = index.filter(|cell| !cell.is_empty()).map(|cell| {
            // Programs write whole numbers as 3.0, too.
            cell.strip_suffix(".0")
                .unwrap_or(cell)
                .parse()
                .map_err(|_| {
                    let shown = shown(cell);
                    format!("column index: `{shown}` is no sample's number; give 0, 1, 2, ...")
                })
        });
        let index = index.transpose()?;
        let given = match &self.angles {
            // A row that says which sample it is of may leave its angles out.
            Some(columns) if index.is_none() || !columns.are_empty(row) => {
                Some(columns.given(row)?)
            }
            _ => None,
        };
        if index.is_none() && given.is_none() {
            return Err("column index: it is empty; give the sample's number, from 0".to_owned());
        }
        Ok(ReadRow {
            line: row.line,
            index,
            given,
            values: self.values(row)?,
            saturated: self.saturated(row)?,
        })
    }

    fn values(&self, row: &Row) -> Result<Option<[f32; 3]>, String> {
        let mut values = [0.0_f32; 3];
        let mut absent = [false; 3];
        for channel in 0..3 {
            let (cell, name) = (row.cell(self.values[channel]), self.names[channel]);
            // Programs write what is not there as either.
            absent[channel] = cell.is_empty() || cell.eq_ignore_ascii_case("nan");
            if absent[channel] {
                continue;
            }
            values[channel] = cell.parse().map_err(|_| {
                format!(
                    "column {name}: `{}` is no number; leave it empty if nothing was read",
                    shown(cell)
                )
            })?;
            if !values[channel].is_finite() {
                return Err(format!(
                    "column {name}: {} is not finite; leave it empty if nothing was read",
                    shown(cell)
                ));
            }
        }
        match absent {
            [false, false, false] => Ok(Some(values)),
            [true, true, true] => Ok(None),
            _ => {
                let missing = absent.iter().position(|absent| *absent).unwrap_or_default();
                Err(format!(
                    "column {}: it is empty while the others are not; give all three, or none if \
                     nothing was read",
                    self.names[missing]
                ))
            }
        }
    }

    fn saturated(&self, row: &Row) -> Result<bool, String> {
        match self.saturated.map_or("", |column| row.cell(column)) {
            "" | "0" => Ok(false),
            "1" => Ok(true),
            cell => Err(format!(
                "column saturated: `{}` is neither 0 nor 1; give 1 where the sensor was at its end",
                shown(cell)
            )),
        }
    }
}

impl Rows {
    /// Reads a file.
    pub(super) fn read(path: &Path) -> Result<Self, TableError> {
        let table = Table::read(path)?;
        let columns = Columns::of(&table)?;
        let rows = table.rows().iter().map(|row| {
            let read = columns.row(row);
            read.map_err(|what| table.wrong(row.line, &what))
        });
        let rows: Vec<ReadRow> = rows.collect::<Result<_, _>>()?;
        if rows.is_empty() {
            return Err(
                table.damaged("it has no rows below its first line; add what was read".to_owned())
            );
        }
        Ok(Self { table, rows })
    }

    /// What becomes of something that is wrong on a line.
    pub(super) fn wrong(&self, line: u64, what: &str) -> TableError {
        self.table.wrong(line, what)
    }

    /// What becomes of something that is wrong with the whole file.
    pub(super) fn damaged(&self, what: String) -> TableError {
        self.table.damaged(what)
    }

    /// The sample of each row, no further from it than a tolerance in radians.
    ///
    /// # Errors
    /// The first row that is of no sample, and how near it misses one.
    pub(super) fn matched(
        &self,
        pattern: &[Angles<f32>],
        tolerance: f64,
    ) -> Result<Vec<Matched>, TableError> {
        let places: Vec<Angles<f64>> = pattern.iter().map(widened).collect();
        let arms: Vec<Arms> = places.iter().copied().map(Arms::of).collect();
        let matched = self.rows.iter().map(|row| {
            let (sample, distance, exchanged) = self.sample(row, &arms, tolerance)?;
            let angles = row.given.map_or(places[sample], Given::angles);
            Ok(Matched {
                line: row.line,
                sample,
                at: directions(angles),
                exchanged,
                values: row.values,
                saturated: row.saturated,
                distance,
            })
        });
        matched.collect()
    }

    /// The one direction that a file of a single row is read at: its own, or those of the sample
    /// that it names.
    ///
    /// # Errors
    /// If there are more rows, or nothing was read.
    pub(super) fn single(
        &self,
        pattern: &[Angles<f32>],
    ) -> Result<(Directions<f32>, [f32; 3]), TableError> {
        let [row] = &self.rows[..] else {
            return Err(self.damaged(format!(
                "it has {} rows; with --footprint the white is read once, at one pair of \
                 directions",
                self.rows.len()
            )));
        };
        let named = row.index.and_then(|index| pattern.get(index)).map(widened);
        let (Some(angles), Some(values)) = (row.given.map(Given::angles).or(named), row.values)
        else {
            return Err(self.wrong(
                row.line,
                "it should hold directions and what was read there; give both",
            ));
        };
        if row.saturated {
            return Err(self.wrong(row.line, SATURATED_WHITE));
        }
        Ok((directions(angles), values))
    }

    fn sample(
        &self,
        row: &ReadRow,
        arms: &[Arms],
        tolerance: f64,
    ) -> Result<(usize, Option<Distance>, bool), TableError> {
        let count = arms.len();
        if let Some(index) = row.index.filter(|index| *index >= count) {
            return Err(self.wrong(
                row.line,
                &format!(
                    "column index: there is no sample {index}, the recipe has {count}, from 0 to {}",
                    count - 1
                ),
            ));
        }
        let Some(given) = row.given else {
            return Ok((row.index.unwrap_or_default(), None, false));
        };
        let place = Arms::of(given.angles());
        let Some((nearest, near)) = place.nearest(arms) else {
            return Err(self.damaged("the recipe has no samples".to_owned()));
        };
        let (sample, distance, exchanged) = match row.index {
            // A plan with --swap exchanges light and sensor where that is sooner, and names the sample.
            Some(index) => {
                let own = place.distance(&arms[index]);
                let exchanged = place.exchanged().distance(&arms[index]);
                let nearer = exchanged.largest < own.largest && exchanged.largest <= tolerance;
                (index, if nearer { exchanged } else { own }, nearer)
            }
            None => (nearest, near, false),
        };
        if distance.largest <= tolerance {
            return Ok((sample, Some(distance), exchanged));
        }
        let Arms {
            theta_i,
            theta_o,
            phi,
        } = arms[sample];
        let [theta_i, theta_o, phi] =
            [theta_i, theta_o, phi.rem_euclid(TAU)].map(|angle| round(angle.to_degrees()));
        let whose = match row.index {
            Some(_) if nearest != sample => {
                format!("sample {sample}, which it names (sample {nearest} is nearer)")
            }
            Some(_) => format!("sample {sample}, which it names"),
            None => format!("sample {sample}, the nearest"),
        };
        let mut what = format!(
            "its directions are {distance} from {whose} (theta_i {theta_i}, theta_o {theta_o}, \
             phi_o - phi_i {phi} degrees); --tolerance is {} degrees",
            round(tolerance.to_degrees())
        );
        what += &match self.are_radians(arms, tolerance) {
            true => format!(
                ". If they are taken for radians, all {} rows match: give degrees, which are \
                 radians times 57.29578",
                self.rows.len()
            ),
            false => "; see `trainer inspect` for where the recipe measures, correct the row, or \
                      give a larger --tolerance"
                .to_owned(),
        };
        Err(self.wrong(row.line, &what))
    }

    /// True if all rows would match, were their angles given in radians.
    fn are_radians(&self, arms: &[Arms], tolerance: f64) -> bool {
        self.rows.iter().all(|row| {
            let Some(given) = row.given else {
                return true;
            };
            let place = Arms::of(given.scaled(1.0_f64.to_degrees()).angles());
            let distance = match row.index {
                Some(index) => arms.get(index).map(|arms| place.distance(arms)),
                None => place.nearest(arms).map(|(_, distance)| distance),
            };
            distance.is_some_and(|distance| distance.largest <= tolerance)
        })
    }
}

/// To a hundredth.
fn round(degrees: f64) -> f64 {
    (degrees * 100.0).round() / 100.0
}

fn directions(angles: Angles<f64>) -> Directions<f32> {
    let pair = HalfDifference::from_angles(angles).directions();
    Directions {
        incoming: pair.incoming.map(|x| x as f32),
        outgoing: pair.outgoing.map(|x| x as f32),
    }
}
