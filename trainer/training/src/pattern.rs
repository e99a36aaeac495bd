//! The sample pattern as meta-parameters: logits of angles scaled to their range.
//!
//! theta_h = π/2 sigmoid(l_0), theta_d = π/2 sigmoid(l_1), phi_d = π sigmoid(l_2). A sample with a direction below the
//! horizon is invalid: the fit excludes it, and the objective adds the barrier 0.005 (theta_h² + theta_d²). The
//! gradient of the barrier moves the sample back above the horizon (paper, Eq. "barrier").

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::gonio::Limits;
use glimpse_core::model::SampleGradient;
use glimpse_kernels::Dual;
use glimpse_kernels::lanes::{Octet, OctetDirections, WIDTH};
use glimpse_materials::sampling::RANGE;

/// The weight of the barrier.
const BARRIER: f32 = 0.005;

/// Converts the three logits of a sample to angles at which light and sensor have the minimum separation of a
/// goniometer. The polar angles may exceed their limits.
#[must_use]
pub fn angles_within(logits: [f32; 3], limits: &Limits) -> Angles<f32> {
    let min = min_angles(limits);
    let [theta_h, theta_d, phi_d] =
        [0, 1, 2].map(|i| min[i] + (RANGE[i] - min[i]) / (1.0 + (-logits[i]).exp()));
    let phi_d = match limits.in_plane {
        false => phi_d,
        // The nearer one of the two angles in one plane with the normal.
        true if logits[2] > 0.0 => RANGE[2],
        true => 0.0,
    };
    Angles::from_array([theta_h, theta_d, phi_d])
}

/// Returns the minima of theta_h, theta_d and phi_d within limits. The separation of light and sensor is 2 theta_d.
fn min_angles(limits: &Limits) -> [f32; 3] {
    [0.0, 0.5 * limits.min_separation, 0.0]
}

/// Returns true if both directions are above the horizon and within the polar angle limits.
fn is_valid_within(direction: &HalfDifference<f32>, limits: &Limits) -> bool {
    direction.is_valid()
        && (*limits == Limits::NONE
            || (direction.cos_theta_i() >= limits.max_theta_i.cos()
                && direction.cos_theta_o() >= limits.max_theta_o.cos()))
}

/// Converts the angles of a sample to logits. Angles at a bound of their range are moved inside by 0.1 % of the range.
#[must_use]
pub fn logits_from_angles(angles: Angles<f32>) -> [f32; 3] {
    logits_from_reachable(angles, &Limits::NONE)
}

/// Converts angles within the limits of a goniometer to logits, like [`logits_from_angles`].
#[must_use]
pub fn logits_from_reachable(angles: Angles<f32>, limits: &Limits) -> [f32; 3] {
    let angles = angles.to_array();
    let min = min_angles(limits);
    [0, 1, 2].map(|i| {
        let share = (angles[i] - min[i]) / (RANGE[i] - min[i]);
        let share = share.clamp(1e-3, 1.0 - 1e-3);
        (share / (1.0 - share)).ln()
    })
}

/// Converts the logits of a pattern to angles that a scanner can measure at. Samples with a direction at or below the
/// horizon are moved towards theta_h = theta_d = 0.
#[must_use]
pub fn angles_above_horizon(logits: &[f32]) -> Vec<Angles<f32>> {
    reachable_angles(logits, &Limits::NONE)
}

/// Converts the logits of a pattern to angles within the limits of a goniometer. Samples out of reach are moved towards
/// theta_h = 0 and the minimum theta_d. The limits must allow the minimum separation at equal polar angles.
#[must_use]
pub fn reachable_angles(logits: &[f32], limits: &Limits) -> Vec<Angles<f32>> {
    const MIN_COSINE: f32 = 1e-3;
    let [_, min_theta_d, _] = min_angles(limits);
    let mut angles = Pattern::from_logits_within(logits, *limits)
        .angles()
        .to_vec();
    for angles in &mut angles {
        loop {
            let direction = HalfDifference::from_angles(*angles);
            let is_low = direction.cos_theta_i().min(direction.cos_theta_o()) <= MIN_COSINE;
            let is_minimal = angles.theta_h < 1e-6 && angles.theta_d <= min_theta_d;
            if (!is_low && is_valid_within(&direction, limits)) || is_minimal {
                break;
            }
            angles.theta_h *= 0.99;
            angles.theta_d = min_theta_d + 0.99 * (angles.theta_d - min_theta_d);
        }
    }
    angles
}

/// The directions that a pattern may have.
#[derive(Clone, Copy, Debug)]
pub struct Reach<'a> {
    /// The limits of the goniometer.
    pub limits: Limits,
    /// The directions of the first samples, which are not trained.
    pub fixed: &'a [Angles<f32>],
}

