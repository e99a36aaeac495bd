//! Types and conversions of the model Linear in f64.

use glimpse_core::geometry::Angles;
use glimpse_kernels::Dual;

/// A number and its derivatives with respect to theta_h, theta_d and phi_d.
pub type AngleDual = Dual<f64, 3>;

/// The coefficients of each channel, one for each component.
pub type Coefficients = [Vec<f64>; 3];

/// Converts angles to f64.
#[must_use]
pub fn angles_to_f64(angles: &Angles<f32>) -> Angles<f64> {
    Angles {
        theta_h: f64::from(angles.theta_h),
        theta_d: f64::from(angles.theta_d),
        phi_d: f64::from(angles.phi_d),
    }
}
