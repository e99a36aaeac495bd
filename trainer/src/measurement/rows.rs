//! Rows of readings, as a file or an array has them, and the samples of a pattern that they belong to.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use glimpse_core::geometry::{Angles, Directions, HalfDifference};
use glimpse_materials::basis::widened;
use glimpse_materials::untrusted::escaped;

use super::angles::Given;
use super::columns::{Columns, ReadRow};
use super::matching::{Arms, Distance};
use super::table::{Table, TableError};

/// What is said of a white that says nothing.
pub(super) const SATURATED_WHITE: &str = "column saturated: the white is, so that nothing can be compared with it; read it with less light";

/// A reading that stands in no file.
#[derive(Clone, Copy, Debug, Default)]
pub struct Taken {
    /// The sample that it is of, from 0, if that is known.
    pub sample: Option<usize>,
    /// The incoming and the outgoing direction, of length 1, z along the normal, if they are known.
    pub at: Option<[[f64; 3]; 2]>,
    /// What was read; None if nothing was.
    pub values: Option<[f32; 3]>,
    /// True if the sensor was at its end.
    pub saturated: bool,
}

/// Readings of a file or of an array.
pub(super) struct Rows {
    /// The file, or what stands for it in errors.
    path: PathBuf,
    /// What its rows are called.
    unit: &'static str,
    rows: Vec<ReadRow>,
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

/// A likely cause of rows that match no sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cause {
    /// Angles are in radians.
    Radians,
    /// Light and sensor are exchanged; the row is of this sample.
    Exchanged(usize),
    /// Azimuths are counted the other way round.
    Mirrored,
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
        refuse_several_materials(&table)?;
        Ok(Self {
            path: table.path().to_owned(),
            unit: "line",
            rows,
        })
    }

    /// Of an array.
    pub(super) fn of(taken: &[Taken]) -> Self {
        let rows = (0..).zip(taken).map(|(line, taken)| ReadRow {
            line,
            index: taken.sample,
            given: taken.at.map(Given::of_pair),
            values: taken.values,
            saturated: taken.saturated,
            quantity: String::new(),
        });
        Self {
            path: "readings".into(),
            unit: "row",
            rows: rows.collect(),
        }
    }

    /// Refuses rows that say of their numbers that they are something else than `name`.
    ///
    /// # Errors
    /// The first such row.
    pub(super) fn refuse_other_than(&self, name: &str) -> Result<(), TableError> {
        let other = |row: &&ReadRow| !row.quantity.is_empty() && row.quantity != name;
        match self.rows.iter().find(other) {
            None => Ok(()),
            Some(row) => Err(self.wrong(
                row.line,
                &format!(
                    "column quantity: its numbers are `{}`, and would be taken for `{name}`; give \
                     the options for what they are, or correct the column",
                    escaped(&row.quantity)
                ),
            )),
        }
    }

    /// What becomes of something that is wrong on a line.
    pub(super) fn wrong(&self, line: u64, what: &str) -> TableError {
        self.damaged(format!("{} {line}, {what}", self.unit))
    }

    /// What becomes of something that is wrong with the whole file.
    pub(super) fn damaged(&self, what: String) -> TableError {
        TableError::Damaged {
            path: self.path.clone(),
            what,
        }
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
            return match row.index {
                Some(index) => Ok((index, None, false)),
                None => Err(self.wrong(row.line, "it says neither its directions nor its sample")),
            };
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
        what += &match self.cause(row, place, arms, tolerance) {
            Some(Cause::Radians) => format!(
                ". If they are taken for radians, all {} rows match: give degrees, which are \
                 radians times 57.29578",
                self.rows.len()
            ),
            Some(Cause::Exchanged(other)) => format!(
                ". With light and sensor exchanged they are those of sample {other}: if that is \
                 meant, as by `trainer plan --swap`, name it in a column index"
            ),
            Some(Cause::Mirrored) => format!(
                ". With azimuths counted the other way round, all {} rows match: negate phi_i and \
                 phi_o (or phi_d; of vectors, y)",
                self.rows.len()
            ),
            None => "; see `trainer inspect` for where the recipe measures, correct the row, or \
                     give a larger --tolerance"
                .to_owned(),
        };
        Err(self.wrong(row.line, &what))
    }

    /// The likely cause of a row that matches no sample.
    fn cause(&self, row: &ReadRow, place: Arms, arms: &[Arms], tolerance: f64) -> Option<Cause> {
        let all = |places: &dyn Fn(Given) -> Vec<Arms>| self.all_match(arms, tolerance, places);
        if all(&|given| vec![Arms::of(given.scaled(1.0_f64.to_degrees()).angles())]) {
            return Some(Cause::Radians);
        }
        let either_way = |arms: Arms| vec![arms, arms.exchanged()];
        let are_mirrored = all(&|given| {
            let mirrored = Arms::of(given.angles()).mirrored();
            match row.index {
                // A plan with --swap.
                Some(_) => either_way(mirrored),
                None => vec![mirrored],
            }
        });
        let exchanged = place.exchanged().nearest(arms);
        match exchanged.filter(|(_, far)| row.index.is_none() && far.largest <= tolerance) {
            // Where theta_i is theta_o, a single row does not distinguish the two causes.
            Some((other, _))
                if !are_mirrored || all(&|given| either_way(Arms::of(given.angles()))) =>
            {
                Some(Cause::Exchanged(other))
            }
            _ => are_mirrored.then_some(Cause::Mirrored),
        }
    }

    /// Returns true if every row matches the sample that it names, or any if it names none, at one of the places
    /// that `places` makes of its angles.
    fn all_match(
        &self,
        arms: &[Arms],
        tolerance: f64,
        places: &dyn Fn(Given) -> Vec<Arms>,
    ) -> bool {
        self.rows.iter().all(|row| {
            let Some(given) = row.given else {
                return true;
            };
            places(given).iter().any(|place| {
                let distance = match row.index {
                    Some(index) => arms.get(index).map(|arms| place.distance(arms)),
                    None => place.nearest(arms).map(|(_, distance)| distance),
                };
                distance.is_some_and(|distance| distance.largest <= tolerance)
            })
        })
    }
}

