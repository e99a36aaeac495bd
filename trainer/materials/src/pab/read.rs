//! A set of files, read: scattered directions become the functions of a tensor file.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use glimpse_core::geometry::HalfDifference;

use super::direction;
use super::file::{Incidence, SET, sample_of};
use crate::error::refused;
use crate::name::{is_name, name_of};
use crate::untrusted::{escaped, read_at_most};
use crate::{Brdf, RglMeasurement, SourceError, to_rgl};

/// Cells of the plane in each direction; see [`Scattered`].
const CELLS: usize = 60;
/// Of so many nearest values the mean is taken.
const NEAREST: usize = 4;
/// Degrees within which two phi_i, or two theta_i, are the same.
const SAME: f64 = 0.01;
/// The longest file that is read: a million directions and more. This program's have 300 kB.
const MOST_BYTES: u64 = 1 << 26;
/// Where the header of another file beside it, which says its sample, ends at the latest.
const HEAD: u64 = 1 << 14;

/// Reads the material of whose files `path` is one, as [`PabSet::read`] does: all of it is tabulated as
/// [`to_rgl`] does, and looked up there.
///
/// # Errors
/// As [`PabSet::read`].
pub fn read_pab(path: &Path) -> Result<RglMeasurement, SourceError> {
    let set = PabSet::read(path)?;
    let bytes = to_rgl(&set.sample, &set).map_err(|error| damaged(path)(error.to_string()))?;
    RglMeasurement::parse(set.sample, &bytes).map_err(damaged(path))
}

/// What becomes of something that is wrong with a file.
fn damaged(path: &Path) -> impl Fn(String) -> SourceError {
    move |what| SourceError::Damaged {
        path: path.into(),
        what,
    }
}

/// A material at the directions that it was measured at.
///
/// What lies between them is interpolated: between outgoing ones the nearest four by their distance,
/// between two theta_i at the same half vector.
pub struct PabSet {
    sample: String,
    /// By increasing theta_i in degrees.
    slices: Vec<(f64, Scattered)>,
}

impl PabSet {
    /// Reads the material of whose files `path` is one: those beside it of the same ending that name
    /// the same sample. It is named by that.
    ///
    /// # Errors
    /// If a file cannot be read or is damaged, light came from more than one phi_i, or a file is
    /// missing of a set that says which it has.
    pub fn read(path: &Path) -> Result<Self, SourceError> {
        let (sample, files) = set_of(path)?;
        let mut slices: Vec<(f64, Scattered)> = Vec::new();
        let mut phi_i = None;
        let mut promised = None;
        for file in &files {
            let incidence = Incidence::parse(&text_of(file)?).map_err(damaged(file))?;
            if incidence.theta_i > SAME {
                let first = *phi_i.get_or_insert(incidence.phi_i);
                if (incidence.phi_i - first).abs() > SAME {
                    return Err(damaged(file)(format!(
                        "its inphi is {}, and {first} in others of {}: it may be anisotropic, and \
                         only isotropic materials (one inphi) are read; take it away",
                        incidence.phi_i,
                        escaped(&sample)
                    )));
                }
            }
            slices.push((incidence.theta_i, Scattered::of(&incidence)));
            promised = promised.or(incidence.set);
        }
        slices.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        if let Some([(theta, _), _]) = slices.array_windows().find(|[a, b]| b.0 - a.0 < SAME) {
            return Err(damaged(path)(format!(
                "two files of {} have an intheta of {theta}; take one away",
                escaped(&sample)
            )));
        }
        let is_there = |theta: &f64| slices.iter().any(|(other, _)| (other - theta).abs() < SAME);
        if let Some(theta) = promised.iter().flatten().find(|theta| !is_there(theta)) {
            return Err(damaged(path)(format!(
                "its {SET} names an intheta of {theta}, and of the {} files of {} beside it none \
                 has that; put the missing one back",
                files.len(),
                escaped(&sample)
            )));
        }
        Ok(Self { sample, slices })
    }
}

/// The files of the material of which `path` is one.
pub(crate) fn files_of(path: &Path) -> Result<Vec<PathBuf>, SourceError> {
    Ok(set_of(path)?.1)
}

/// Its name, and its files in order.
fn set_of(path: &Path) -> Result<(String, Vec<PathBuf>), SourceError> {
    let own = text_of(path)?;
    let sample = sample_of(&own);
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut files = Vec::new();
    for entry in folder.read_dir().map_err(refused(folder))? {
        let entry = entry.map_err(refused(folder))?;
        let beside = path.with_file_name(entry.file_name());
        if beside.extension() != path.extension() || !beside.is_file() {
            continue;
        }
        // What is no text is not of the set either.
        let of_same = head_of(&beside)
            .is_ok_and(|text| super::begins(text.as_bytes()) && sample_of(&text) == sample);
        if of_same || beside == path {
            files.push(beside);
        }
    }
    files.sort();
    let named = sample.map(|name| name.trim_matches('"').to_owned());
    if let Some(name) = named.iter().find(|name| !name.is_empty() && !is_name(name)) {
        return Err(damaged(path)(format!(
            "its sample_name is {}, and should be a name without slashes; correct it",
            escaped(name)
        )));
    }
    let name = named
        .filter(|name| !name.is_empty())
        .or_else(|| name_of(path));
    Ok((
        name.ok_or_else(|| SourceError::UnknownFormat(path.into()))?,
        files,
    ))
}

