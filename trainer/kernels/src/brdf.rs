//! A model's BRDF at many places, on lanes.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{Model, Neural, NeuralParameters};

use crate::dual::Dual;
use crate::lanes::{
    Kernel, Lanes, MOST_OCTETS, Narrowest, Octet, OctetAt, WIDTH, dispatch, load_at, narrows,
};

/// The BRDF in linear RGB, sr^-1 (not times the cosine), at many places; `brdf` is as long as `at`.
pub(crate) fn evaluate<M: Model>(
    parameters: &M::Parameters<f32>,
    at: &[HalfDifference<f32>],
    brdf: &mut [[f32; 3]],
) {
    dispatch(Evaluate::<M> {
        parameters,
        at,
        brdf,
    });
}

/// A model's BRDF at many places.
struct Evaluate<'a, M: Model> {
    /// The parameters.
    parameters: &'a M::Parameters<f32>,
    /// Where.
    at: &'a [HalfDifference<f32>],
    /// The BRDF in linear RGB, sr^-1 (not times the cosine); as long as `at`.
    brdf: &'a mut [[f32; 3]],
}

impl<M: Model> Kernel for Evaluate<'_, M> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        if const { narrows::<L>() } && self.at.len() <= WIDTH {
            self.evaluate::<Narrowest<L>>();
        } else {
            self.evaluate::<L>();
        }
    }
}

impl<M: Model> Evaluate<'_, M> {
    #[inline(always)]
    fn evaluate<L: Lanes>(self) {
        let count = L::OCTETS * WIDTH;
        for (at, brdf) in self.at.chunks(count).zip(self.brdf.chunks_mut(count)) {
            let mut octets = [OctetAt::default(); MOST_OCTETS];
            for (octet, at) in octets.iter_mut().zip(at.chunks(WIDTH)) {
                *octet = Octet::transpose(at);
            }
            let at = load_at::<L>(octets.each_ref());
            let mut values = [[Octet::default(); MOST_OCTETS]; 3];
            for (stored, value) in values.iter_mut().zip(M::brdf::<L>(self.parameters, &at)) {
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

/// The BRDF of the model Neural at angles in radians, and its derivative by theta_h, theta_d and
/// phi_d for each channel.
#[must_use]
pub fn neural_with_derivative(
    parameters: &NeuralParameters<f32>,
    angles: Angles<f32>,
) -> ([f32; 3], [[f32; 3]; 3]) {
    let parameters = Dual::constants::<Neural>(parameters);
    let at = HalfDifference::from_angles(Dual::variables(angles));
    Dual::split(Neural::brdf::<Dual<f32, 3>>(&parameters, &at))
}
