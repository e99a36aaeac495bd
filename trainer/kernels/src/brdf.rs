//! Evaluation of a model's BRDF at many directions, on lanes.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{Model, Neural, NeuralParameters};

use crate::dual::Dual;
use crate::lanes::{
    InstructionSet, Lanes, MAX_OCTETS, Octet, OctetDirections, WIDTH, kernel, load_directions,
};

kernel! {
    on InstructionSet::detect();
    /// Computes the BRDF in linear RGB, sr^-1 (not times the cosine), at many directions. `brdf` has the length of `at`.
    pub(crate) fn evaluate<'a, L: Lanes, M: Model>(
        parameters: &'a M::Parameters<f32>,
        at: &'a [HalfDifference<f32>],
        brdf: &'a mut [[f32; 3]],
    ) {
        let count = L::OCTETS * WIDTH;
        for (at, brdf) in at.chunks(count).zip(brdf.chunks_mut(count)) {
            let mut octets = [OctetDirections::default(); MAX_OCTETS];
            for (octet, at) in octets.iter_mut().zip(at.chunks(WIDTH)) {
                *octet = Octet::transpose(at);
            }
            let at = load_directions::<L>(octets.each_ref());
            let mut values = [[Octet::default(); MAX_OCTETS]; 3];
            for (stored, value) in values.iter_mut().zip(M::brdf::<L>(parameters, &at)) {
                value.store(stored);
            }
            for (index, rgb) in brdf.iter_mut().enumerate() {
                let [red, green, blue] = &values;
                let (octet, lane) = (index / WIDTH, index % WIDTH);
                *rgb = [
                    red[octet].0[lane],
                    green[octet].0[lane],
                    blue[octet].0[lane],
                ];
            }
        }
    }
}

/// Returns a model's BRDF at angles in radians, and the derivatives of each channel with respect to theta_h, theta_d
/// and phi_d.
#[must_use]
pub fn with_derivative<M: Model>(
    parameters: &M::Parameters<f32>,
    angles: Angles<f32>,
) -> BrdfWithDerivative {
    let parameters = Dual::constants::<M>(parameters);
    let at = HalfDifference::from_angles(Dual::variables(angles));
    Dual::split(M::brdf::<Dual<f32, 3>>(&parameters, &at))
}

/// The BRDF of a sample in each channel, and its derivatives with respect to theta_h, theta_d and phi_d.
pub type BrdfWithDerivative = ([f32; 3], [[f32; 3]; 3]);

kernel! {
    on InstructionSet::detect();
    /// Computes [`with_derivative`] of the model Neural at many angles, eight at a time. `parameters` are constants
    /// (tangent 0), and `results` has the length of `angles`.
    pub fn neural_batch_with_derivatives<'a, L: Lanes>(
        parameters: &'a NeuralParameters<Dual<f32, 3>>,
        angles: &'a [Angles<f32>],
        results: &'a mut [BrdfWithDerivative],
    ) {
        neural_batch_on::<L::Narrow>(parameters, angles, results);
    }
}

#[inline(always)]
fn neural_batch_on<L: Lanes>(
    parameters: &NeuralParameters<Dual<f32, 3>>,
    angles: &[Angles<f32>],
    results: &mut [BrdfWithDerivative],
) {
    for (angles, results) in angles.chunks(WIDTH).zip(results.chunks_mut(WIDTH)) {
        // The values of the coordinates, and their derivatives with respect to each angle.
        let mut stored = [[Octet::default(); 4]; 5];
        for lane in 0..WIDTH {
            let angles = angles[lane.min(angles.len() - 1)];
            let at = HalfDifference::from_angles(Dual::<f32, 3>::variables(angles));
            for (stored, Dual { value, tangent }) in stored.iter_mut().zip(at.to_array()) {
                let [by_theta_h, by_theta_d, by_phi_d] = tangent;
                for (octet, entry) in
                    (stored.iter_mut()).zip([value, by_theta_h, by_theta_d, by_phi_d])
                {
                    octet.0[lane] = entry;
                }
            }
        }
        let mut at = [Dual::<L, 3>::from_value(L::constant(0.0)); 5];
        for (dual, [value, tangents @ ..]) in at.iter_mut().zip(&stored) {
            dual.value = L::load([value; MAX_OCTETS]);
            for (tangent, octet) in dual.tangent.iter_mut().zip(tangents) {
                *tangent = L::load([octet; MAX_OCTETS]);
            }
        }
        let brdf = Neural::brdf::<Dual<L, 3>>(parameters, &HalfDifference::from_array(at));
        for (channel, Dual { value, tangent }) in brdf.into_iter().enumerate() {
            let mut octets = [[Octet::default(); MAX_OCTETS]; 4];
            value.store(&mut octets[0]);
            for (octets, tangent) in octets[1..].iter_mut().zip(tangent) {
                tangent.store(octets);
            }
            for (lane, (brdf, derivative)) in results.iter_mut().enumerate() {
                brdf[channel] = octets[0][0].0[lane];
                for angle in 0..3 {
                    derivative[channel][angle] = octets[1 + angle][0].0[lane];
                }
            }
        }
    }
}
