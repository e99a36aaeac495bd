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

/// A model's BRDF at angles in radians, and its derivative by theta_h, theta_d and phi_d for each
/// channel.
#[must_use]
pub fn with_derivative<M: Model>(
    parameters: &M::Parameters<f32>,
    angles: Angles<f32>,
) -> ([f32; 3], [[f32; 3]; 3]) {
    let parameters = Dual::constants::<M>(parameters);
    let at = HalfDifference::from_angles(Dual::variables(angles));
    Dual::split(M::brdf::<Dual<f32, 3>>(&parameters, &at))
}

/// The same of the model Neural.
#[must_use]
pub fn neural_with_derivative(
    parameters: &NeuralParameters<f32>,
    angles: Angles<f32>,
) -> ([f32; 3], [[f32; 3]; 3]) {
    with_derivative::<Neural>(parameters, angles)
}

/// The same at many places, eight and more at once.
pub fn neural_with_derivatives(
    parameters: &NeuralParameters<Dual<f32, 3>>,
    angles: &[Angles<f32>],
    found: &mut [([f32; 3], [[f32; 3]; 3])],
) {
    dispatch(WithDerivatives {
        parameters,
        angles,
        found,
    });
}

struct WithDerivatives<'a> {
    parameters: &'a NeuralParameters<Dual<f32, 3>>,
    angles: &'a [Angles<f32>],
    found: &'a mut [([f32; 3], [[f32; 3]; 3])],
}

impl Kernel for WithDerivatives<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        self.evaluate::<Narrowest<L>>();
    }
}

impl WithDerivatives<'_> {
    #[inline(always)]
    fn evaluate<L: Lanes>(self) {
        for (angles, found) in self.angles.chunks(WIDTH).zip(self.found.chunks_mut(WIDTH)) {
            let mut values = [[Octet::default(); 5]; 4];
            for lane in 0..WIDTH {
                let angles = angles[lane.min(angles.len() - 1)];
                let HalfDifference { hx, hz, dx, dy, dz } =
                    HalfDifference::from_angles(Dual::<f32, 3>::variables(angles));
                for (index, entry) in [hx, hz, dx, dy, dz].into_iter().enumerate() {
                    values[0][index].0[lane] = entry.value;
                    for angle in 0..3 {
                        values[1 + angle][index].0[lane] = entry.tangent[angle];
                    }
                }
            }
            let [value, first, second, third] = &values;
            macro_rules! dual {
                ($index:literal) => {
                    Dual::<L, 3> {
                        value: L::load([&value[$index]; MOST_OCTETS]),
                        tangent: [
                            L::load([&first[$index]; MOST_OCTETS]),
                            L::load([&second[$index]; MOST_OCTETS]),
                            L::load([&third[$index]; MOST_OCTETS]),
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
            for (channel, value) in brdf.into_iter().enumerate() {
                let mut stored = [[Octet::default(); MOST_OCTETS]; 4];
                value.value.store(&mut stored[0]);
                value.tangent[0].store(&mut stored[1]);
                value.tangent[1].store(&mut stored[2]);
                value.tangent[2].store(&mut stored[3]);
                for (lane, (brdf, derivative)) in found.iter_mut().enumerate() {
                    brdf[channel] = stored[0][0].0[lane];
                    for angle in 0..3 {
                        derivative[channel][angle] = stored[1 + angle][0].0[lane];
                    }
                }
            }
        }
    }
}
