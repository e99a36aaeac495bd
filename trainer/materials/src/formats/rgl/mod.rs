//! RGL: an isotropic material of the RGL material database, in the adaptive parameterization of the measurement (Dupuy
//! and Jakob 2018, "An Adaptive Parameterization for Efficient Material Acquisition and Modeling").
//!
//! A tensor file `NAME_rgb.bsdf` holds functions on unit squares, bilinear between nodes. The angles of a direction are
//! mapped to \[0, 1\] by u(theta) = sqrt(2 theta / pi) and v(phi) = (phi + pi) / (2 pi). theta_m is the polar angle of
//! the half vector, and phi is its azimuth relative to the incoming direction. The fields are:
//!
//! - `ndf`: D(u(theta_m), v(phi)), the distribution of microfacet normals, measured in retro-reflection;
//! - `sigma`: the projected area of these microfacets towards theta_i;
//! - `vndf`: the density of visible normals at each node of `theta_i`. Its cumulative distribution maps
//!   (u(theta_m), v(phi)) to a point s of the unit square. An even grid of s is dense where the material reflects most;
//! - `rgb`: the measured factor M(s) at each node of `theta_i`, for each channel;
//! - `spectra` instead of `rgb`, in `NAME_spec.bsdf`: the same for each of some `wavelengths` in nm. They become RGB by the
//!   CIE 1931 observer under D65.
//!
//! BRDF times cos(theta_o) = M(s) D / (4 sigma), clamped to at least 0, because interpolated measurements may be
//! negative. The resulting BRDF is not reciprocal.

mod distribution;
mod sample_point;
mod tensor_file;
#[cfg(test)]
mod tests;
mod write;

pub(super) use write::to_rgl;

use std::f32::consts::FRAC_PI_2;
use std::f64::consts::{PI, TAU};
use std::path::Path;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_kernels::AngleDual;

use self::distribution::{Densities, TableShape};
use self::sample_point::unit_theta;
use self::tensor_file::{FINITE, NOT_NEGATIVE, TensorFile, UNSIGNED_8, check_values};
use glimpse_kernels::dual::RealScalar;

use crate::basis::{finite_f32, split_duals};
use crate::error::{Defect, ensure, map_file};
use crate::interpolation::Position;
use crate::spectrum::{Viewing, have_color};
use crate::{Brdf, BrdfWithDerivative, Coverage, Material, Omission, SourceError};

/// A material from a measurement of the RGL database.
///
/// The BRDF is 0 below the horizon. Above, it is interpolated between the measured directions, with the exact
/// derivatives of the interpolant. theta_i is clamped to the largest measured value. The stored values are the BRDF
/// times cos(theta_o). The BRDF without the cosine is unbounded as theta_o approaches pi/2.
pub(crate) struct RglMeasurement {
    name: String,
    tensors: Tensors,
    pub(super) coverage: Coverage,
    pub(super) omissions: Vec<Omission>,
}

impl RglMeasurement {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// If the file cannot be read, is damaged, holds a number that is not finite, or is an anisotropic measurement.
    pub(crate) fn read(path: &Path, name: String) -> Result<Self, SourceError> {
        // A map reads only the pages that are used, and spectral files are large.
        Self::parse(name, &map_file(path)?).map_err(Defect::in_file(path))
    }

    /// Parses the bytes of a file.
    pub(super) fn parse(name: String, bytes: &[u8]) -> Result<Self, Defect> {
        let tensors = Tensors::parse(bytes)?;
        Ok(Self {
            name,
            coverage: Coverage::Complete,
            omissions: Vec::from_iter(tensors.omission),
            tensors,
        })
    }
}

/// Returns true if the first bytes of a file are those of a tensor file in RGB.
pub(super) fn has_rgb(head: &[u8]) -> bool {
    head.starts_with(tensor_file::MAGIC) && !has_spectra(head)
}

