//! RGL: an isotropic material of the RGL material database, in the adaptive parameterization of the measurement (Dupuy
//! and Jakob 2018, "An Adaptive Parameterization for Efficient Material Acquisition and Modeling").
//!
//! A tensor file `NAME_rgb.bsdf` holds functions on unit squares, bilinear between nodes. The angles of a direction are
//! mapped to \[0, 1\] by u(theta) = sqrt(2 theta / pi) and v(phi) = (phi + pi) / 2 pi. w_m is the half vector, and phi
//! is its azimuth relative to w_i. The fields are:
//!
//! - `ndf`: D(u(theta_m), v(phi)), the distribution of microfacet normals, from retro-reflection;
//! - `sigma`: the projected area of these microfacets towards theta_i;
//! - `vndf`: the density of visible normals at each node of `theta_i`. The mapping that makes it uniform takes
//!   (u(theta_m), v(phi)) to a point s, so that nodes are dense where the material reflects most;
//! - `rgb`: the measured factor M(s) at each node of `theta_i`, for each channel.
//!
//! BRDF times cos(theta_o) = M(s) D / (4 sigma), clamped to at least 0, because interpolation of the measurement may be
//! negative. It is not reciprocal.

mod distribution;
mod normals;
mod real_scalar;
mod sample_point;
mod tensor_file;
#[cfg(test)]
mod tests;
mod write;

pub use write::to_rgl;

use std::f32::consts::FRAC_PI_2;
use std::f64::consts::{PI, TAU};
use std::path::Path;

use glimpse_core::geometry::{Angles, HalfDifference};

use self::distribution::{Cell, Densities, SlicePosition, TableShape};
use self::real_scalar::{RealScalar, unit_theta};
use self::tensor_file::TensorFile;
use super::mapped::map;
use super::name;
use super::{Material, SourceError};
use glimpse_kernels::Dual;

/// A material from a measurement of the RGL database.
///
/// The BRDF is 0 below the horizon. Above, it is interpolated between the measured directions, with the exact
/// derivatives of the interpolant. theta_i is clamped to the last measured one. The stored values are the BRDF times
/// cos(theta_o), and look-ups return the BRDF without the cosine. It is therefore unbounded towards a grazing theta_o.
pub struct RglMeasurement {
    name: String,
    tensors: Tensors,
}

impl RglMeasurement {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// If the file cannot be read, is damaged, holds a number that is not finite, or is a spectral or anisotropic
    /// measurement.
    pub fn read(path: &Path) -> Result<Self, SourceError> {
        let name = name::name_of(path).ok_or_else(|| SourceError::UnknownFormat(path.into()))?;
        let damaged = |what| SourceError::Damaged {
            path: path.into(),
            what,
        };
        // Spectral files are large, and their header suffices to reject them.
        let bytes = map(path)?;
        Self::parse(name, &bytes).map_err(damaged)
    }

    /// Parses the bytes of a file. On failure, returns the defect and what to do.
    pub(super) fn parse(name: String, bytes: &[u8]) -> Result<Self, String> {
        let tensors = Tensors::parse(bytes)?;
        Ok(Self { name, tensors })
    }

    /// Returns true if the first bytes of a file are those of a tensor file.
    #[must_use]
    pub fn has_signature(bytes: &[u8]) -> bool {
        bytes.starts_with(tensor_file::MAGIC)
    }
}

impl Material for RglMeasurement {
    fn name(&self) -> &str {
        &self.name
    }

    fn brdf(&self, angles: Angles<f32>) -> [f32; 3] {
        self.tensors.brdf(to_f64(angles)).map(to_f32)
    }

    fn brdf_with_derivative(&self, angles: Angles<f32>) -> ([f32; 3], [[f32; 3]; 3]) {
        let duals = self.tensors.brdf(Dual::<f64, 3>::variables(to_f64(angles)));
        let (brdf, derivative) = Dual::split(duals);
        (
            brdf.map(to_f32),
            derivative.map(|by_angles| by_angles.map(to_f32)),
        )
    }
}

fn to_f64(angles: Angles<f32>) -> Angles<f64> {
    Angles {
        theta_h: angles.theta_h.into(),
        theta_d: angles.theta_d.into(),
        phi_d: angles.phi_d.into(),
    }
}

/// Converts to f32. The result is finite even if theta_o is close to the horizon.
fn to_f32(value: f64) -> f32 {
    (value as f32).clamp(f32::MIN, f32::MAX)
}

/// The fields of a file that look-ups need.
struct Tensors {
    /// Nodes of theta_i, in radians.
    theta_i: Vec<f32>,
    ndf: (TableShape, Vec<f32>),
    sigma: (TableShape, Vec<f32>),
    vndf: Densities,
    /// Red, green and blue slices for each node of theta_i.
    rgb: (TableShape, Vec<f32>),
}

