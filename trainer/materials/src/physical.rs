//! Two laws of physics that fitted BRDFs break: reciprocity, and the conservation of energy.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use glimpse_core::geometry::{Angles, Directions, HalfDifference};
use rayon::prelude::*;

use crate::Brdf;
use crate::loss::loss_directions;

/// The step of theta in tables of albedos, in degrees.
const STEP: f32 = 2.5;
/// The number of values of theta in tables of albedos, from 0 to 90 degrees.
const THETAS: usize = 37;
/// The number of these up to 85 degrees.
const REPORTED_THETAS: usize = 35;
/// Numbers of half vectors in the integral of an albedo: along theta_h and along phi_h.
const HALF_VECTORS: [usize; 2] = [96, 64];
/// The largest albedo of [`Physical`]. Below 1, because files interpolate.
const MAX_ALBEDO: f32 = 0.99;
/// The number of steps that balance the factors of all angles.
const BALANCING_STEPS: usize = 4;
/// Relative differences up to this are rounding errors.
const ROUNDING: f64 = 1e-4;

/// The distance of a BRDF from the laws of physics.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct PhysicalErrors {
    /// The mean change of the BRDF when light and sensor are exchanged, relative to the mean BRDF. Both are times both
    /// cosines, over the directions of the loss.
    pub reciprocity: f64,
    /// The largest directional albedo of any channel, for light at 0 to 85 degrees: the share of light that is reflected.
    pub albedo: f64,
}

impl PhysicalErrors {
    /// Computes the errors of a BRDF.
    #[must_use]
    pub fn of(brdf: &dyn Brdf) -> Self {
        let albedos = albedos(brdf).into_iter().take(REPORTED_THETAS).flatten();
        Self {
            reciprocity: reciprocity_error(brdf),
            albedo: f64::from(albedos.fold(0.0, f32::max)),
        }
    }
}

/// A BRDF that is changed to be reciprocal and to have an albedo of at most 1.
///
/// It is the mean of both orders of light and sensor, times a factor for theta_i and one for theta_o. The factors are at most
/// 1, and below it where the albedo would be above 0.99.
pub struct Physical<'m> {
    brdf: &'m dyn Brdf,
    is_mean: bool,
    /// The factor of each channel at each theta.
    factors: Vec<[f32; 3]>,
}

impl<'m> Physical<'m> {
    /// Returns a BRDF without changes.
    #[must_use]
    pub fn as_fitted(brdf: &'m dyn Brdf) -> Self {
        Self {
            brdf,
            is_mean: false,
            factors: vec![[1.0; 3]; THETAS],
        }
    }

    /// Changes a BRDF as far as necessary.
    #[must_use]
    pub fn of(brdf: &'m dyn Brdf) -> Self {
        let mut physical = Self::as_fitted(brdf);
        physical.is_mean = reciprocity_error(brdf) > ROUNDING;
        // A mirror has both factors at once, so that it needs the root.
        for _ in 0..BALANCING_STEPS {
            if !physical.scale(f32::sqrt) {
                return physical;
            }
        }
        // Factors are at most 1, so the albedo falls by these factors at least.
        physical.scale(|factor| factor);
        physical
    }

    /// Multiplies the factor of each theta by a function of the factor that its albedo lacks. Returns true if any was below 1.
    fn scale(&mut self, function: impl Fn(f32) -> f32) -> bool {
        let mut is_above = false;
        let albedos = albedos(&*self);
        for (factors, albedo) in self.factors.iter_mut().zip(albedos) {
            for (factor, albedo) in factors.iter_mut().zip(albedo) {
                is_above |= albedo > MAX_ALBEDO;
                *factor *= function((MAX_ALBEDO / albedo).min(1.0));
            }
        }
        is_above
    }

    /// Returns true if the BRDF differs from the unchanged one.
    #[must_use]
    pub fn is_changed(&self) -> bool {
        let mut factors = self.factors.iter().flatten();
        self.is_mean || factors.any(|factor| *factor < 1.0)
    }

