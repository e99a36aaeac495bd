//! RGL: an isotropic material of the RGL material database, as the measurement's own adaptive
//! parameterization stores it (Dupuy and Jakob 2018, "An Adaptive Parameterization for Efficient
//! Material Acquisition and Modeling").
//!
//! A tensor file `NAME_rgb.bsdf` holds functions on unit squares, bilinear between nodes. A
//! direction's angles are brought to \[0, 1\] by u(theta) = sqrt(2 theta / pi) and
//! v(phi) = (phi + pi) / 2 pi. With w_m the half vector, phi its azimuth less that of w_i:
//!
//! - `ndf` D(u(theta_m), v(phi)), distribution of microfacet normals, from retro-reflection;
//! - `sigma`, the area that those microfacets show towards theta_i;
//! - `vndf`, at each node of `theta_i`, the density of the normals visible from there. The mapping
//!   that makes it uniform takes (u(theta_m), v(phi)) to a point s, so that there are many nodes
//!   where the material reflects much;
//! - `rgb`, at each node of `theta_i` and for each channel, the factor M(s) that was measured.
//!
//! BRDF times cos(theta_o) = M(s) D / (4 sigma), clamped to 0 from below (interpolation of the
//! measurement overshoots). It is not reciprocal.

mod angular;
mod distribution;
mod normals;
mod place;
mod tensor_file;
#[cfg(test)]
mod tests;
mod write;

pub use write::to_rgl;

use std::f32::consts::FRAC_PI_2;
use std::f64::consts::{PI, TAU};
use std::path::Path;

use glimpse_core::geometry::{Angles, HalfDifference};

use self::angular::{Angular, unit_theta};
use self::distribution::{Between, Cell, Densities, TableShape};
use self::tensor_file::{Complaint, TensorFile};
use super::mapped::map;
use super::name;
use super::{Material, SourceError};
use glimpse_kernels::Dual;

/// A material that is a measurement of the RGL database.
///
/// Below the horizon its BRDF is 0. Above, everything between the measured directions is
/// interpolated, with the exact derivative of that interpolant, and theta_i beyond the last
/// measured one stays there. The stored values are the BRDF times cos(theta_o); the BRDF that
/// look-ups give is that divided by cos(theta_o), so it grows without bound towards a grazing
/// theta_o.
pub struct RglMeasurement {
    name: String,
    tensors: Tensors,
}

impl RglMeasurement {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// If the file cannot be read, is damaged, holds a number that is not finite, or is of a
    /// spectral or an anisotropic measurement.
    pub fn read(path: &Path) -> Result<Self, SourceError> {
        let name = name::name_of(path).ok_or_else(|| SourceError::UnknownFormat(path.into()))?;
        let damaged = |what| SourceError::Damaged {
            path: path.into(),
            what,
        };
        // Spectral files are large, and refused by their header.
        let bytes = map(path)?;
        Self::parse(name, &bytes).map_err(damaged)
    }

    /// Of a file's bytes, under a name.
    pub(super) fn parse(name: String, bytes: &[u8]) -> Result<Self, Complaint> {
        let tensors = Tensors::parse(bytes)?;
        Ok(Self { name, tensors })
    }

    /// True of bytes that begin as a tensor file does.
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
        self.tensors.brdf(in_f64(angles)).map(to_f32)
    }

    fn brdf_with_derivative(&self, angles: Angles<f32>) -> ([f32; 3], [[f32; 3]; 3]) {
        let found = self.tensors.brdf(Dual::<f64, 3>::variables(in_f64(angles)));
        let (brdf, derivative) = Dual::split(found);
        (
            brdf.map(to_f32),
            derivative.map(|by_angles| by_angles.map(to_f32)),
        )
    }
}

fn in_f64(angles: Angles<f32>) -> Angles<f64> {
    Angles {
        theta_h: angles.theta_h.into(),
        theta_d: angles.theta_d.into(),
        phi_d: angles.phi_d.into(),
    }
}

/// In single precision; finite, however close theta_o is to the horizon.
fn to_f32(value: f64) -> f32 {
    (value as f32).clamp(f32::MIN, f32::MAX)
}

fn spectral() -> Complaint {
    "it is a spectral measurement, and only RGB is read; take it away and put the material's \
     *_rgb.bsdf in its place"
        .to_owned()
}

/// What of the file look-ups need.
struct Tensors {
    /// Nodes, in radians.
    theta_i: Vec<f32>,
    ndf: (TableShape, Vec<f32>),
    sigma: (TableShape, Vec<f32>),
    vndf: Densities,
    /// Red, green and blue of each node of theta_i in turn.
    rgb: (TableShape, Vec<f32>),
}

