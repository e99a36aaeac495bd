//! Reading of PAB-Opto files: values at scattered directions are resampled to RGL's tensor file.

use std::f64::consts::FRAC_PI_2;
use std::path::{Path, PathBuf};

use glimpse_core::geometry::{Angles, HalfDifference};

use super::file::{Incidence, OutgoingValue, SET_THETA_I, files_of, sample_name_of};
use super::{ANGLE_TOLERANCE, direction};
use crate::error::{Defect, read_text};
use crate::formats::rgl::{RglMeasurement, to_rgl};
use crate::lists::add_scaled;
use crate::loss::coarse_directions;
use crate::untrusted::escaped;
use crate::{Brdf, Coverage, Material, Omission, SourceError, Tabulation};

/// The number of cells along each axis of the plane; see [`ScatteredValues`].
const CELLS: usize = 60;
/// The number of nearest values that an interpolation averages.
const NEAREST_COUNT: usize = 4;
/// The largest difference in degrees between two theta_i for an interpolation between them.
const MAX_GAP: f64 = 30.0;
/// The largest difference in degrees between a theta_i and the nearest measured one, without interpolation.
const MAX_BEYOND: f64 = 10.0;
/// The largest angle in degrees between an outgoing direction and the nearest measured one.
const MAX_OUTGOING_DISTANCE: f64 = 20.0;
/// The largest length of a file in bytes. It suffices for a million directions. Files from this program have 300 kB.
const MAX_BYTES: u64 = 1 << 26;

/// A material at its measured directions.
///
/// Between outgoing directions, the four nearest values are averaged with inverse squared distances as weights. Between
/// two theta_i, the BRDF is interpolated linearly at the same half vector. It is NaN at directions that are far from
/// measured ones.
pub struct PabSet {
    sample: String,
    coverage: Coverage,
    pub(crate) omissions: Vec<Omission>,
    /// theta_i in degrees, in increasing order, and the values there.
    slices: Vec<(f64, ScatteredValues)>,
}

impl PabSet {
    /// Reads a material. `path` is one of its files. The other files are in the same directory, with the same sample name or
    /// the same file name without the incoming angle. The sample name becomes the name of the material. Values at the same
    /// theta_i are joined.
    ///
    /// # Errors
    /// If a file cannot be read or is damaged, the files have more than one phi_i or no reflected light, or a theta_i that a
    /// header lists is missing.
    pub fn read(path: &Path) -> Result<Self, SourceError> {
        let (sample, paths) = (sample_name_of(path)?, files_of(path)?);
        let mut phi_i = None;
        let mut set_theta_i = Vec::new();
        let mut incidences = Vec::new();
        for file in &paths {
            let incidence =
                Incidence::parse(&read_text(file, MAX_BYTES)?).map_err(Defect::in_file(file))?;
            if (ANGLE_TOLERANCE..90.0).contains(&incidence.theta_i) {
                let first_phi_i = *phi_i.get_or_insert(incidence.phi_i);
                let turns = (incidence.phi_i - first_phi_i) / 360.0;
                if 360.0 * (turns - turns.round()).abs() > ANGLE_TOLERANCE {
                    return Err(Defect::in_file(file)(Defect::unsupported(format!(
                        "its inphi is {}, that of other files of {} is {first_phi_i}, and only isotropic materials \
                         (one inphi) are supported",
                        incidence.phi_i,
                        escaped(&sample)
                    ))));
                }
            }
            set_theta_i.extend_from_slice(&incidence.set_theta_i);
            incidences.push((file.clone(), incidence));
        }
        let is_missing = |theta: &&f64| {
            let mut all = incidences.iter();
            !all.any(|(_, incidence)| is_near(incidence.theta_i, **theta))
        };
        if let Some(theta) = set_theta_i.iter().find(is_missing) {
            return Err(Defect::in_file(path)(format!(
                "its {SET_THETA_I} lists the intheta {theta}, and none of the {} files of {} has it",
                paths.len(),
                escaped(&sample)
            )));
        }
        Self::new(sample, incidences).map_err(Defect::in_file(path))
    }

