//! Nothing that training computes overflows single precision.

use glimpse_core::angles::{Angles, HalfDifference};
use glimpse_core::model::{CookTorrance, Model, ParameterSet, Sample};
use glimpse_core::scalar::Scalar;
use glimpse_trainer::dual::Dual;
use glimpse_trainer::lanes::{Kernel, Lanes, Octet, PortableLanes, WIDTH, dispatch};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A model's gradient at eight samples, on dual numbers whose parameters carry a tangent.
struct Tangents<'a> {
    parameters: &'a [Dual<f32>],
    at: &'a [HalfDifference<f32>],
    measured: [f32; 3],
    weights: Octet,
}

impl Kernel for Tangents<'_> {
    /// Everything that comes out: values and tangents.
    type Output = Vec<Octet>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Vec<Octet> {
        type Parameters<T> = <CookTorrance as Model>::Parameters<T>;
        let mut parameters = Parameters::<Dual<f32>>::filled(Dual::constant(0.0));
        for (entry, value) in parameters.iter_mut().zip(self.parameters) {
            *entry = *value;
        }
        let at = L::load_at(&Octet::transpose(self.at));
        let value = Dual::<L>::from_value;
        let [red, green, blue] = self.measured;
        let sample = Sample {
            at: HalfDifference {
                hx: value(at.hx),
                hz: value(at.hz),
                dx: value(at.dx),
                dy: value(at.dy),
                dz: value(at.dz),
            },
            measured: [
                value(L::broadcast(red)),
                value(L::broadcast(green)),
                value(L::broadcast(blue)),
            ],
            weight: value(L::load(&self.weights)),
        };
        let mut gradient = Parameters::<[L; 1]>::filled([L::constant(0.0)]);
        let found =
            CookTorrance::accumulate_gradient::<Dual<L>, true>(&parameters, &sample, &mut gradient);
        let mut list = Vec::new();
        for [tangent] in gradient.iter() {
            list.push(tangent.store());
        }
        let by = found.gradient;
        let [red, green, blue] = by.measured;
        let at = by.at;
        for dual in [
            found.loss, at.hx, at.hz, at.dx, at.dy, at.dz, red, green, blue,
        ] {
            list.push(dual.value.store());
            list.push(dual.tangent[0].store());
        }
        list
    }
}

/// An angle whose distance from 0 or pi/2 is down to 1e-8 of pi/2.
fn angle(random: &mut ChaCha8Rng) -> f32 {
    let distance = std::f32::consts::FRAC_PI_2 * 10.0_f32.powf(random.random_range(-8.0..0.0));
    if random.random() {
        distance
    } else {
        std::f32::consts::FRAC_PI_2 - distance
    }
}

#[test]
fn cook_torrance_stays_finite_at_extremes() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut judged = 0;
    for _ in 0..20_000 {
        let parameters: [Dual<f32>; 8] = std::array::from_fn(|_| Dual {
            value: random.random_range(-12.0..12.0),
            tangent: [random.random_range(-10.0..10.0)],
        });
        let at: [HalfDifference<f32>; WIDTH] = std::array::from_fn(|_| {
            HalfDifference::from_angles(Angles {
                theta_h: angle(&mut random),
                theta_d: angle(&mut random),
                phi_d: random.random_range(0.0..std::f32::consts::TAU),
            })
        });
        // Samples below the horizon are computed as well, and have no weight.
        let weights = Octet(at.map(|at| f32::from(u8::from(at.is_valid()))));
        judged += at.iter().filter(|at| at.is_valid()).count();
        let measured = std::array::from_fn(|_| random.random_range(-12.0..12.0f32).exp());
        let kernel = || Tangents {
            parameters: &parameters,
            at: &at,
            measured,
            weights,
        };
        for found in [dispatch(kernel()), kernel().run::<PortableLanes>()] {
            assert!(
                found.iter().flat_map(|octet| octet.0).all(f32::is_finite),
                "{found:?} at {at:?} for {parameters:?}"
            );
        }
    }
    assert!(judged > 40_000, "only {judged} samples are valid");
}
