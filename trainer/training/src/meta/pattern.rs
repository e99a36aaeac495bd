//! The sample pattern as meta-parameters: logits of coordinates scaled to their range.
//!
//! theta_h = pi/2 sigmoid(l_0), theta_d = pi/2 sigmoid(l_1), phi_d = pi sigmoid(l_2). A sample
//! with a direction below the horizon is left out of the fit and pays the barrier
//! 0.005 (theta_h^2 + theta_d^2), which pulls it back (paper, Eq. "barrier").

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::gonio::Limits;
use glimpse_core::model::SampleGradient;
use glimpse_kernels::Dual;
use glimpse_kernels::lanes::{InstructionSet, Octet, OctetAt, WIDTH};
use glimpse_kernels::samples::{OctetRgb, transpose_rgb};
use glimpse_kernels::samples::{SampleOctets, SampleWeights};
use glimpse_materials::Material;
use glimpse_materials::sampling::RANGE;

use super::augmentation::Augmentation;

/// The barrier's weight.
const BARRIER: f32 = 0.005;

/// Angles of a sample's three logits.
#[must_use]
pub fn angles_of(logits: [f32; 3]) -> Angles<f32> {
    angles_within(logits, &Limits::NONE)
}

/// The same within limits of a machine: light and sensor are at least as far apart as they have to be.
/// (Whether its arms get there is another question.)
fn angles_within(logits: [f32; 3], limits: &Limits) -> Angles<f32> {
    let least = least_of(limits);
    let [theta_h, theta_d, phi_d] =
        [0, 1, 2].map(|i| least[i] + (RANGE[i] - least[i]) / (1.0 + (-logits[i]).exp()));
    Angles {
        theta_h,
        theta_d,
        phi_d,
    }
}

/// The least angles within limits: light and sensor are twice theta_d apart.
fn least_of(limits: &Limits) -> [f32; 3] {
    [0.0, 0.5 * limits.min_separation, 0.0]
}

/// Whether both directions are above the horizon, and where the arms get to.
fn is_within(at: &HalfDifference<f32>, limits: &Limits) -> bool {
    at.is_valid()
        && (*limits == Limits::NONE
            || (at.cos_theta_i() >= limits.max_theta_i.cos()
                && at.cos_theta_o() >= limits.max_theta_o.cos()))
}

/// Logits of a sample's angles. Angles at an end of their range come out a little inside.
#[must_use]
pub fn logits_of(angles: Angles<f32>) -> [f32; 3] {
    let angles = [angles.theta_h, angles.theta_d, angles.phi_d];
    [0, 1, 2].map(|i| {
        let share = (angles[i] / RANGE[i]).clamp(1e-3, 1.0 - 1e-3);
        (share / (1.0 - share)).ln()
    })
}

/// The pattern's angles, pulled towards the pole where a direction is below the horizon or grazes
/// it: a scanner cannot measure there.
#[must_use]
pub fn above_horizon(logits: &[f32]) -> Vec<Angles<f32>> {
    reachable(logits, &Limits::NONE)
}

/// The pattern's angles within limits of a machine, pulled towards the pole where its arms do not get
/// to a direction. Light and sensor must be able to be as far apart as they have to be at equal polar
/// angles.
#[must_use]
pub fn reachable(logits: &[f32], limits: &Limits) -> Vec<Angles<f32>> {
    const LEAST_COSINE: f32 = 1e-3;
    let [_, least, _] = least_of(limits);
    let mut angles = Pattern::within(logits, *limits).angles().to_vec();
    for angles in &mut angles {
        loop {
            let at = HalfDifference::from_angles(*angles);
            let low = at.cos_theta_i().min(at.cos_theta_o()) <= LEAST_COSINE;
            let at_least = angles.theta_h < 1e-6 && angles.theta_d <= least;
            if (!low && is_within(&at, limits)) || at_least {
                break;
            }
            angles.theta_h *= 0.99;
            angles.theta_d = least + 0.99 * (angles.theta_d - least);
        }
    }
    angles
}

/// A pattern, ready to be measured on any material.
pub struct Pattern {
    limits: Limits,
    angles: Vec<Angles<f32>>,
    places: Vec<HalfDifference<f32>>,
    valid: Vec<bool>,
    at: Vec<OctetAt>,
    weights: Vec<Octet>,
}

/// A pattern measured on one material.
pub struct MeasuredPattern<'p> {
    pattern: &'p Pattern,
    values: Vec<OctetRgb>,
}

impl Pattern {
    /// From angles.
    #[must_use]
    pub fn new(angles: Vec<Angles<f32>>) -> Self {
        Self::of(angles, Limits::NONE)
    }

    fn of(angles: Vec<Angles<f32>>, limits: Limits) -> Self {
        let places: Vec<_> = angles
            .iter()
            .copied()
            .map(HalfDifference::from_angles)
            .collect();
        let valid: Vec<bool> = places.iter().map(|at| is_within(at, &limits)).collect();
        let counted = valid.iter().filter(|valid| **valid).count().max(1);
        let weight = 1.0 / (3.0 * counted as f32);
        let mut weights = vec![Octet::default(); angles.len().div_ceil(WIDTH)];
        for (index, valid) in valid.iter().enumerate() {
            if *valid {
                weights[index / WIDTH].0[index % WIDTH] = weight;
            }
        }
        Self {
            limits,
            at: places.chunks(WIDTH).map(Octet::transpose).collect(),
            places,
            angles,
            valid,
            weights,
        }
    }