impl Tensors {
    fn parse(bytes: &[u8]) -> Result<Self, Complaint> {
        let file = TensorFile::parse(bytes)?;
        if !file.has("rgb") && (file.has("spectra") || file.has("wavelengths")) {
            return Err(spectral());
        }
        let ([phis], _) = file.floats("phi_i")?;
        // Two close the circle.
        if !(1..=2).contains(&phis) {
            return Err(format!(
                "it is measured at {phis} phi_i: it is anisotropic, and only isotropic materials \
                 (1 or 2 phi_i) are read; take it away"
            ));
        }
        if file.byte("jacobian")? != 1 {
            return Err(
                "its field jacobian is not 1: its values are not those that the database's files \
                 hold; get it again"
                    .to_owned(),
            );
        }
        let ([nodes], theta_i) = file.floats("theta_i")?;
        if nodes == 0 || !theta_i.is_sorted_by(|a, b| a < b) {
            return Err("its theta_i do not increase; get it again".to_owned());
        }
        // The last one may be pi/2, rounded.
        let outside = |theta: &&f32| !(0.0..=FRAC_PI_2).contains(*theta);
        if let Some(theta) = theta_i.iter().find(outside) {
            return Err(format!(
                "its field theta_i holds {theta}, and should hold radians from 0 to pi/2; get it again"
            ));
        }

        let (shape, ndf) = file.floats::<2>("ndf")?;
        let ndf = (grid("ndf", shape)?, densities("ndf", ndf)?);
        let (shape, sigma) = file.floats::<2>("sigma")?;
        let sigma = (grid("sigma", shape)?, sigma);
        if let Some(area) = sigma.1.iter().find(|area| **area <= 0.0) {
            return Err(format!(
                "its field sigma holds the area {area}, which should be positive; get it again"
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
                "its fields disagree: {phis} phi_i, {nodes} theta_i, but vndf is for \
                 [{vndf_phis}, {vndf_nodes}] and rgb for [{rgb_phis}, {rgb_nodes}] of them and \
                 {channels} channels; get it again"
            ));
        }
        // Of an isotropic material one phi_i says it all.
        let of_first_phi = |mut values: Vec<f32>| {
            values.truncate(values.len() / phis);
            values
        };
        Ok(Self {
            theta_i,
            ndf,
            sigma,
            vndf: Densities::new(vndf_grid, of_first_phi(vndf)),
            rgb: (rgb_grid, of_first_phi(rgb)),
        })
    }

    /// The BRDF.
    #[inline(always)]
    fn brdf<S: Angular>(&self, angles: Angles<S>) -> [S; 3] {
        let zero = S::constant(0.0);
        let at = HalfDifference::from_angles(angles);
        let (cos_i, cos_o) = (at.cos_theta_i(), at.cos_theta_o());
        // A NaN is below the horizon too.
        if !(cos_i.value() > 0.0 && cos_o.value() > 0.0) {
            return [zero; 3];
        }
        let [x, y, _] = at.directions().incoming;
        let theta_i = (x * x + y * y).sqrt().atan2(cos_i);
        // The half vector's azimuth is 0.
        let phi = -y.atan2(x);
        let half = [
            unit_theta(angles.theta_h),
            (phi + S::constant(PI)) * S::constant(1.0 / TAU),
        ];

        let between = Between::of(theta_i, &self.theta_i);
        let point = self.vndf.make_uniform(half, &between);
        let (grid, values) = &self.ndf;
        let normals = grid.evaluate(values, &Cell::of(half, *grid));
        let (grid, values) = &self.sigma;
        let area = grid.evaluate(values, &Cell::of([unit_theta(theta_i), zero], *grid));
        let factor = normals / (S::constant(4.0) * area * cos_o);

        let (grid, values) = &self.rgb;
        let cell = Cell::of(point, *grid);
        [0, 1, 2].map(|channel| {
            let measured = between.mix(|node| {
                let begin = (3 * node + channel) * grid.nodes();
                grid.evaluate(values.get(begin..).unwrap_or_default(), &cell)
            });
            (measured * factor).relu()
        })
    }
}

/// The values of a field of densities, of which none is less than 0. (Factors of `rgb` may be: that is
/// noise.)
fn densities(field: &str, values: Vec<f32>) -> Result<Vec<f32>, Complaint> {
    match values.iter().position(|value| *value < 0.0) {
        Some(index) => Err(format!(
            "number {index} of its field {field} is {}, and a density is 0 or more; get it again",
            values[index]
        )),
        None => Ok(values),
    }
}

/// The nodes of a field with so many rows and columns.
fn grid(field: &str, [rows, columns]: [usize; 2]) -> Result<TableShape, Complaint> {
    if rows < 2 || columns < 2 {
        return Err(format!(
            "its field {field} has {rows} rows and {columns} columns where there should be 2 or \
             more; get it again"
        ));
    }
    Ok(TableShape { columns, rows })
}