    /// Returns the BRDF from those of both orders.
    fn combine(&self, at: &HalfDifference<f32>, [one, other]: [[f32; 3]; 2]) -> [f32; 3] {
        let [light, sensor] = [at.cos_theta_i(), at.cos_theta_o()].map(|cosine| {
            let position = cosine.clamp(0.0, 1.0).acos().to_degrees() / STEP;
            let (index, share) = (position as usize, position.fract());
            let [low, high] = [index, index + 1].map(|index| self.factors[index.min(THETAS - 1)]);
            [0, 1, 2].map(|channel| low[channel] + share * (high[channel] - low[channel]))
        });
        [0, 1, 2]
            .map(|channel| 0.5 * (one[channel] + other[channel]) * light[channel] * sensor[channel])
    }
}

impl Brdf for Physical<'_> {
    fn values_at(&self, at: &[HalfDifference<f32>]) -> Vec<[f32; 3]> {
        let mut values = self.brdf.values_at(at);
        let others = if self.is_mean {
            let exchanged: Vec<_> = at.iter().map(exchanged).collect();
            self.brdf.values_at(&exchanged)
        } else {
            values.clone()
        };
        for ((at, value), other) in at.iter().zip(&mut values).zip(others) {
            *value = self.combine(at, [*value, other]);
        }
        values
    }

    fn at_angles(&self, angles: Angles<f32>) -> [f32; 3] {
        let one = self.brdf.at_angles(angles);
        let other = if self.is_mean {
            let phi_d = angles.phi_d + PI;
            self.brdf.at_angles(Angles { phi_d, ..angles })
        } else {
            one
        };
        self.combine(&HalfDifference::from_angles(angles), [one, other])
    }
}

/// Returns the directions with light and sensor exchanged.
fn exchanged(at: &HalfDifference<f32>) -> HalfDifference<f32> {
    HalfDifference {
        dx: -at.dx,
        dy: -at.dy,
        ..*at
    }
}

/// Returns [`PhysicalErrors::reciprocity`].
fn reciprocity_error(brdf: &dyn Brdf) -> f64 {
    let at = loss_directions();
    let others: Vec<_> = at.iter().map(exchanged).collect();
    let [values, others] = [&at, &others].map(|at| brdf.values_at(at));
    let (mut changes, mut sum) = (0.0, 0.0);
    for ((at, one), other) in at.iter().zip(values).zip(others) {
        let weight = f64::from(at.cos_theta_i() * at.cos_theta_o());
        for (one, other) in one.into_iter().zip(other) {
            changes += weight * f64::from((one - other).abs());
            sum += weight * f64::from(one.abs());
        }
    }
    if sum > 0.0 { changes / sum } else { 0.0 }
}

/// Returns the directional albedo of each channel, for light at each theta of the table.
fn albedos(brdf: &dyn Brdf) -> Vec<[f32; 3]> {
    let thetas = (0..THETAS).into_par_iter();
    thetas
        .map(|index| directional_albedo(brdf, index as f32 * STEP))
        .collect()
}

