//! For comparison: Phong on 8 samples by multicalc's Levenberg-Marquardt, which differentiates by dual numbers. It has
//! the same start and the same readings, and runs until it converges. It minimizes squares where Glimpse minimizes
//! absolute values, because its residuals have to be smooth.

#![no_std]
#![no_main]

use core::hint::black_box;

use glimpse_bench::machine::counter;
use glimpse_bench::recipes::PHONG;
use glimpse_bench::report::print_result;
use glimpse_bench::{BenchError, measure};
use glimpse_core::fit::Estimator;
use glimpse_core::geometry::HalfDifference;
use glimpse_core::recipe::Recipe;
use multicalc::numerical_derivative::AutoDiffMulti;
use multicalc::optimization::LevenbergMarquardt;
use multicalc::scalar::{Numeric, VectorFn};

const SAMPLES: usize = 8;
const PARAMETERS: usize = 7;
const RESIDUALS: usize = 3 * SAMPLES;

/// The readings and their directions.
struct Measurements {
    at: [HalfDifference<f32>; SAMPLES],
    brdf: [[f32; 3]; SAMPLES],
}

/// Residuals ln(1 + f c) - ln(1 + y c) of each sample and channel, with f by Phong's formula (see
/// `core/src/model/phong.rs`).
impl VectorFn<PARAMETERS, RESIDUALS> for Measurements {
    fn eval<S: Numeric>(&self, point: &[S; PARAMETERS]) -> [S; RESIDUALS] {
        let constant = |value: f32| S::from_f64(f64::from(value));
        let sigmoid = |x: S| S::ONE / (S::ONE + (-x).exp());
        let [sum_r, sum_g, sum_b, ratio_r, ratio_g, ratio_b, exponent] = *point;
        let sums = [sum_r, sum_g, sum_b].map(sigmoid);
        let ratios = [ratio_r, ratio_g, ratio_b].map(sigmoid);
        let q = exponent.exp();
        let normalization = (q + S::TWO) / S::TWO_PI;
        let lambert = S::ONE / S::PI;
        let mut residuals = [S::ZERO; RESIDUALS];
        let samples = self.at.iter().zip(&self.brdf);
        for (residuals, (at, brdf)) in residuals.as_chunks_mut::<3>().0.iter_mut().zip(samples) {
            let dot =
                (at.dz * at.dz + at.dx * at.dx) * (at.hz * at.hz - at.hx * at.hx) + at.dy * at.dy;
            let base = constant(if dot > 0.0 { dot } else { 0.0 } + 1e-5);
            let lobe = normalization * (q * base.ln()).exp();
            let cosine = at.cos_theta_i();
            let channels = sums.iter().zip(&ratios).zip(brdf);
            for (residual, ((sum, ratio), measured)) in residuals.iter_mut().zip(channels) {
                let modeled = *sum * (*ratio * lambert + (S::ONE - *ratio) * lobe);
                *residual = (S::ONE + modeled * constant(cosine)).ln()
                    - constant(1.0 + *measured * cosine).ln();
            }
        }
        residuals
    }
}

glimpse_bench::firmware!(fit());

fn fit() -> Result<(), BenchError> {
    glimpse_bench::machine::stack::paint();
    let recipe = Recipe::parse(black_box(PHONG)).map_err(|_| BenchError)?;
    let Estimator::Sgd(sgd) = recipe.estimator() else {
        return Err(BenchError);
    };
    let mut start = [0.0; PARAMETERS];
    for (parameter, value) in start.iter_mut().zip(sgd.initial.iter()) {
        *parameter = value;
    }
    let mut measured = Measurements {
        at: [HalfDifference::zero(); SAMPLES],
        brdf: [[0.0; 3]; SAMPLES],
    };
    let places = measured.at.iter_mut().zip(&mut measured.brdf);
    for ((at, brdf), angles) in places.zip(recipe.pattern()) {
        *at = HalfDifference::from_angles(angles);
        *brdf = measure(angles).brdf;
    }
    let before = counter::now();
    let result = LevenbergMarquardt::from_derivator(AutoDiffMulti::<f32>::new())
        .minimize(black_box(&measured), &start);
    let after = counter::now();
    let report = result.map_err(|_| BenchError)?;
    print_result(before, after, report.solution.map(f32::to_bits));
    Ok(())
}
