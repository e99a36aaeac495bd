//! Reading of PAB-Opto files: values at scattered directions are resampled to RGL's tensor file.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use glimpse_core::geometry::HalfDifference;

use super::direction;
use super::file::{Incidence, SET_THETA_I, sample_name};
use crate::error::{Defect, read_error};
use crate::name::{is_valid_name, name_of};
use crate::untrusted::{escaped, read_at_most};
use crate::{Brdf, Colors, RglMeasurement, SourceError, to_rgl};

/// The number of cells along each axis of the plane; see [`ScatteredValues`].
const CELLS: usize = 60;
/// The number of nearest values that an interpolation averages.
const NEAREST_COUNT: usize = 4;
/// The difference in degrees below which two phi_i, or two theta_i, count as equal.
const ANGLE_TOLERANCE: f64 = 0.01;
/// The largest length of a file in bytes. It suffices for a million directions. Files from this program have 300 kB.
const MAX_BYTES: u64 = 1 << 26;
/// The number of bytes that are read from each other file in the directory, to get the name of its sample.
const HEAD_BYTES: u64 = 1 << 14;

/// Reads a material with [`PabSet::read`] and resamples it with [`to_rgl`]. `path` is one of its files.
///
/// # Errors
/// As [`PabSet::read`].
pub fn read_pab(path: &Path) -> Result<RglMeasurement, SourceError> {
    let set = PabSet::read(path)?;
    let bytes = to_rgl(&set.sample, &set, Colors::Rgb)
        .map_err(|error| Defect::in_file(path)(error.to_string()))?;
    RglMeasurement::parse(set.sample, &bytes).map_err(Defect::in_file(path))
}

/// A material at its measured directions.
///
/// Between outgoing directions, the four nearest values are averaged with inverse squared distances as weights. Between
/// two theta_i, the BRDF is interpolated linearly at the same half vector.
pub struct PabSet {
    sample: String,
    /// theta_i in degrees, in increasing order, and the values there.
    slices: Vec<(f64, ScatteredValues)>,
}

impl PabSet {
    /// Reads a material. `path` is one of its files. The other files are in the same directory, with the same extension
    /// and sample name. The sample name becomes the name of the material.
    ///
    /// # Errors
    /// If a file cannot be read or is damaged, the files have more than one phi_i, or a theta_i that a header lists is
    /// missing.
    pub fn read(path: &Path) -> Result<Self, SourceError> {
        let (sample, files) = sample_files(path)?;
        let mut slices: Vec<(f64, ScatteredValues)> = Vec::new();
        let mut phi_i = None;
        let mut set_theta_i = None;
        for file in &files {
            let incidence = Incidence::parse(&read_text(file)?).map_err(Defect::in_file(file))?;
            if incidence.theta_i > ANGLE_TOLERANCE {
                let first_phi_i = *phi_i.get_or_insert(incidence.phi_i);
                if (incidence.phi_i - first_phi_i).abs() > ANGLE_TOLERANCE {
                    return Err(Defect::in_file(file)(Defect::Unsupported(format!(
                        "its inphi is {}, that of other files of {} is {first_phi_i}, and only isotropic materials \
                         (one inphi) are supported",
                        incidence.phi_i,
                        escaped(&sample)
                    ))));
                }
            }
            slices.push((incidence.theta_i, ScatteredValues::new(&incidence)));
            set_theta_i = set_theta_i.or(incidence.set_theta_i);
        }
        slices.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let is_near = |a: f64, b: f64| (a - b).abs() < ANGLE_TOLERANCE;
        let mut pairs = slices.array_windows();
        if let Some([(theta, _), _]) = pairs.find(|[a, b]| is_near(a.0, b.0)) {
            return Err(Defect::in_file(path)(format!(
                "two files of {} have the intheta {theta}",
                escaped(&sample)
            )));
        }
        let is_missing = |theta: &&f64| !slices.iter().any(|(other, _)| is_near(*other, **theta));
        if let Some(theta) = set_theta_i.iter().flatten().find(is_missing) {
            return Err(Defect::in_file(path)(format!(
                "its {SET_THETA_I} lists the intheta {theta}, and none of the {} files of {} has it",
                files.len(),
                escaped(&sample)
            )));
        }
        Ok(Self { sample, slices })
    }
}

/// Returns the files of a material. `path` is one of them.
pub(crate) fn files_of(path: &Path) -> Result<Vec<PathBuf>, SourceError> {
    Ok(sample_files(path)?.1)
}

/// Returns the name of a material, and its files sorted by path. `path` is one of them.
fn sample_files(path: &Path) -> Result<(String, Vec<PathBuf>), SourceError> {
    let text = read_text(path)?;
    let sample = sample_name(&text);
    let directory = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut files = Vec::new();
    for entry in directory.read_dir().map_err(read_error(directory))? {
        let entry = entry.map_err(read_error(directory))?;
        let candidate = path.with_file_name(entry.file_name());
        if candidate.extension() != path.extension() || !candidate.is_file() {
            continue;
        }
        // Files of other formats may have the same extension. They have no signature.
        let has_same_sample = read_head(&candidate).is_ok_and(|text| {
            super::has_signature(text.as_bytes()) && sample_name(&text) == sample
        });
        if has_same_sample || candidate == path {
            files.push(candidate);
        }
    }
    files.sort();
    let stated_name = sample.map(|name| name.trim_matches('"'));
    match stated_name.filter(|name| !name.is_empty()) {
        None => Ok((name_of(path)?, files)),
        Some(name) if is_valid_name(name) => Ok((name.to_owned(), files)),
        Some(name) => Err(Defect::in_file(path)(format!(
            "its sample_name is {}, and must be a name without slashes",
            escaped(name)
        ))),
    }
}