/// Returns the share of light that is reflected, of light at a polar angle of 0 to 90 degrees, for each channel.
///
/// Integrates the BRDF times the sensor's cosine over half vectors, which are denser near the normal. The weights are scaled
/// so that the integral of the cosine is exact.
#[must_use]
pub fn directional_albedo(brdf: &dyn Brdf, theta_i_degrees: f32) -> [f32; 3] {
    // At 90 degrees the light does not reach the surface.
    let (sine, cosine) = theta_i_degrees.min(89.5).to_radians().sin_cos();
    let incoming = [sine, 0.0, cosine];
    let [rows, columns] = HALF_VECTORS;
    let (mut at, mut weights) = (Vec::new(), Vec::new());
    for row in 0..rows {
        let t = (row as f32 + 0.5) / rows as f32;
        let (sine, cosine) = (FRAC_PI_2 * t * t).sin_cos();
        for column in 0..columns {
            let (y, x) = (TAU * (column as f32 + 0.5) / columns as f32).sin_cos();
            let half = [sine * x, sine * y, cosine];
            let cos_theta_d = half[0] * incoming[0] + half[2] * incoming[2];
            let outgoing = [0, 1, 2].map(|axis| 2.0 * cos_theta_d * half[axis] - incoming[axis]);
            let pair = HalfDifference::from_directions(&Directions { incoming, outgoing });
            if let (Some(pair), true) = (pair, cos_theta_d > 0.0 && outgoing[2] > 0.0) {
                at.push(pair);
                weights.push(t * sine * cos_theta_d * outgoing[2]);
            }
        }
    }
    let mut sums = [0.0_f64; 3];
    for (brdf, weight) in brdf.values_at(&at).iter().zip(&weights) {
        for (sum, f) in sums.iter_mut().zip(brdf) {
            *sum += f64::from(f * weight);
        }
    }
    let total: f64 = weights.iter().copied().map(f64::from).sum();
    sums.map(|sum| (f64::from(PI) * sum / total) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::basis::angles_of;

    /// A mirror-like BRDF of albedo above 1, which depends on the order of light and sensor.
    fn unphysical(at: &HalfDifference<f32>) -> [f32; 3] {
        let angles = angles_of(at);
        let lobe = 40.0 * (-(angles.theta_h / 0.1).powi(2)).exp();
        [
            1.5 / PI,
            0.5 / PI + lobe,
            0.2 + 0.1 * angles.phi_d.cos() * angles.theta_d,
        ]
    }

    #[test]
    fn albedo_is_the_integral_of_brdf_times_cosine() {
        // An independent rule: uniform steps of theta_o and phi.
        for theta_i in [0.0_f32, 30.0, 60.0] {
            let (sine, cosine) = theta_i.to_radians().sin_cos();
            let mut sums = [0.0; 3];
            for index in 0..160_000 {
                let middle = |step: i32| (step as f32 + 0.5) / 400.0;
                let theta_o = FRAC_PI_2 * middle(index / 400);
                let (sin_phi, cos_phi) = (TAU * middle(index % 400)).sin_cos();
                let (sin_o, cos_o) = theta_o.sin_cos();
                let outgoing = [sin_o * cos_phi, sin_o * sin_phi, cos_o];
                let incoming = [sine, 0.0, cosine];
                let at = HalfDifference::from_directions(&Directions { incoming, outgoing });
                let brdf = at.map_or([0.0; 3], |at| unphysical(&at));
                let weight = cos_o * sin_o * TAU * FRAC_PI_2 / 160_000.0;
                for (sum, f) in sums.iter_mut().zip(brdf) {
                    *sum += f * weight;
                }
            }
            for (actual, expected) in directional_albedo(&unphysical, theta_i).iter().zip(sums) {
                assert!(
                    (actual / expected - 1.0).abs() < 0.01,
                    "{theta_i}: {actual}, {expected}"
                );
            }
        }
    }

    #[test]
    fn physical_brdf_is_reciprocal_and_conserves_energy() {
        let before = PhysicalErrors::of(&unphysical);
        assert!(
            before.reciprocity > 0.005 && before.albedo > 1.4,
            "{before:?}"
        );
        let physical = Physical::of(&unphysical);
        assert!(physical.is_changed());
        let after = PhysicalErrors::of(&physical);
        assert!(after.reciprocity < ROUNDING, "{after:?}");
        assert!((0.8..=0.991).contains(&after.albedo), "{after:?}");
    }

    #[test]
    fn physical_materials_do_not_change() {
        let materials = crate::Source("procedural:4".to_owned())
            .load()
            .expect("materials");
        for material in &materials {
            let physical = Physical::of(&**material);
            let errors = PhysicalErrors::of(&**material);
            assert_eq!(physical.is_changed(), errors.albedo > 0.99, "{errors:?}");
        }
    }
}