fn text_of(path: &Path) -> Result<String, SourceError> {
    let bytes = read_at_most(path, MOST_BYTES).map_err(refused(path))?;
    String::from_utf8(bytes).map_err(|error| {
        damaged(path)(format!(
            "it is no text: byte {} is none of UTF-8; get it again",
            error.utf8_error().valid_up_to()
        ))
    })
}

/// How a file begins that may be of the same set, or a film of a holiday.
fn head_of(path: &Path) -> io::Result<String> {
    let mut head = Vec::new();
    File::open(path)?.take(HEAD).read_to_end(&mut head)?;
    Ok(String::from_utf8_lossy(&head).into_owned())
}

/// Values at scattered outgoing directions, found by place: theta_o (cos phi, sin phi) in units of 90
/// degrees, phi less that of the incoming direction.
struct Scattered {
    cells: Vec<Vec<([f64; 2], [f32; 3])>>,
}

impl Scattered {
    fn of(incidence: &Incidence) -> Self {
        let mut cells = vec![Vec::new(); CELLS * CELLS];
        for ([theta, phi], brdf) in &incidence.values {
            let (sin, cos) = (phi - incidence.phi_i).to_radians().sin_cos();
            let place = [theta / 90.0 * cos, theta / 90.0 * sin];
            let [column, row] = place.map(cell);
            cells[column + CELLS * row].push((place, *brdf));
        }
        Self { cells }
    }

    /// The mean of the nearest values, by their distance's inverse square.
    fn at(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let across = x.hypot(y);
        let scale = if across > 0.0 {
            across.atan2(z).to_degrees() / 90.0 / across
        } else {
            0.0
        };
        let place = [x * scale, y * scale];
        let mut found: Vec<(f64, [f32; 3])> = Vec::new();
        let [column, row] = place.map(cell);
        // One ring of cells more than that in which there are enough: it may hold nearer ones.
        let mut last = CELLS;
        for ring in 0..CELLS {
            if ring > last {
                break;
            }
            for (cell_row, cell_column) in on_ring(column, row, ring) {
                for (other, brdf) in &self.cells[cell_column + CELLS * cell_row] {
                    let square = (other[0] - place[0]).powi(2) + (other[1] - place[1]).powi(2);
                    found.push((square, *brdf));
                }
            }
            if found.len() >= NEAREST && last == CELLS {
                last = ring + 1;
            }
        }
        found.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        found.truncate(NEAREST);
        let (mut sum, mut whole) = ([0.0; 3], 0.0);
        for (square, brdf) in found {
            let weight = 1.0 / (square + 1e-12);
            whole += weight;
            for (sum, value) in sum.iter_mut().zip(brdf) {
                *sum += weight * f64::from(value);
            }
        }
        sum.map(|sum| sum / whole)
    }
}

/// The cell of a coordinate of \[-1, 1\].
fn cell(coordinate: f64) -> usize {
    ((0.5 * (coordinate + 1.0) * CELLS as f64) as usize).min(CELLS - 1)
}

/// Rows and columns that are so many away.
fn on_ring(column: usize, row: usize, ring: usize) -> impl Iterator<Item = (usize, usize)> {
    let range = move |at: usize| at.saturating_sub(ring)..=(at + ring).min(CELLS - 1);
    range(row)
        .flat_map(move |r| range(column).map(move |c| (r, c)))
        .filter(move |(r, c)| r.abs_diff(row).max(c.abs_diff(column)) == ring)
}

impl Brdf for PabSet {
    fn evaluate(&self, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]) {
        for (at, brdf) in at.iter().zip(brdf) {
            *brdf = self.value(at).map(|value| value as f32);
        }
    }
}

impl PabSet {
    fn value(&self, at: &HalfDifference<f32>) -> [f64; 3] {
        let [x, y, z] = at.directions().incoming.map(f64::from);
        let theta_i = x.hypot(y).atan2(z);
        // The half vector, as seen with the incoming direction at phi = 0.
        let (sin_h, cos_h) = (f64::from(at.hx), f64::from(at.hz));
        let phi = -y.atan2(x);
        let half = [sin_h * phi.cos(), sin_h * phi.sin(), cos_h];
        let value = |index: usize| {
            let (degrees, scattered) = &self.slices[index];
            let incoming = direction(*degrees, 0.0);
            let cosine: f64 = incoming.iter().zip(half).map(|(a, b)| a * b).sum();
            let [x, y, z]: [f64; 3] = std::array::from_fn(|i| 2.0 * cosine * half[i] - incoming[i]);
            scattered.at([x, y, z.max(0.0)])
        };
        let degrees = theta_i.to_degrees();
        let after = self.slices.partition_point(|(theta, _)| *theta <= degrees);
        if after == 0 || after == self.slices.len() {
            return value(after.saturating_sub(1));
        }
        let [low, high] = [self.slices[after - 1].0, self.slices[after].0];
        let share = (degrees - low) / (high - low);
        let (low, high) = (value(after - 1), value(after));
        std::array::from_fn(|i| low[i] + share * (high[i] - low[i]))
    }
}