    /// Creates a material of incidences and their files. Values at the same theta_i are joined.
    ///
    /// # Errors
    /// If no light is reflected.
    pub(crate) fn new(
        sample: String,
        mut incidences: Vec<(PathBuf, Incidence)>,
    ) -> Result<Self, Defect> {
        let mut has_transmission = false;
        for (_, incidence) in &mut incidences {
            let (theta_i, values) = (incidence.theta_i, &mut incidence.values);
            let theta = |([theta_o, _], _): &OutgoingValue| theta_i.max(*theta_o);
            has_transmission |= values
                .iter()
                .any(|value| theta(value) > 90.0 + ANGLE_TOLERANCE);
            values.retain(|value| theta(value) < 90.0);
        }
        incidences.retain(|(_, incidence)| !incidence.values.is_empty());
        if incidences.is_empty() {
            let defect = "it has no reflected light (both theta below 90 degrees), and transmission is not read";
            return Err(Defect::new(defect, "give a file of a BRDF"));
        }
        let mut files: Vec<(PathBuf, f64)> = Vec::new();
        let mut slices: Vec<(f64, ScatteredValues)> = Vec::new();
        for (file, incidence) in incidences {
            let theta_i = incidence.theta_i;
            let mut indices = 0..slices.len();
            let same = indices.find(|index| is_near(slices[*index].0, theta_i));
            let index = same.unwrap_or_else(|| {
                let cells = vec![Vec::new(); CELLS * CELLS];
                slices.push((theta_i, ScatteredValues { cells }));
                slices.len() - 1
            });
            slices[index].1.add(&incidence);
            files.push((file, theta_i));
        }
        slices.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        files.sort_by(|(_, a), (_, b)| a.total_cmp(b));
        let mut set = Self {
            sample,
            coverage: Coverage::default(),
            omissions: vec![Omission::Transmission; usize::from(has_transmission)],
            slices,
        };
        let directions = coarse_directions();
        let is_unknown = |angles: &&Angles<f32>| {
            let at = HalfDifference::from_angles(**angles);
            set.interpolate(&at, true).is_none()
        };
        let unknown = directions.iter().filter(is_unknown).count();
        set.coverage = Coverage::Incidences {
            files,
            unknown: unknown as f64 / directions.len() as f64,
        };
        Ok(set)
    }

    /// Resamples a complete set with [`to_rgl`]; an incomplete one remains as it is.
    pub(crate) fn resampled(self, path: &Path) -> Result<Box<dyn Material>, SourceError> {
        if !self.is_complete() {
            return Ok(Box::new(self));
        }
        let bytes = to_rgl(&Tabulation::rgb(&self.sample, &self), false)
            .map_err(|error| Defect::in_file(path)(error.to_string()))?;
        let resampled = RglMeasurement::parse(self.sample, &bytes);
        let mut resampled = resampled.map_err(Defect::in_file(path))?;
        resampled.coverage = self.coverage;
        resampled.omissions = self.omissions;
        Ok(Box::new(resampled))
    }

    /// Interpolates between the theta_i around that of `at`. If `is_limited`, returns None far from measured directions.
    fn interpolate(&self, at: &HalfDifference<f32>, is_limited: bool) -> Option<[f64; 3]> {
        let limit = |degrees: f64| match is_limited {
            true => degrees + ANGLE_TOLERANCE,
            false => f64::INFINITY,
        };
        let [x, y, z] = at.directions().incoming.map(f64::from);
        let theta_i = x.hypot(y).atan2(z);
        // The half vector, rotated so that the incoming direction has phi = 0.
        let (sin_h, cos_h) = (f64::from(at.hx), f64::from(at.hz));
        let phi = -y.atan2(x);
        let half = [sin_h * phi.cos(), sin_h * phi.sin(), cos_h];
        let degrees = theta_i.to_degrees();
        let after = self.slices.partition_point(|(theta, _)| *theta <= degrees);
        let is_between = (1..self.slices.len()).contains(&after)
            && self.slices[after].0 - self.slices[after - 1].0 <= limit(MAX_GAP);
        let slice_value = |index: usize| {
            let (theta, scattered) = self.slices.get(index)?;
            if !is_between && (theta - degrees).abs() > limit(MAX_BEYOND) {
                return None;
            }
            let incoming = direction(*theta, 0.0);
            let cosine: f64 = incoming.iter().zip(half).map(|(a, b)| a * b).sum();
            let [x, y, z]: [f64; 3] = std::array::from_fn(|i| 2.0 * cosine * half[i] - incoming[i]);
            let value = scattered.interpolate([x, y, z.max(0.0)], limit(MAX_OUTGOING_DISTANCE))?;
            Some((*theta, value))
        };
        let low = after.checked_sub(1).and_then(slice_value);
        let high = slice_value(after);
        if let (true, Some((low_theta, low)), Some((high_theta, high))) = (is_between, low, high) {
            let fraction = (degrees - low_theta) / (high_theta - low_theta);
            return Some(std::array::from_fn(|i| {
                low[i] + fraction * (high[i] - low[i])
            }));
        }
        let distance = |(theta, _): &(f64, [f64; 3])| (theta - degrees).abs();
        let near = low.into_iter().chain(high);
        let near = near.filter(|slice| distance(slice) <= limit(MAX_BEYOND));
        let nearest = near.min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.map(|(_, value)| value)
    }

