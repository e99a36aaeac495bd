//! Simulated readings of tasks, and their standardization for the CoefficientNet.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::EPSILON;
use glimpse_core::numeric::Scalar;
use glimpse_fitting::linear::ComponentsAt;
use glimpse_kernels::{AngleDual, Dual};
use glimpse_materials::lists::add_scaled;
use glimpse_materials::{BrdfWithDerivative, Material, quantize};

use super::highlight_warp::HighlightWarp;
use super::pool::field_terms;
use super::task::TrainingTask;

/// The scale of centered logarithms.
pub const LOG_SCALE: f32 = 0.5;

/// The reading of one sample.
pub struct TaskReading {
    /// The BRDF, sr⁻¹, including noise.
    pub brdf: [f32; 3],
    /// The derivatives of the BRDF of each channel with respect to the angles of the sample.
    pub slopes: [[f32; 3]; 3],
    /// The inputs of the CoefficientNet, with derivatives with respect to the angles of the sample.
    pub standardized: [AngleDual<f32>; 3],
}

impl TaskReading {
    /// Simulates the reading of each sample of a task, by a sensor with a number of `levels`; 0 without quantization.
    #[must_use]
    pub fn read_task(
        task: &TrainingTask,
        materials: &[Box<dyn Material>],
        levels: u32,
        at: &ComponentsAt,
    ) -> Vec<Self> {
        let angles = &at.angles;
        let warps = HighlightWarp::all();
        let own = evaluate_warped(&*materials[task.material], warps[task.warps[0]], angles);
        let partner = task
            .has_partner()
            .then(|| evaluate_warped(&*materials[task.partner], warps[task.warps[1]], angles));
        let all = own.iter().enumerate().map(|(sample, own)| {
            let partner = partner.as_ref().map(|list| &list[sample]);
            let field = field_factor(task, angles[sample]);
            let cosine_product = at.cosines[sample].value;
            let mut brdf = [0.0; 3];
            let mut slopes = [[0.0; 3]; 3];
            let standardized = std::array::from_fn(|channel| {
                let mut y = mix_channel(task, channel, own, partner) * field;
                if let Some([factor, offset]) = task.noise.get(sample) {
                    y = y * Dual::from_value(factor[channel]) + Dual::from_value(offset[channel]);
                    // A fit also clamps readings that are too far below 0.
                    let min = -0.5 * EPSILON as f32 / cosine_product.max(1e-6);
                    if y.value < min {
                        y = Dual::from_value(min);
                    }
                }
                // Quantization is not differentiated: its derivative is 0 or undefined.
                y.value = quantize(y.value, at.cos_theta_i[sample], levels);
                brdf[channel] = y.value;
                slopes[channel] = y.tangent;
                at.mapped(sample, y) * Dual::from_value(LOG_SCALE)
            });
            Self {
                brdf,
                slopes,
                standardized,
            }
        });
        all.collect()
    }

    /// Returns the BRDF of readings.
    pub(crate) fn brdf(readings: &[Self]) -> Vec<[f32; 3]> {
        readings.iter().map(|reading| reading.brdf).collect()
    }
}

/// Evaluates a material with a highlight warp.
pub(super) fn evaluate_warped(
    material: &dyn Material,
    highlight_warp: HighlightWarp,
    angles: &[Angles<f32>],
) -> Vec<BrdfWithDerivative> {
    let (directions, slopes): (Vec<_>, Vec<_>) = angles
        .iter()
        .map(|angles| highlight_warp.angles(*angles))
        .unzip();
    let mut brdf = material.with_derivatives(&directions);
    for ((_, derivatives), [by_theta_h, by_theta_d, by_phi_d]) in brdf.iter_mut().zip(slopes) {
        for [theta_h, theta_d, phi_d] in derivatives.iter_mut() {
            *theta_d += *theta_h * by_theta_d;
            *phi_d += *theta_h * by_phi_d;
            *theta_h *= by_theta_h;
        }
    }
    brdf
}

/// Returns the factor of the smooth field.
pub(super) fn field_factor(task: &TrainingTask, angles: Angles<f32>) -> AngleDual<f32> {
    if !task.has_field() {
        return Dual::from_value(1.0);
    }
    let direction = HalfDifference::from_angles(AngleDual::variables(angles));
    let terms = field_terms(&direction).into_iter().zip(task.field);
    let sum = terms.fold(
        Dual::from_value(0.0),
        |sum: AngleDual<f32>, (function, coefficient)| {
            sum + function * Dual::from_value(coefficient)
        },
    );
    sum.exp()
}

/// Returns a channel of a material, filtered and mixed with a partner.
pub(super) fn mix_channel(
    task: &TrainingTask,
    channel: usize,
    own: &BrdfWithDerivative,
    partner: Option<&BrdfWithDerivative>,
) -> AngleDual<f32> {
    let (brdf, derivatives) = own;
    let source = task.channels[channel];
    let share = task.shares[channel];
    let gain = (1.0 - share) * task.gains[channel];
    let mut y = Dual {
        value: gain * brdf[source],
        tangent: derivatives[source].map(|derivative| gain * derivative),
    };
    if let Some((brdf, derivatives)) = partner {
        y.value += share * brdf[channel];
        add_scaled(&mut y.tangent, share, &derivatives[channel]);
    }
    y
}