/// Refuses what is of several materials, as `trainer query` writes it: their mean is none of them.
fn refuse_several_materials(table: &Table) -> Result<(), TableError> {
    let Some(column) = table.column("material")? else {
        return Ok(());
    };
    let mut named = table.rows().iter().map(|row| (row.line, row.cell(column)));
    let Some((_, first)) = named.next() else {
        return Ok(());
    };
    match named.find(|(_, name)| *name != first) {
        None => Ok(()),
        Some((line, name)) => Err(table.wrong(
            line,
            &format!(
                "column material: it is of {}, and rows above are of {}; give a file for each \
                 material",
                escaped(name),
                escaped(first)
            ),
        )),
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

#[cfg(test)]
mod tests {
    use super::*;

    const TOLERANCE: f64 = 0.01;

    /// theta_i, phi_i, theta_o, phi_o in degrees.
    const PATTERN: [[f64; 4]; 3] = [
        [20.0, 0.0, 50.0, 70.0],
        [40.0, 0.0, 40.0, 110.0],
        [30.0, 0.0, 60.0, 180.0],
    ];

    /// The cause that the first row which matches no sample is given; None if all rows match.
    fn cause(rows: &[[f64; 4]], named: bool) -> Option<Option<Cause>> {
        let given = |row: &[f64; 4]| Given::Directions(row.map(f64::to_radians));
        let arms = PATTERN.map(|row| Arms::of(given(&row).angles()));
        let rows = rows.iter().enumerate().map(|(index, row)| ReadRow {
            line: 0,
            index: named.then_some(index),
            given: Some(given(row)),
            values: None,
            saturated: false,
            quantity: String::new(),
        });
        let rows = Rows {
            path: "rows".into(),
            unit: "row",
            rows: rows.collect(),
        };
        let mut wrong = rows.rows.iter();
        let wrong = wrong.find(|row| rows.sample(row, &arms, TOLERANCE).is_err())?;
        let place = wrong.given.map(|given| Arms::of(given.angles()))?;
        Some(rows.cause(wrong, place, &arms, TOLERANCE))
    }

    #[test]
    fn the_cause_of_rows_that_match_no_sample_is_found() {
        let mirrored =
            PATTERN.map(|[theta_i, phi_i, theta_o, phi_o]| [theta_i, -phi_i, theta_o, -phi_o]);
        let exchanged =
            PATTERN.map(|[theta_i, phi_i, theta_o, phi_o]| [theta_o, phi_o, theta_i, phi_i]);
        let both =
            exchanged.map(|[theta_i, phi_i, theta_o, phi_o]| [theta_i, -phi_i, theta_o, -phi_o]);
        for named in [false, true] {
            assert_eq!(cause(&PATTERN, named), None);
            assert_eq!(cause(&mirrored, named), Some(Some(Cause::Mirrored)));
            // In the plane of incidence both are the same, and nothing is wrong.
            assert_eq!(cause(&mirrored[2..], false), None);
            let other = [mirrored[0], [1.0, 0.0, 2.0, 0.0]];
            assert_eq!(cause(&other, named), Some(None));
        }
        assert_eq!(cause(&exchanged, false), Some(Some(Cause::Exchanged(0))));
        assert_eq!(cause(&exchanged, true), None);
        assert_eq!(cause(&both, true), Some(Some(Cause::Mirrored)));
        // With theta_i equal to theta_o, mirrored arms are exchanged ones.
        assert_eq!(
            cause(&mirrored[1..2], false),
            Some(Some(Cause::Exchanged(1)))
        );
        assert_eq!(cause(&mirrored[..2], false), Some(Some(Cause::Mirrored)));
        let radians = PATTERN.map(|row| row.map(f64::to_radians));
        assert_eq!(cause(&radians, false), Some(Some(Cause::Radians)));
    }
}