/// Returns true if the first bytes of a file, with the names of its fields, are those of a spectral file.
pub(super) fn has_spectra(head: &[u8]) -> bool {
    let has = |name: &[u8]| head.windows(name.len()).any(|bytes| bytes == name);
    // Names follow their lengths.
    head.starts_with(tensor_file::MAGIC) && has(b"\x07\0spectra") && !has(b"\x03\0rgb")
}

impl Brdf for RglMeasurement {
    fn at_angles(&self, angles: Angles<f32>) -> [f32; 3] {
        self.tensors.brdf(angles.map(f64::from)).map(finite_f32)
    }
}

impl Material for RglMeasurement {
    fn name(&self) -> &str {
        &self.name
    }

    fn with_derivatives(&self, angles: &[Angles<f32>]) -> Vec<BrdfWithDerivative> {
        let variables = |angles: &Angles<f32>| AngleDual::variables(angles.map(f64::from));
        let duals = angles
            .iter()
            .map(|angles| self.tensors.brdf(variables(angles)));
        duals.map(split_duals).collect()
    }

    fn coverage(&self) -> Coverage {
        self.coverage.clone()
    }

    fn omissions(&self) -> Vec<Omission> {
        self.omissions.clone()
    }
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
    /// That of the color of a spectrum without one.
    omission: Option<Omission>,
}

impl Tensors {
    fn parse(bytes: &[u8]) -> Result<Self, Defect> {
        let file = TensorFile::parse(bytes)?;
        if file.has("M") && file.has("wvls") {
            return Err(Defect::unsupported(
                "it is a polarized measurement (Mueller matrices, its field M), and is not supported",
            ));
        }
        let ([phi_count], _) = file.floats("phi_i", FINITE)?;
        // The two values of phi_i of an isotropic material are -pi and pi.
        if !(1..=2).contains(&phi_count) {
            return Err(Defect::unsupported(format!(
                "it is an anisotropic measurement, with {phi_count} values of phi_i, and only isotropic materials (1 or 2 \
                 values) are supported"
            )));
        }
        let ([count], jacobian) = file.values("jacobian", UNSIGNED_8)?;
        ensure!(
            jacobian == [1],
            "its field jacobian has {count} values, and must be [1]"
        );
        // The largest valid theta_i is pi/2, rounded to f32.
        let is_inside = |theta| (0.0..=FRAC_PI_2).contains(&theta);
        let ([theta_count], theta_i) = file.floats("theta_i", ("from 0 to pi/2", is_inside))?;
        ensure!(
            theta_count > 0 && theta_i.is_sorted_by(|a, b| a < b),
            "its field theta_i does not increase"
        );
        let (shape, ndf) = file.floats("ndf", NOT_NEGATIVE)?;
        let ndf = (table_shape("ndf", shape)?, ndf);
        let (shape, sigma) = file.floats("sigma", ("above 0", |value| value > 0.0))?;
        let sigma = (table_shape("sigma", shape)?, sigma);

        // The field `rgb` may have negative values, because of noise.
        let ([vndf_phi_count, vndf_theta_count, rows, columns], vndf) =
            file.floats("vndf", NOT_NEGATIVE)?;
        let vndf_shape = table_shape("vndf", [rows, columns])?;
        let is_spectral = !file.has("rgb") && file.has("spectra");
        let ([rgb_phi_count, rgb_theta_count, channels, rows, columns], rgb, omission) =
            match is_spectral {
                true => rgb_from_spectra(&file, [phi_count, theta_count])?,
                false => file
                    .floats("rgb", FINITE)
                    .map(|(shape, rgb)| (shape, rgb, None))?,
            };
        let rgb_shape = table_shape("rgb", [rows, columns])?;
        ensure!(
            [vndf_phi_count, vndf_theta_count] == [phi_count, theta_count]
                && [rgb_phi_count, rgb_theta_count, channels] == [phi_count, theta_count, 3],
            "it has {phi_count} values of phi_i and {theta_count} of theta_i, but these counts are [{vndf_phi_count}, \
             {vndf_theta_count}] in its field vndf, and [{rgb_phi_count}, {rgb_theta_count}] with {channels} channels \
             in rgb"
        );
        // An isotropic material has equal slices for all values of phi_i.
        let slices_of_first_phi = |mut values: Vec<f32>| {
            values.truncate(values.len() / phi_count);
            values
        };
        Ok(Self {
            theta_i,
            ndf,
            sigma,
            vndf: Densities::new(vndf_shape, slices_of_first_phi(vndf)),
            rgb: (rgb_shape, slices_of_first_phi(rgb)),
            omission,
        })
    }