impl Tensors {
    fn parse(bytes: &[u8]) -> Result<Self, String> {
        let file = TensorFile::parse(bytes)?;
        if !file.has("rgb") && (file.has("spectra") || file.has("wavelengths")) {
            return Err("it is a spectral measurement, and only RGB is supported; replace it with the material's \
                 *_rgb.bsdf"
                .to_owned());
        }
        let ([phis], _) = file.floats("phi_i")?;
        // Two phi_i of an isotropic material are -pi and pi.
        if !(1..=2).contains(&phis) {
            return Err(format!(
                "it has {phis} phi_i, and only isotropic materials (1 or 2 phi_i) are supported; remove the file"
            ));
        }
        if file.byte("jacobian")? != 1 {
            return Err(
                "its field jacobian is not 1, so that its values differ from those of the database; get it again"
                    .to_owned(),
            );
        }
        let ([nodes], theta_i) = file.floats("theta_i")?;
        if nodes == 0 || !theta_i.is_sorted_by(|a, b| a < b) {
            return Err("its field theta_i does not increase; get it again".to_owned());
        }
        // The largest valid theta_i is pi/2, rounded to f32.
        let outside = |theta: &&f32| !(0.0..=FRAC_PI_2).contains(*theta);
        if let Some(theta) = theta_i.iter().find(outside) {
            return Err(format!(
                "its field theta_i holds {theta}, and must hold radians from 0 to pi/2; get it again"
            ));
        }

        let (shape, ndf) = file.floats::<2>("ndf")?;
        let ndf = (grid("ndf", shape)?, densities("ndf", ndf)?);
        let (shape, sigma) = file.floats::<2>("sigma")?;
        let sigma = (grid("sigma", shape)?, sigma);
        if let Some(area) = sigma.1.iter().find(|area| **area <= 0.0) {
            return Err(format!(
                "its field sigma holds the area {area}, and must hold positive areas; get it again"
            ));
        }

        let ([vndf_phis, vndf_nodes, rows, columns], vndf) = file.floats("vndf")?;
        let vndf = densities("vndf", vndf)?;
        let vndf_grid = grid("vndf", [rows, columns])?;
        let ([rgb_phis, rgb_nodes, channels, rows, columns], rgb) = file.floats("rgb")?;
        let rgb_grid = grid("rgb", [rows, columns])?;
        if [vndf_phis, vndf_nodes] != [phis, nodes]
            || [rgb_phis, rgb_nodes, channels] != [phis, nodes, 3]
        {
            return Err(format!(
                "it has {phis} phi_i and {nodes} theta_i, but its field vndf has [{vndf_phis}, {vndf_nodes}] of them, \
                 and rgb has [{rgb_phis}, {rgb_nodes}] and {channels} channels; get it again"
            ));
        }
        // The slices of all phi_i of an isotropic material are equal.
        let first_phi = |mut values: Vec<f32>| {
            values.truncate(values.len() / phis);
            values
        };
        Ok(Self {
            theta_i,
            ndf,
            sigma,
            vndf: Densities::new(vndf_grid, first_phi(vndf)),
            rgb: (rgb_grid, first_phi(rgb)),
        })
    }

    /// Returns the BRDF, not times the cosine.
    #[inline(always)]
    fn brdf<S: RealScalar>(&self, angles: Angles<S>) -> [S; 3] {
        let zero = S::constant(0.0);
        let at = HalfDifference::from_angles(angles);
        let (cos_i, cos_o) = (at.cos_theta_i(), at.cos_theta_o());
        // NaN counts as below the horizon.
        if !(cos_i.value() > 0.0 && cos_o.value() > 0.0) {
            return [zero; 3];
        }
        let [x, y, _] = at.directions().incoming;
        let theta_i = (x * x + y * y).sqrt().atan2(cos_i);
        // The azimuth of the half vector is 0.
        let phi = -y.atan2(x);
        let half = [
            unit_theta(angles.theta_h),
            (phi + S::constant(PI)) * S::constant(1.0 / TAU),
        ];

        let position = SlicePosition::new(theta_i, &self.theta_i);
        let point = self.vndf.make_uniform(half, &position);
        let (grid, values) = &self.ndf;
        let normals = grid.evaluate(values, &Cell::new(half, *grid));
        let (grid, values) = &self.sigma;
        let area = grid.evaluate(values, &Cell::new([unit_theta(theta_i), zero], *grid));
        let factor = normals / (S::constant(4.0) * area * cos_o);

        let (grid, values) = &self.rgb;
        let cell = Cell::new(point, *grid);
        [0, 1, 2].map(|channel| {
            let measured = position.mix(|node| {
                let start = (3 * node + channel) * grid.nodes();
                grid.evaluate(values.get(start..).unwrap_or_default(), &cell)
            });
            (measured * factor).relu()
        })
    }
}

/// Returns the values of a field of densities if none is negative. Factors of `rgb` may be negative because of noise.
fn densities(field: &str, values: Vec<f32>) -> Result<Vec<f32>, String> {
    match values.iter().position(|value| *value < 0.0) {
        Some(index) => Err(format!(
            "number {index} of its field {field} is {}, and must be at least 0; get it again",
            values[index]
        )),
        None => Ok(values),
    }
}

/// Returns the shape of a field's grid if it has at least 2 rows and 2 columns.
fn grid(field: &str, [rows, columns]: [usize; 2]) -> Result<TableShape, String> {
    if rows < 2 || columns < 2 {
        return Err(format!(
            "its field {field} has {rows} rows and {columns} columns, and must have at least 2 of each; get it again"
        ));
    }
    Ok(TableShape { columns, rows })
}