    /// From logits, three for each sample.
    #[must_use]
    pub fn from_logits(logits: &[f32]) -> Self {
        Self::within(logits, Limits::NONE)
    }

    /// From logits, within limits of a machine: samples that its arms do not get to are not valid.
    #[must_use]
    pub fn within(logits: &[f32], limits: Limits) -> Self {
        let (logits, _) = logits.as_chunks();
        let angles = logits.iter().map(|logits| angles_within(*logits, &limits));
        Self::of(angles.collect(), limits)
    }

    /// The angles.
    #[must_use]
    pub fn angles(&self) -> &[Angles<f32>] {
        &self.angles
    }

    /// Half and difference vectors of the samples, eight by eight.
    #[must_use]
    pub fn octets_at(&self) -> &[OctetAt] {
        &self.at
    }

    /// Which samples are valid.
    #[must_use]
    pub fn valid(&self) -> &[bool] {
        &self.valid
    }

    /// What invalid samples pay.
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

    /// The angles of the samples that are valid.
    pub fn valid_angles(&self) -> impl Iterator<Item = Angles<f32>> {
        let all = self.angles.iter().zip(&self.valid);
        all.filter(|(_, valid)| **valid).map(|(angles, _)| *angles)
    }

    /// From derivatives by the angles of each valid sample, asked for by its index and in order, to the
    /// gradient by the logits, the barrier's included.
    #[must_use]
    pub fn gradient_by_logits(&self, mut by_angles: impl FnMut(usize) -> [f32; 3]) -> Vec<f32> {
        let mut by_logits = Vec::with_capacity(3 * self.angles.len());
        for (index, angles) in self.angles.iter().enumerate() {
            let by_angles = if self.valid[index] {
                by_angles(index)
            } else {
                let slope = 2.0 * BARRIER;
                [slope * angles.theta_h, slope * angles.theta_d, 0.0]
            };
            let angles = [angles.theta_h, angles.theta_d, angles.phi_d];
            let ranges = least_of(&self.limits).into_iter().zip(RANGE);
            for ((by_angle, angle), (least, most)) in by_angles.iter().zip(angles).zip(ranges) {
                let above = angle - least;
                by_logits.push(by_angle * above * (1.0 - above / (most - least)));
            }
        }
        by_logits
    }

    /// From the gradient by samples' coordinates to the one by the angles of one of them.
    #[must_use]
    pub fn by_angles(&self, samples: &[SampleGradient<Octet>], index: usize) -> [f32; 3] {
        let lane = index % WIDTH;
        let by = &samples[index / WIDTH].at;
        let at = HalfDifference::from_angles(Dual::<f32, 3>::variables(self.angles[index]));
        std::array::from_fn(|i| {
            by.hx.0[lane] * at.hx.tangent[i]
                + by.hz.0[lane] * at.hz.tangent[i]
                + by.dx.0[lane] * at.dx.tangent[i]
                + by.dy.0[lane] * at.dy.tangent[i]
                + by.dz.0[lane] * at.dz.tangent[i]
        })
    }

    /// Measures a material at the pattern.
    #[must_use]
    pub fn measure(&self, material: &dyn Material) -> MeasuredPattern<'_> {
        self.measured(&self.values(material))
    }

    /// Measures a augmentation of a material with a partner.
    #[must_use]
    pub fn measure_varied(
        &self,
        material: &dyn Material,
        partner: &dyn Material,
        augmentation: &Augmentation,
    ) -> MeasuredPattern<'_> {
        let mut values = self.values(material);
        for (value, partner) in values.iter_mut().zip(self.values(partner)) {
            *value = augmentation.brdf(*value, partner);
        }
        self.measured(&values)
    }

    /// The BRDF of a material at all places, 0 at those that are not valid.
    fn values(&self, material: &dyn Material) -> Vec<[f32; 3]> {
        let mut values = vec![[0.0; 3]; self.places.len()];
        material.brdf_batch(&self.places, &mut values);
        for (value, valid) in values.iter_mut().zip(&self.valid) {
            if !valid {
                *value = [0.0; 3];
            }
        }
        values
    }

    fn measured(&self, values: &[[f32; 3]]) -> MeasuredPattern<'_> {
        MeasuredPattern {
            pattern: self,
            values: values.chunks(WIDTH).map(transpose_rgb).collect(),
        }
    }
}

impl MeasuredPattern<'_> {
    /// The samples, as kernels read them.
    #[must_use]
    pub fn octets(&self) -> SampleOctets<'_> {
        SampleOctets {
            at: &self.pattern.at,
            values: &self.values,
            order: None,
            weights: SampleWeights::Each(&self.pattern.weights),
            instruction_set: InstructionSet::of_this_machine(),
            in_a_row: false,
        }
    }

    /// From the gradient by samples' coordinates to the one by the pattern's logits, the
    /// barrier's included.
    ///
    /// A place changes the measured value too, but the log loss of a fit knows of that value only
    /// on which side of the model's it is: its slope is 0, and plays no part here.
    #[must_use]
    pub fn gradient_by_logits(&self, samples: &[SampleGradient<Octet>]) -> Vec<f32> {
        self.pattern
            .gradient_by_logits(|index| self.pattern.by_angles(samples, index))
    }
}