    /// Returns the BRDF, not times the cosine, at angles in radians.
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
        let half_point = [
            unit_theta(angles.theta_h),
            (phi + S::constant(PI)) * S::constant(1.0 / TAU),
        ];

        let position = Position::new(theta_i, &self.theta_i);
        let point = self.vndf.map_to_uniform(half_point, &position);
        let (shape, values) = &self.ndf;
        let normals = shape.at(values, half_point);
        let (shape, values) = &self.sigma;
        let area = shape.at(values, [unit_theta(theta_i), zero]);
        let factor = normals / (S::constant(4.0) * area * cos_o);

        let (shape, values) = &self.rgb;
        let cell = shape.cell(point);
        [0, 1, 2].map(|channel| {
            let measured = position.mix(|node| {
                let start = (3 * node + channel) * shape.nodes();
                shape.evaluate(values.get(start..).unwrap_or_default(), &cell)
            });
            (measured * factor).relu()
        })
    }
}

/// The shape of `rgb`: values of phi_i and theta_i, channels, rows and columns; its values; and the omission of its color.
type RgbField = ([usize; 5], Vec<f32>, Option<Omission>);

/// Converts the field `spectra` to `rgb`. `counts` are the numbers of phi_i and theta_i.
fn rgb_from_spectra(file: &TensorFile<'_>, counts: [usize; 2]) -> Result<RgbField, String> {
    // Wavelengths in um are below.
    let ([wavelength_count], wavelengths) =
        file.floats("wavelengths", ("above 10 nm", |nm| nm > 10.0))?;
    ensure!(
        wavelength_count > 0 && wavelengths.is_sorted_by(|a, b| a < b),
        "its field wavelengths must hold increasing values"
    );
    let ([phi_count, theta_count, count, rows, columns], words) = file.float_words("spectra")?;
    let shape = table_shape("spectra", [rows, columns])?;
    let expected = [counts[0], counts[1], wavelength_count];
    ensure!(
        [phi_count, theta_count, count] == expected && !words.is_empty(),
        "it has {expected:?} values of phi_i, theta_i and wavelengths, but its field spectra has \
         [{phi_count}, {theta_count}, {count}]"
    );
    let weights = Viewing::default().rgb_weights(&wavelengths);
    let nodes = shape.nodes();
    let mut rgb = Vec::with_capacity(3 * phi_count * theta_count * nodes);
    // The values at one direction of the light: a table for each wavelength. Their number fits into the file.
    for slice in words.chunks(wavelength_count * nodes) {
        let mut sums = vec![0.0_f64; 3 * nodes];
        for (plane, weight) in slice.chunks(nodes).zip(&weights) {
            for (node, word) in plane.iter().enumerate() {
                let value = f64::from(f32::from_le_bytes(*word));
                for (channel, weight) in weight.iter().enumerate() {
                    sums[channel * nodes + node] += weight * value;
                }
            }
        }
        rgb.extend(sums.into_iter().map(|sum| sum as f32));
    }
    let shape = [phi_count, theta_count, 3, rows, columns];
    check_values("spectra (as RGB)", &shape, &rgb, FINITE)?;
    let omission = (!have_color(&wavelengths)).then_some(Omission::Color);
    Ok((shape, rgb, omission))
}

/// Returns the shape of a field's table if it has at least 2 rows and 2 columns.
fn table_shape(field: &str, [rows, columns]: [usize; 2]) -> Result<TableShape, String> {
    ensure!(
        rows >= 2 && columns >= 2,
        "its field {field} has {rows} rows and {columns} columns, and must have at least 2 of each"
    );
    Ok(TableShape { columns, rows })
}