impl Reach<'_> {
    /// Creates a pattern from logits, for a step of training. Samples out of reach are invalid.
    #[must_use]
    pub fn pattern(&self, logits: &[f32]) -> Pattern {
        let pattern = Pattern::from_logits_within(logits, self.limits);
        self.with_fixed(pattern.angles)
    }

    /// Creates a pattern from logits. Samples out of reach are moved, as by [`reachable_angles`].
    #[must_use]
    pub fn reachable_pattern(&self, logits: &[f32]) -> Pattern {
        self.with_fixed(reachable_angles(logits, &self.limits))
    }

    fn with_fixed(&self, mut angles: Vec<Angles<f32>>) -> Pattern {
        for (angles, fixed) in angles.iter_mut().zip(self.fixed) {
            *angles = *fixed;
        }
        Pattern {
            fixed: self.fixed.len(),
            ..Pattern::with_limits(angles, self.limits)
        }
    }
}

/// A pattern with its directions.
pub struct Pattern {
    limits: Limits,
    /// The number of leading samples that are not trained.
    fixed: usize,
    angles: Vec<Angles<f32>>,
    valid: Vec<bool>,
    octet_directions: Vec<OctetDirections>,
}

impl Pattern {
    /// Creates a pattern from angles.
    #[must_use]
    pub fn new(angles: Vec<Angles<f32>>) -> Self {
        Self::with_limits(angles, Limits::NONE)
    }

    fn with_limits(angles: Vec<Angles<f32>>, limits: Limits) -> Self {
        let directions: Vec<_> = angles
            .iter()
            .copied()
            .map(HalfDifference::from_angles)
            .collect();
        let valid = directions.iter();
        Self {
            limits,
            fixed: 0,
            valid: valid.map(|each| is_valid_within(each, &limits)).collect(),
            octet_directions: directions.chunks(WIDTH).map(Octet::transpose).collect(),
            angles,
        }
    }

    /// Creates a pattern from logits, three per sample.
    #[must_use]
    pub fn from_logits(logits: &[f32]) -> Self {
        Self::from_logits_within(logits, Limits::NONE)
    }

    /// Creates a pattern from logits, within limits of a goniometer. Samples out of its reach are invalid.
    #[must_use]
    pub fn from_logits_within(logits: &[f32], limits: Limits) -> Self {
        let (logits, _) = logits.as_chunks();
        let angles = logits.iter().map(|logits| angles_within(*logits, &limits));
        Self::with_limits(angles.collect(), limits)
    }

    /// Returns the angles of all samples.
    #[must_use]
    pub fn angles(&self) -> &[Angles<f32>] {
        &self.angles
    }

    /// Returns the half and difference vectors of the samples, in octets.
    #[must_use]
    pub fn octet_directions(&self) -> &[OctetDirections] {
        &self.octet_directions
    }

    /// Returns the validity of each sample.
    #[must_use]
    pub fn valid(&self) -> &[bool] {
        &self.valid
    }

    /// Returns the sum of the barrier over invalid samples.
    #[must_use]
    pub fn barrier(&self) -> f32 {
        let invalid = self
            .angles
            .iter()
            .zip(&self.valid)
            .filter(|(_, valid)| !**valid);
        invalid
            .map(|(a, _)| BARRIER * (a.theta_h * a.theta_h + a.theta_d * a.theta_d))
            .sum()
    }

    /// Returns the gradient with respect to the logits, including the barrier. `by_angles` is called in order with the
    /// index of each valid sample, and returns the derivatives with respect to its angles.
    #[must_use]
    pub fn gradient_by_logits(&self, mut by_angles: impl FnMut(usize) -> [f32; 3]) -> Vec<f32> {
        let mut by_logits = Vec::with_capacity(3 * self.angles.len());
        for (index, angles) in self.angles.iter().enumerate() {
            let by_angles = if index < self.fixed {
                [0.0; 3]
            } else if self.valid[index] {
                by_angles(index)
            } else {
                let slope = 2.0 * BARRIER;
                [slope * angles.theta_h, slope * angles.theta_d, 0.0]
            };
            by_logits.extend(self.by_logits(index, by_angles));
        }
        by_logits
    }

    /// Converts derivatives with respect to the angles of a sample to derivatives with respect to its logits.
    #[must_use]
    pub fn by_logits(&self, index: usize, by_angles: [f32; 3]) -> [f32; 3] {
        let angles = self.angles[index];
        let angles = angles.to_array();
        let min = min_angles(&self.limits);
        std::array::from_fn(|i| {
            if i == 2 && self.limits.in_plane {
                return 0.0;
            }
            let offset = angles[i] - min[i];
            by_angles[i] * offset * (1.0 - offset / (RANGE[i] - min[i]))
        })
    }

    /// Converts the gradient with respect to the half and difference vectors of all samples to the gradient with
    /// respect to the angles of one sample.
    #[must_use]
    pub fn gradient_by_angles(&self, samples: &[SampleGradient<Octet>], index: usize) -> [f32; 3] {
        let lane = index % WIDTH;
        let by_direction = &samples[index / WIDTH].at;
        let direction = HalfDifference::from_angles(Dual::<f32, 3>::variables(self.angles[index]));
        std::array::from_fn(|i| {
            by_direction.hx.0[lane] * direction.hx.tangent[i]
                + by_direction.hz.0[lane] * direction.hz.tangent[i]
                + by_direction.dx.0[lane] * direction.dx.tangent[i]
                + by_direction.dy.0[lane] * direction.dy.tangent[i]
                + by_direction.dz.0[lane] * direction.dz.tangent[i]
        })
    }
}