fn read_text(path: &Path) -> Result<String, SourceError> {
    let bytes = read_at_most(path, MAX_BYTES).map_err(read_error(path))?;
    String::from_utf8(bytes).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        Defect::in_file(path)(format!("it is not UTF-8 text from byte {valid} on"))
    })
}

/// Reads the first bytes of a file, which may have any format and length.
fn read_head(path: &Path) -> io::Result<String> {
    let mut head = Vec::new();
    File::open(path)?.take(HEAD_BYTES).read_to_end(&mut head)?;
    Ok(String::from_utf8_lossy(&head).into_owned())
}

/// Values at scattered outgoing directions, sorted into square cells of a plane.
///
/// A direction has the position theta_o (cos phi, sin phi) in the plane, in units of 90 degrees. phi is the azimuth
/// relative to the incoming direction.
struct ScatteredValues {
    /// The position and the BRDF of each value of a cell, row by row.
    cells: Vec<Vec<([f64; 2], [f32; 3])>>,
}

impl ScatteredValues {
    fn new(incidence: &Incidence) -> Self {
        let mut cells = vec![Vec::new(); CELLS * CELLS];
        for ([theta, phi], brdf) in &incidence.values {
            let (sin, cos) = (phi - incidence.phi_i).to_radians().sin_cos();
            let position = [theta / 90.0 * cos, theta / 90.0 * sin];
            let [column, row] = position.map(cell_index);
            cells[column + CELLS * row].push((position, *brdf));
        }
        Self { cells }
    }

    /// Returns the mean of the values nearest to a direction, weighted by inverse squared distance.
    fn interpolate(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let sin_theta = x.hypot(y);
        let scale = if sin_theta > 0.0 {
            sin_theta.atan2(z).to_degrees() / 90.0 / sin_theta
        } else {
            0.0
        };
        let position = [x * scale, y * scale];
        let mut nearest: Vec<(f64, [f32; 3])> = Vec::new();
        let [column, row] = position.map(cell_index);
        // After the ring with enough values, one more ring of cells is searched, because it may have nearer values.
        let mut last_ring = CELLS;
        for ring in 0..CELLS {
            if ring > last_ring {
                break;
            }
            for (cell_row, cell_column) in cells_on_ring(column, row, ring) {
                for (other, brdf) in &self.cells[cell_column + CELLS * cell_row] {
                    let squared_distance =
                        (other[0] - position[0]).powi(2) + (other[1] - position[1]).powi(2);
                    nearest.push((squared_distance, *brdf));
                }
            }
            if nearest.len() >= NEAREST_COUNT && last_ring == CELLS {
                last_ring = ring + 1;
            }
        }
        nearest.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        nearest.truncate(NEAREST_COUNT);
        let (mut sum, mut total_weight) = ([0.0; 3], 0.0);
        for (squared_distance, brdf) in nearest {
            let weight = 1.0 / (squared_distance + 1e-12);
            total_weight += weight;
            for (sum, value) in sum.iter_mut().zip(brdf) {
                *sum += weight * f64::from(value);
            }
        }
        sum.map(|sum| sum / total_weight)
    }
}

/// Returns the column or row of the cell at a coordinate in \[-1, 1\].
fn cell_index(coordinate: f64) -> usize {
    ((0.5 * (coordinate + 1.0) * CELLS as f64) as usize).min(CELLS - 1)
}

/// Returns the row and the column of each cell at Chebyshev distance `ring` from a cell.
fn cells_on_ring(column: usize, row: usize, ring: usize) -> impl Iterator<Item = (usize, usize)> {
    let range = move |center: usize| center.saturating_sub(ring)..=(center + ring).min(CELLS - 1);
    range(row)
        .flat_map(move |r| range(column).map(move |c| (r, c)))
        .filter(move |(r, c)| r.abs_diff(row).max(c.abs_diff(column)) == ring)
}

impl Brdf for PabSet {
    fn evaluate(&self, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]) {
        for (at, brdf) in at.iter().zip(brdf) {
            *brdf = self.interpolate(at).map(|value| value as f32);
        }
    }
}

impl PabSet {
    /// Interpolates between the theta_i around that of `at`.
    fn interpolate(&self, at: &HalfDifference<f32>) -> [f64; 3] {
        let [x, y, z] = at.directions().incoming.map(f64::from);
        let theta_i = x.hypot(y).atan2(z);
        // The half vector, rotated so that the incoming direction has phi = 0.
        let (sin_h, cos_h) = (f64::from(at.hx), f64::from(at.hz));
        let phi = -y.atan2(x);
        let half = [sin_h * phi.cos(), sin_h * phi.sin(), cos_h];
        let slice_value = |index: usize| {
            let (degrees, scattered) = &self.slices[index];
            let incoming = direction(*degrees, 0.0);
            let cosine: f64 = incoming.iter().zip(half).map(|(a, b)| a * b).sum();
            let [x, y, z]: [f64; 3] = std::array::from_fn(|i| 2.0 * cosine * half[i] - incoming[i]);
            scattered.interpolate([x, y, z.max(0.0)])
        };
        let degrees = theta_i.to_degrees();
        let after = self.slices.partition_point(|(theta, _)| *theta <= degrees);
        if after == 0 || after == self.slices.len() {
            return slice_value(after.saturating_sub(1));
        }
        let [low, high] = [self.slices[after - 1].0, self.slices[after].0];
        let fraction = (degrees - low) / (high - low);
        let (low, high) = (slice_value(after - 1), slice_value(after));
        std::array::from_fn(|i| low[i] + fraction * (high[i] - low[i]))
    }
}