    /// Returns true if no direction is far from measured ones.
    fn is_complete(&self) -> bool {
        self.coverage.unknown() == 0.0
    }
}

fn is_near(a: f64, b: f64) -> bool {
    (a - b).abs() < ANGLE_TOLERANCE
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
    /// Adds the values of a file.
    fn add(&mut self, incidence: &Incidence) {
        for ([theta, phi], brdf) in &incidence.values {
            let (sin, cos) = (phi - incidence.phi_i).to_radians().sin_cos();
            let position = [theta / 90.0 * cos, theta / 90.0 * sin];
            let [column, row] = position.map(cell_index);
            self.cells[column + CELLS * row].push((position, *brdf));
        }
    }

    /// Returns the mean of the values nearest to a direction, weighted by inverse squared distance. None if the nearest one
    /// is further than `max_distance`, in degrees.
    fn interpolate(&self, [x, y, z]: [f64; 3], max_distance: f64) -> Option<[f64; 3]> {
        let sin_theta = x.hypot(y);
        let scale = if sin_theta > 0.0 {
            sin_theta.atan2(z).to_degrees() / 90.0 / sin_theta
        } else {
            0.0
        };
        let position = [x * scale, y * scale];
        let mut nearest: Vec<(f64, [f64; 2], [f32; 3])> = Vec::new();
        let [column, row] = position.map(cell_index);
        // After the ring with enough values, one more ring of cells is searched, because it may have nearer values.
        let mut last_ring = CELLS;
        // Distances in the plane are up to pi/2 times the angles.
        let max_cells = max_distance * FRAC_PI_2 / 180.0 * CELLS as f64 + 2.0;
        for ring in 0..CELLS.min(max_cells as usize) {
            if ring > last_ring {
                break;
            }
            for (cell_row, cell_column) in cells_on_ring(column, row, ring) {
                for (other, brdf) in &self.cells[cell_column + CELLS * cell_row] {
                    let squared_distance =
                        (other[0] - position[0]).powi(2) + (other[1] - position[1]).powi(2);
                    nearest.push((squared_distance, *other, *brdf));
                }
            }
            if nearest.len() >= NEAREST_COUNT && last_ring == CELLS {
                last_ring = ring + 1;
            }
        }
        nearest.sort_by(|(a, ..), (b, ..)| a.total_cmp(b));
        nearest.truncate(NEAREST_COUNT);
        let (_, [nearest_x, nearest_y], _) = nearest.first()?;
        let theta = 90.0 * nearest_x.hypot(*nearest_y);
        let [a, b, c] = direction(theta, nearest_y.atan2(*nearest_x).to_degrees());
        // `z` may be 0 instead of negative, and rounding may make the cosine exceed 1.
        let cosine = (a * x + b * y + c * z) / sin_theta.hypot(z).max(f64::MIN_POSITIVE);
        let distance = cosine.min(1.0).acos().to_degrees();
        if distance > max_distance {
            return None;
        }
        let (mut sum, mut total_weight) = ([0.0; 3], 0.0);
        for (squared_distance, _, brdf) in nearest {
            let weight = 1.0 / (squared_distance + 1e-12);
            total_weight += weight;
            add_scaled(&mut sum, weight, &brdf);
        }
        Some(sum.map(|sum| sum / total_weight))
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
    fn values_at(&self, at: &[HalfDifference<f32>]) -> Vec<[f32; 3]> {
        let is_limited = !self.is_complete();
        let values = at.iter().map(|at| self.interpolate(at, is_limited));
        let to_f32 = |value: [f64; 3]| value.map(|value| value as f32);
        values
            .map(|value| value.map_or([f32::NAN; 3], to_f32))
            .collect()
    }
}

/// An incomplete set. Its derivatives are unknown.
impl Material for PabSet {
    fn name(&self) -> &str {
        &self.sample
    }

    fn coverage(&self) -> Coverage {
        self.coverage.clone()
    }

    fn omissions(&self) -> Vec<Omission> {
        self.omissions.clone()
    }
}
