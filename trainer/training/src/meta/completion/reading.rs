//! What a pattern reads of a task, and how that enters a completion.

use glimpse_core::fit::coefficient_net::standardized;
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::EPSILON;
use glimpse_core::numeric::Scalar;
use glimpse_kernels::Dual;
use glimpse_kernels::lanes::{InstructionSet, Octet, WIDTH};
use glimpse_kernels::samples::{OctetRgb, SampleOctets, SampleWeights, transpose_rgb};
use glimpse_materials::basis::{Basis, widened};
use glimpse_materials::{Material, quantized};

use super::draw::{AugmentationOptions, Task};
use super::field::field_at;
use super::highlight_warp::HighlightWarp;
use crate::meta::pattern::Pattern;

/// What logarithms of readings are multiplied by, once centered.
pub const SCALE: f32 = 0.5;

/// A number with its derivatives by the three angles of its sample.
type ByAngles = Dual<f32, 3>;

/// What each sample's readings are weighed and centered by.
pub struct ReadingCenters(Vec<Center>);

#[derive(Clone, Copy)]
struct Center {
    /// cos(theta_i) cos(theta_o).
    cosines: ByAngles,
    cos_theta_i: f32,
    /// The mean of the basis's columns, as ln((f w + e) / e).
    mean: ByAngles,
}

impl ReadingCenters {
    /// Those of a pattern's samples.
    #[must_use]
    pub fn new(basis: &Basis, angles: &[Angles<f32>]) -> Self {
        let all = angles.iter().map(|angles| {
            let at = HalfDifference::from_angles(ByAngles::variables(*angles));
            let [mean, by @ ..] = basis.look_up(widened(angles)).center();
            Center {
                cosines: at.cos_theta_i() * at.cos_theta_o(),
                cos_theta_i: at.cos_theta_i().value,
                mean: Dual {
                    value: mean as f32,
                    tangent: by.map(|by| by as f32),
                },
            }
        });
        Self(all.collect())
    }

    /// The means alone.
    #[must_use]
    pub fn means(&self) -> Vec<f32> {
        self.0.iter().map(|center| center.mean.value).collect()
    }
}

/// What one sample reads.
pub struct Reading {
    /// The BRDF, sr^-1, noise included.
    pub brdf: [f32; 3],
    /// As it enters a completion, with derivatives by the sample's angles.
    pub standardized: [ByAngles; 3],
}

impl Reading {
    /// What each sample reads of a task.
    #[must_use]
    pub fn all(
        task: &Task,
        materials: &[Box<dyn Material>],
        variety: &AugmentationOptions,
        angles: &[Angles<f32>],
        centers: &ReadingCenters,
    ) -> Vec<Self> {
        let warps = &variety.warps;
        let own = warped(&*materials[task.material], warps[task.warps[0]], angles);
        let partner = (!task.is_alone())
            .then(|| warped(&*materials[task.partner], warps[task.warps[1]], angles));
        let all = own.iter().enumerate().map(|(sample, own)| {
            let partner = partner.as_ref().map(|list| &list[sample]);
            let factor = factor(task, angles[sample]);
            let Center {
                cosines,
                cos_theta_i,
                mean,
            } = centers.0[sample];
            let mut brdf = [0.0; 3];
            let standardized = std::array::from_fn(|channel| {
                let mut y = mixed(task, channel, own, partner) * factor;
                if let Some([factor, added]) = task.noise.get(sample) {
                    y = y * Dual::from_value(factor[channel]) + Dual::from_value(added[channel]);
                    // A fit brings up what is too far below 0.
                    let least = -0.5 * EPSILON as f32 / cosines.value.max(1e-6);
                    if y.value < least {
                        y = Dual::from_value(least);
                    }
                }
                // The sensor's steps are not seen by the derivative, which would be 0 or none.
                y.value = quantized(y.value, cos_theta_i, variety.noise.levels);
                brdf[channel] = y.value;
                standardized(y, cosines, mean, Dual::from_value(SCALE))
            });
            Self { brdf, standardized }
        });
        all.collect()
    }
}

/// A material's BRDF, and its derivatives by the angles, channel by channel.
type Measured = ([f32; 3], [[f32; 3]; 3]);

/// A warped material at some angles.
fn warped(
    material: &dyn Material,
    highlight_warp: HighlightWarp,
    angles: &[Angles<f32>],
) -> Vec<Measured> {
    let (places, slopes): (Vec<_>, Vec<_>) = angles
        .iter()
        .map(|angles| highlight_warp.angles(*angles))
        .unzip();
    let mut found = vec![Default::default(); angles.len()];
    material.brdf_batch_with_derivative(&places, &mut found);
    for ((_, derivatives), [by_theta_h, by_theta_d, by_phi_d]) in found.iter_mut().zip(slopes) {
        for [theta_h, theta_d, phi_d] in derivatives.iter_mut() {
            *theta_d += *theta_h * by_theta_d;
            *phi_d += *theta_h * by_phi_d;
            *theta_h *= by_theta_h;
        }
    }
    found
}

/// The smooth field's factor.
fn factor(task: &Task, angles: Angles<f32>) -> ByAngles {
    if task.is_flat() {
        return Dual::from_value(1.0);
    }
    let at = HalfDifference::from_angles(ByAngles::variables(angles));
    let terms = field_at(&at).into_iter().zip(task.field);
    let sum = terms.fold(Dual::from_value(0.0), |sum: ByAngles, (function, by)| {
        sum + function * Dual::from_value(by)
    });
    sum.exp()
}

/// A channel of a material, filtered and mixed with a partner.
fn mixed(task: &Task, channel: usize, own: &Measured, partner: Option<&Measured>) -> ByAngles {
    let (brdf, derivatives) = own;
    let from = task.channels[channel];
    let share = task.shares[channel];
    let gain = (1.0 - share) * task.gains[channel];
    let mut y = Dual {
        value: gain * brdf[from],
        tangent: derivatives[from].map(|by| gain * by),
    };
    if let Some((brdf, derivatives)) = partner {
        y.value += share * brdf[channel];
        for (y, by) in y.tangent.iter_mut().zip(derivatives[channel]) {
            *y += share * by;
        }
    }
    y
}

/// The readings that are there, as a descent takes them.
pub struct Present {
    values: Vec<OctetRgb>,
    weights: Vec<Octet>,
}

impl Present {
    /// Of all readings those that are there; each counts the same.
    #[must_use]
    pub fn new(readings: &[Reading], present: &[bool]) -> Self {
        let brdf: Vec<[f32; 3]> = readings.iter().map(|reading| reading.brdf).collect();
        let count = present.iter().filter(|present| **present).count().max(1);
        let mut weights = vec![Octet::default(); readings.len().div_ceil(WIDTH)];
        for (index, _) in present.iter().enumerate().filter(|(_, present)| **present) {
            weights[index / WIDTH].0[index % WIDTH] = 1.0 / (3.0 * count as f32);
        }
        Self {
            values: brdf.chunks(WIDTH).map(transpose_rgb).collect(),
            weights,
        }
    }

    /// As kernels read them.
    #[must_use]
    pub fn octets<'s>(&'s self, pattern: &'s Pattern) -> SampleOctets<'s> {
        SampleOctets {
            at: pattern.octets_at(),
            values: &self.values,
            order: None,
            weights: SampleWeights::Each(&self.weights),
            instruction_set: InstructionSet::of_this_machine(),
            in_a_row: false,
        }
    }
}
