//! The adjoint of Gauss-Newton steps against finite differences in f64.

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::{
    CookTorrance, Model, Neural, ParameterSet, Phong, Sample, SampleGradient,
};
use glimpse_kernels::gauss_newton::{FitGradient, GaussNewton, ReadingAdjoint};
use glimpse_materials::sampling::uniform_valid;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const READINGS: usize = 12;
const STEPS: usize = 2;

/// A fit, as a list of all its inputs: theta_0, precisions, and nine numbers for each reading.
struct Problem {
    inputs: Vec<f64>,
    /// The derivative of the loss with respect to each fitted parameter.
    by_fitted: Vec<f64>,
}

impl Problem {
    fn new<M: Model>(deviation: f64, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut uniform = move |low: f64, high: f64| low + (high - low) * random.random::<f64>();
        let mut inputs: Vec<f64> = (0..M::PARAMETERS)
            .map(|_| uniform(-deviation, deviation))
            .collect();
        inputs.extend((0..M::ACTIVE.count()).map(|_| uniform(0.02, 0.1)));
        inputs.push(uniform(0.05, 0.2));
        for angles in uniform_valid(READINGS, seed) {
            let HalfDifference { hx, hz, dx, dy, dz } = HalfDifference::from_angles(angles);
            inputs.extend([hx, hz, dx, dy, dz].map(f64::from));
            inputs.extend([(); 3].map(|()| uniform(0.01, 0.6)));
            inputs.push(uniform(0.5, 1.5) / READINGS as f64);
        }
        let by_fitted = (0..M::PARAMETERS).map(|_| uniform(-1.0, 1.0)).collect();
        Self { inputs, by_fitted }
    }

    fn split<M: Model>(inputs: &[f64]) -> (M::Parameters<f64>, Vec<f64>, f64, Vec<Sample<f64>>) {
        let (initial, rest) = inputs.split_at(M::PARAMETERS);
        let (precision, rest) = rest.split_at(M::ACTIVE.count());
        let (error_scale, readings) = rest.split_at(1);
        let sample = |numbers: &[f64]| match *numbers {
            [hx, hz, dx, dy, dz, red, green, blue, weight] => Sample {
                at: HalfDifference { hx, hz, dx, dy, dz },
                measured: [red, green, blue],
                weight,
            },
            _ => unreachable!(),
        };
        let mut parameters = M::Parameters::filled(0.0);
        parameters.as_mut_slice().copy_from_slice(initial);
        let readings = readings.chunks(9).map(sample).collect();
        (parameters, precision.to_vec(), error_scale[0], readings)
    }

    fn loss<M: Model>(&self, inputs: &[f64]) -> f64 {
        let (initial, precision, error_scale, readings) = Self::split::<M>(inputs);
        let fit = GaussNewton::<M, f64> {
            initial,
            precision: &precision,
            error_scale,
            steps: STEPS,
        };
        let (fitted, _) = fit.fit(&readings[..]);
        let products = fitted.iter().zip(&self.by_fitted);
        products.map(|(theta, derivative)| theta * derivative).sum()
    }

    fn gradient<M: Model>(&self) -> Vec<f64> {
        let (initial, precision, error_scale, readings) = Self::split::<M>(&self.inputs);
        let fit = GaussNewton::<M, f64> {
            initial,
            precision: &precision,
            error_scale,
            steps: STEPS,
        };
        let (_, steps) = fit.fit(&readings[..]);
        let mut by_fitted = M::Parameters::filled(0.0);
        by_fitted.as_mut_slice().copy_from_slice(&self.by_fitted);
        let mut gradient = FitGradient {
            initial: by_fitted,
            precision: vec![0.0; precision.len()],
            error_scale: 0.0,
        };
        let none = ReadingAdjoint {
            sample: SampleGradient::zero(),
            weight: 0.0,
        };
        let mut by_readings = vec![none; readings.len()];
        fit.adjoint(&steps, &readings[..], &mut gradient, &mut by_readings);
        let mut list: Vec<f64> = gradient.initial.iter().copied().collect();
        list.extend(gradient.precision);
        list.push(gradient.error_scale);
        for ReadingAdjoint { sample, weight } in by_readings {
            let HalfDifference { hx, hz, dx, dy, dz } = sample.at;
            list.extend([hx, hz, dx, dy, dz]);
            list.extend(sample.measured);
            list.push(weight);
        }
        list
    }
}

fn assert_adjoint<M: Model>(deviation: f64) {
    const STEP: f64 = 1e-5;
    for seed in 0..3 {
        let problem = Problem::new::<M>(deviation, seed);
        let gradient = problem.gradient::<M>();
        let largest = gradient
            .iter()
            .fold(0.0_f64, |max, entry| max.max(entry.abs()));
        assert!(largest > 0.1);
        let mut inputs = problem.inputs.clone();
        let mut errors = 0;
        for (index, entry) in gradient.iter().enumerate() {
            let value = inputs[index];
            let [far_low, low, high, far_high] = [-2.0, -1.0, 1.0, 2.0].map(|steps| {
                inputs[index] = value + steps * STEP;
                problem.loss::<M>(&inputs)
            });
            inputs[index] = value;
            let difference = (far_low - far_high + 8.0 * (high - low)) / (12.0 * STEP);
            let error = (entry - difference).abs() / (entry.abs() + 1e-3 * largest);
            if error > 1e-4 {
                println!("{index}: {entry} {difference}");
                errors += 1;
            }
        }
        assert_eq!(errors, 0);
    }
}

#[test]
fn adjoint_of_phong_matches_finite_differences() {
    assert_adjoint::<Phong>(1.0);
}

#[test]
fn adjoint_of_cook_torrance_matches_finite_differences() {
    assert_adjoint::<CookTorrance>(1.0);
}

#[test]
fn adjoint_of_neural_matches_finite_differences() {
    assert_adjoint::<Neural>(0.4);
}
