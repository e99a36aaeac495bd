//! Loss of a fit at directions without readings, computed on the host in double precision.

use core::f64::consts::{FRAC_PI_2, PI};

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::loss::cosine_weighted_log_error;
use glimpse_core::model::{Model, ParameterSet};

use crate::Material;

/// Number of directions, some of them below the horizon.
const DIRECTIONS: u32 = 1024;

/// Returns the mean cosine-weighted logarithmic error of fitted parameters at evenly spread directions.
#[must_use]
pub fn loss<M: Model>(fitted: &[f32], material: &Material) -> f64 {
    let mut parameters = M::Parameters::<f64>::filled(0.0);
    for (parameter, value) in parameters.iter_mut().zip(fitted) {
        *parameter = f64::from(*value);
    }
    let (mut sum, mut count) = (0.0, 0.0);
    for angles in (0..DIRECTIONS).map(direction) {
        let at = HalfDifference::from_angles(angles);
        let cosine = at.cos_theta_i();
        if cosine <= 0.0 || at.cos_theta_o() <= 0.0 {
            continue;
        }
        let measured = material.measure(Angles {
            theta_h: angles.theta_h as f32,
            theta_d: angles.theta_d as f32,
            phi_d: angles.phi_d as f32,
        });
        let modeled = M::brdf::<f64>(&parameters, &at);
        let measured = measured.brdf.map(f64::from);
        let loss = cosine_weighted_log_error(measured, modeled, cosine, 1.0 / 3.0);
        sum += loss.error.value();
        count += 1.0;
    }
    sum / count
}

/// Returns one of the evenly spread directions. They are an additive recurrence whose steps are powers of 1 / x, where
/// x = 1.2207 solves x^4 = x + 1.
fn direction(index: u32) -> Angles<f64> {
    let coordinate = |step: f64| (0.5 + step * f64::from(index)) % 1.0;
    Angles {
        theta_h: FRAC_PI_2 * coordinate(0.819_172_513_396_164_4),
        theta_d: FRAC_PI_2 * coordinate(0.671_043_606_703_789_2),
        phi_d: PI * coordinate(0.549_700_477_901_970_3),
    }
}
