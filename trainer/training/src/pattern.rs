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
use glimpse_materials::half_differences;
use glimpse_materials::sampling::RANGE;

/// The weight of the barrier.
const BARRIER: f32 = 0.005;

/// Returns the minima of theta_h, theta_d and phi_d within limits. The separation of light and sensor is 2 theta_d.
fn min_angles(limits: &Limits) -> [f32; 3] {
    [0.0, 0.5 * limits.min_separation, 0.0]
}

/// The directions that a pattern may have.
#[derive(Clone, Copy, Debug)]
pub struct Reach<'a> {
    /// The limits of the goniometer. They must allow the minimum separation at equal polar angles.
    pub limits: Limits,
    /// The directions of the first samples, which are not trained.
    pub fixed: &'a [Angles<f32>],
}

impl Reach<'_> {
    /// All directions.
    pub const ANY: Self = Self {
        limits: Limits::NONE,
        fixed: &[],
    };

    /// Converts the three logits of a sample to angles at which light and sensor have the minimum separation. The polar
    /// angles may exceed their limits.
    #[must_use]
    pub fn angles(&self, logits: [f32; 3]) -> Angles<f32> {
        let min = min_angles(&self.limits);
        let mut angles =
            [0, 1, 2].map(|i| min[i] + (RANGE[i] - min[i]) / (1.0 + (-logits[i]).exp()));
        if self.limits.in_plane {
            // The nearer one of the two angles in one plane with the normal.
            angles[2] = if logits[2] > 0.0 { RANGE[2] } else { 0.0 };
        }
        Angles::from_array(angles)
    }

    /// Converts the angles of a sample to logits. Angles at a bound of their range are moved inside by 0.1 % of the range.
    #[must_use]
    pub fn logits(&self, angles: Angles<f32>) -> [f32; 3] {
        let angles = angles.to_array();
        let min = min_angles(&self.limits);
        [0, 1, 2].map(|i| {
            let share = (angles[i] - min[i]) / (RANGE[i] - min[i]);
            let share = share.clamp(1e-3, 1.0 - 1e-3);
            (share / (1.0 - share)).ln()
        })
    }

    /// Returns true if both directions are above the horizon and within the polar angle limits.
    fn is_valid(&self, direction: &HalfDifference<f32>) -> bool {
        let limits = &self.limits;
        direction.is_valid()
            && (*limits == Limits::NONE
                || (direction.cos_theta_i() >= limits.max_theta_i.cos()
                    && direction.cos_theta_o() >= limits.max_theta_o.cos()))
    }

    /// Converts the logits of a pattern to angles. Samples may be out of reach.
    fn all_angles(&self, logits: &[f32]) -> Vec<Angles<f32>> {
        let (logits, _) = logits.as_chunks();
        let mut all: Vec<_> = logits.iter().map(|logits| self.angles(*logits)).collect();
        for (angles, fixed) in all.iter_mut().zip(self.fixed) {
            *angles = *fixed;
        }
        all
    }

    /// Converts the logits of a pattern to angles that a scanner can measure at. Samples out of reach are moved towards
    /// theta_h = 0 and the minimum theta_d, except fixed ones.
    #[must_use]
    pub fn reachable_angles(&self, logits: &[f32]) -> Vec<Angles<f32>> {
        const MIN_COSINE: f32 = 1e-3;
        let [_, min_theta_d, _] = min_angles(&self.limits);
        let mut all = self.all_angles(logits);
        for angles in all.iter_mut().skip(self.fixed.len()) {
            loop {
                let direction = HalfDifference::from_angles(*angles);
                let is_low = direction.cos_theta_i().min(direction.cos_theta_o()) <= MIN_COSINE;
                let is_minimal = angles.theta_h < 1e-6 && angles.theta_d <= min_theta_d;
                if (!is_low && self.is_valid(&direction)) || is_minimal {
                    break;
                }
                angles.theta_h *= 0.99;
                angles.theta_d = min_theta_d + 0.99 * (angles.theta_d - min_theta_d);
            }
        }
        all
    }

    /// Creates a pattern from logits, for a step of training. Samples out of reach are invalid.
    #[must_use]
    pub fn pattern(&self, logits: &[f32]) -> SamplePattern {
        SamplePattern::new(self, self.all_angles(logits))
    }

    /// Creates a pattern of [`reachable_angles`](Self::reachable_angles).
    #[must_use]
    pub fn reachable_pattern(&self, logits: &[f32]) -> SamplePattern {
        SamplePattern::new(self, self.reachable_angles(logits))
    }
}

/// A pattern with its directions.
pub struct SamplePattern {
    /// The angles of all samples.
    pub angles: Vec<Angles<f32>>,
    /// True for each sample within reach.
    pub valid: Vec<bool>,
    /// The half and difference vectors of the samples, in octets.
    pub octet_directions: Vec<OctetDirections>,
    limits: Limits,
    /// The number of leading samples that are not trained.
    fixed: usize,
}

impl SamplePattern {
    /// Creates a pattern from angles. Samples out of reach are invalid.
    #[must_use]
    pub fn new(reach: &Reach<'_>, angles: Vec<Angles<f32>>) -> Self {
        let directions = half_differences(&angles);
        Self {
            valid: directions.iter().map(|at| reach.is_valid(at)).collect(),
            octet_directions: directions.chunks(WIDTH).map(Octet::transpose).collect(),
            angles,
            limits: reach.limits,
            fixed: reach.fixed.len(),
        }
    }

    /// Returns the sum of the barrier over invalid samples.
    #[must_use]
    pub fn barrier(&self) -> f32 {
        let samples = self.angles.iter().zip(&self.valid);
        let invalid = samples.filter(|(_, valid)| !**valid);
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
        let angles = self.angles[index].to_array();
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
        let by_direction = samples[index / WIDTH].at.to_array();
        let direction = HalfDifference::from_angles(Dual::<f32, 3>::variables(self.angles[index]));
        let direction = direction.to_array();
        std::array::from_fn(|i| {
            let pairs = by_direction.iter().zip(&direction);
            pairs.map(|(by, at)| by.0[lane] * at.tangent[i]).sum()
        })
    }
}
