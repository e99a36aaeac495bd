//! The interface of every BRDF: materials, fits and functions.

use glimpse_core::geometry::{Angles, HalfDifference};
pub use glimpse_kernels::brdf::BrdfWithDerivative;

use crate::NotFinite;
use crate::basis::{Reconstruction, angles_of};

/// A BRDF in linear RGB, sr^-1 (not times the cosine); NaN where it is unknown.
///
/// Each of [`Brdf::values_at`] and [`Brdf::at_angles`] has a default that calls the other one: implement at least one.
pub trait Brdf: Sync {
    /// Returns the BRDF at each pair of directions.
    fn values_at(&self, at: &[HalfDifference<f32>]) -> Vec<[f32; 3]> {
        at.iter().map(|at| self.at_angles(angles_of(at))).collect()
    }

    /// Returns the BRDF at angles in radians.
    ///
    /// The default converts the angles to a pair of directions. Materials use the angles instead: at theta_d = 0, the
    /// pair does not determine phi_d, and a table may hold a different value for each phi_d.
    fn at_angles(&self, angles: Angles<f32>) -> [f32; 3] {
        self.values_at(&[HalfDifference::from_angles(angles)])[0]
    }

    /// Returns [`Brdf::values_at`] as files have them, with 0 for negative values.
    ///
    /// # Errors
    /// If a value is not finite.
    fn written_values_at(&self, at: &[HalfDifference<f32>]) -> Result<Vec<[f32; 3]>, NotFinite> {
        let values = at.iter().zip(self.values_at(at));
        values
            .map(|(at, value)| NotFinite::check(angles_of(at), value))
            .collect()
    }
}

/// The shares of red, green and blue in the luminance of linear RGB (Rec. 709).
pub const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// Returns the luminance (Rec. 709) of linear RGB.
#[must_use]
pub fn luminance([r, g, b]: [f32; 3]) -> f32 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

impl<F: Fn(&HalfDifference<f32>) -> [f32; 3] + Sync + ?Sized> Brdf for F {
    fn values_at(&self, at: &[HalfDifference<f32>]) -> Vec<[f32; 3]> {
        at.iter().map(self).collect()
    }
}

impl Brdf for Reconstruction {
    fn values_at(&self, at: &[HalfDifference<f32>]) -> Vec<[f32; 3]> {
        let value = |at: &HalfDifference<f32>| {
            let weight = f64::from(at.cos_theta_i()) * f64::from(at.cos_theta_o());
            self.brdf(&angles_of(at), weight)
        };
        at.iter().map(value).collect()
    }
}

/// A BRDF to write as a table.
#[derive(Clone, Copy)]
pub struct Tabulation<'b> {
    /// The name of the material.
    pub name: &'b str,
    /// The BRDF in RGB.
    pub rgb: &'b dyn Brdf,
    /// The wavelengths of its bands in nm, in ascending order; empty if it has none.
    pub wavelengths: &'b [f32],
    /// A BRDF for each three bands.
    pub groups: &'b [&'b dyn Brdf],
}

impl<'b> Tabulation<'b> {
    /// Returns the table of a BRDF without bands.
    #[must_use]
    pub fn rgb(name: &'b str, rgb: &'b dyn Brdf) -> Self {
        Self {
            name,
            rgb,
            wavelengths: &[],
            groups: &[],
        }
    }

    /// Returns the BRDF of each group of bands, or that in RGB without bands.
    pub(crate) fn columns(&self) -> Vec<&'b dyn Brdf> {
        if self.wavelengths.is_empty() {
            return vec![self.rgb];
        }
        self.groups.to_vec()
    }
}
