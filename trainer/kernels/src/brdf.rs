//! Evaluation of a model's BRDF at many directions, on lanes.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{Model, Neural, NeuralParameters};

use crate::dual::Dual;
use crate::lanes::{
    Kernel, Lanes, MAX_OCTETS, Narrowest, Octet, OctetDirections, WIDTH, dispatch, has_narrower,
    load_directions,
};

/// Computes the BRDF in linear RGB, sr^-1 (not times the cosine), at many directions. `brdf` has the length of `at`.
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

/// The kernel of [`evaluate`].
struct Evaluate<'a, M: Model> {
    parameters: &'a M::Parameters<f32>,
    at: &'a [HalfDifference<f32>],
    brdf: &'a mut [[f32; 3]],
}

impl<M: Model> Kernel for Evaluate<'_, M> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        if const { has_narrower::<L>() } && self.at.len() <= WIDTH {
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
            let mut octets = [OctetDirections::default(); MAX_OCTETS];
            for (octet, at) in octets.iter_mut().zip(at.chunks(WIDTH)) {
                *octet = Octet::transpose(at);
            }
            let at = load_directions::<L>(octets.each_ref());
            let mut values = [[Octet::default(); MAX_OCTETS]; 3];
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

/// Returns a model's BRDF at angles in radians, and the derivatives of each channel with respect to theta_h, theta_d
/// and phi_d.
#[must_use]
pub fn with_derivative<M: Model>(
    parameters: &M::Parameters<f32>,
    angles: Angles<f32>,
) -> ([f32; 3], [[f32; 3]; 3]) {
    let parameters = Dual::constants::<M>(parameters);
    let at = HalfDifference::from_angles(Dual::variables(angles));
    Dual::split(M::brdf::<Dual<f32, 3>>(&parameters, &at))
}

/// The function [`with_derivative`] for the model Neural, compiled in this crate.
#[must_use]
pub fn neural_with_derivative(
    parameters: &NeuralParameters<f32>,
    angles: Angles<f32>,
) -> ([f32; 3], [[f32; 3]; 3]) {
    with_derivative::<Neural>(parameters, angles)
}

/// Computes [`neural_with_derivative`] at many angles, eight at a time. `parameters` are constants (tangent 0), and
/// `results` has the length of `angles`.
pub fn neural_batch_with_derivatives(
    parameters: &NeuralParameters<Dual<f32, 3>>,
    angles: &[Angles<f32>],
    results: &mut [([f32; 3], [[f32; 3]; 3])],
) {
    dispatch(NeuralBatch {
        parameters,
        angles,
        results,
    });
}

/// The kernel of [`neural_batch_with_derivatives`].
struct NeuralBatch<'a> {
    parameters: &'a NeuralParameters<Dual<f32, 3>>,
    angles: &'a [Angles<f32>],
    results: &'a mut [([f32; 3], [[f32; 3]; 3])],
}

impl Kernel for NeuralBatch<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        self.evaluate::<Narrowest<L>>();
    }
}

impl NeuralBatch<'_> {
    #[inline(always)]
    fn evaluate<L: Lanes>(self) {
        for (angles, results) in self
            .angles
            .chunks(WIDTH)
            .zip(self.results.chunks_mut(WIDTH))
        {
            // The values of hx, hz, dx, dy and dz, and their derivatives with respect to each angle.
            let mut coordinates = [[Octet::default(); 5]; 4];
            for lane in 0..WIDTH {
                let angles = angles[lane.min(angles.len() - 1)];
                let HalfDifference { hx, hz, dx, dy, dz } =
                    HalfDifference::from_angles(Dual::<f32, 3>::variables(angles));
                for (index, entry) in [hx, hz, dx, dy, dz].into_iter().enumerate() {
                    coordinates[0][index].0[lane] = entry.value;
                    for angle in 0..3 {
                        coordinates[1 + angle][index].0[lane] = entry.tangent[angle];
                    }
                }
            }
            let [value, by_theta_h, by_theta_d, by_phi_d] = &coordinates;
            macro_rules! dual {
                ($index:literal) => {
                    Dual::<L, 3> {
                        value: L::load([&value[$index]; MAX_OCTETS]),
                        tangent: [
                            L::load([&by_theta_h[$index]; MAX_OCTETS]),
                            L::load([&by_theta_d[$index]; MAX_OCTETS]),
                            L::load([&by_phi_d[$index]; MAX_OCTETS]),
                        ],
                    }
                };
            }
            let at = HalfDifference {
                hx: dual!(0),
                hz: dual!(1),
                dx: dual!(2),
                dy: dual!(3),
                dz: dual!(4),
            };
            let brdf = Neural::brdf::<Dual<L, 3>>(self.parameters, &at);
            for (channel, dual) in brdf.into_iter().enumerate() {
                let mut stored = [[Octet::default(); MAX_OCTETS]; 4];
                dual.value.store(&mut stored[0]);
                dual.tangent[0].store(&mut stored[1]);
                dual.tangent[1].store(&mut stored[2]);
                dual.tangent[2].store(&mut stored[3]);
                for (lane, (brdf, derivative)) in results.iter_mut().enumerate() {
                    brdf[channel] = stored[0][0].0[lane];
                    for angle in 0..3 {
                        derivative[channel][angle] = stored[1 + angle][0].0[lane];
                    }
                }
            }
        }
    }
}
