//! An independent witness of the meta-gradient: the inner loop (the ridge solve, for the model
//! Linear; a completion of the readings, and the start that it leads to) as a program of tensor
//! operations, written from the formulas without the crates under test, and differentiated by burn.
//!
//! burn's autodiff is first-order, so the gradient that the inner loop steps along is written out
//! by hand; burn then differentiates the steps, and the outer loss, which it reads as plain
//! formulas. All of it runs in f64, except where burn does not: it computes sigmoids, and slopes
//! through a division by a number, in f32, so neither is used. Every tensor is asked for in f64:
//! otherwise burn settles once in each process whether tensors are in f32 or f64.

mod completion;
mod linear;

use std::f64::consts::{FRAC_1_PI, PI};
use std::sync::{Mutex, PoisonError};

use burn::tensor::activation::relu;
use burn::tensor::backend::Backend;
use burn::tensor::{DType, Tensor, TensorData};
use burn_autodiff::Autodiff;
use burn_ndarray::{NdArray, NdArrayDevice};
use glimpse_core::model::{CookTorrance, Model, Neural, Phong};
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestRunner};

use crate::problem::{
    COOK_TORRANCE_STEPS, NEURAL_STEPS, PHONG_STEPS, Problem, by_variables, problems,
};
use glimpse_gradcheck::cases::{Variables, cook_torrance, neural, phong};

type B = Autodiff<NdArray<f64>>;
type Matrix = Tensor<B, 2>;

/// Largest error, relative to the largest slope of the same kind.
const TOLERANCE: f64 = 1e-10;

fn matrix(values: &[f64], shape: [usize; 2]) -> Matrix {
    let data = TensorData::new(values.to_vec(), shape);
    Tensor::from_data(data, (&NdArrayDevice::Cpu, DType::F64))
}

/// All entries, row by row.
fn list<B: Backend>(matrix: Tensor<B, 2>) -> Vec<f64> {
    matrix.into_data().iter::<f64>().collect()
}

/// 1 where positive, else 0.
fn positive(values: &Matrix) -> Matrix {
    let is_positive = values.clone().greater_elem(0.0);
    is_positive.float().cast(DType::F64)
}

/// 1 / (1 + exp(-x)).
fn sigmoid(values: Matrix) -> Matrix {
    (-values).exp().add_scalar(1.0).recip()
}

/// Samples as columns: angles (theta_h, theta_d, phi_d) and measured values.
#[derive(Clone)]
struct Columns {
    angles: Matrix,
    measured: Matrix,
}

impl Columns {
    fn new(list: &[Variables]) -> Self {
        let angles: Vec<f64> = list.iter().copied().flat_map(angles_of).collect();
        let measured: Vec<f64> = list.iter().flat_map(|each| each[5..].to_vec()).collect();
        let shape = [list.len(), 3];
        Self {
            angles: matrix(&angles, shape),
            measured: matrix(&measured, shape),
        }
    }

    fn angle(&self, column: usize) -> Matrix {
        self.angles.clone().narrow(1, column, 1)
    }

    /// The half vector (x and z; its y is 0).
    fn half(&self) -> [Matrix; 2] {
        [self.angle(0).sin(), self.angle(0).cos()]
    }

    /// The difference vector.
    fn difference(&self) -> [Matrix; 3] {
        let sin = self.angle(1).sin();
        [
            sin.clone() * self.angle(2).cos(),
            sin * self.angle(2).sin(),
            self.angle(1).cos(),
        ]
    }

    /// w_i: the difference vector turned by theta_h.
    fn incoming(&self) -> [Matrix; 3] {
        let [hx, hz] = self.half();
        let [dx, dy, dz] = self.difference();
        [
            hz.clone() * dx.clone() + hx.clone() * dz.clone(),
            dy,
            hz * dz - hx * dx,
        ]
    }

    /// max(cos theta_i, 0).
    fn cosine(&self) -> Matrix {
        let [_, _, z] = self.incoming();
        relu(z)
    }

    /// The mean of |ln(1 + y c) - ln(1 + f c)| over samples and channels.
    fn loss(&self, modeled: Matrix) -> Tensor<B, 1> {
        let logarithm = |values: Matrix| (values * self.cosine()).add_scalar(1.0).log();
        let error = logarithm(self.measured.clone()) - logarithm(modeled);
        error.abs().mean()
    }

    /// The loss's derivative by the modeled values, by hand.
    fn by_modeled(&self, modeled: &Matrix) -> Matrix {
        let above = modeled.clone() - self.measured.clone();
        let sign = positive(&above) - positive(&-above);
        let share = 1.0 / (self.measured.dims().iter().product::<usize>() as f64);
        sign * self.cosine() / (modeled.clone() * self.cosine()).add_scalar(1.0) * share
    }
}

/// The angles of half and difference vector.
fn angles_of([hx, hz, dx, dy, dz, ..]: Variables) -> [f64; 3] {
    [hx.atan2(hz), dx.hypot(dy).atan2(dz), dy.atan2(dx)]
}

/// A model in tensors. Parameters are a list of matrices, in the order of the model under test.
trait Program {
    const SHAPES: &[[usize; 2]];
    /// f.
    fn modeled(theta: &[Matrix], at: &Columns) -> Matrix;
    /// The gradient of the mean loss by each of the parameters, by hand.
    fn gradient(theta: &[Matrix], at: &Columns) -> Vec<Matrix>;
}

/// 6-21-21-3, ReLU; f = max(exp(z) - 1, 0).
impl Program for Neural {
    const SHAPES: &[[usize; 2]] = &[[6, 21], [1, 21], [21, 21], [1, 21], [21, 3], [1, 3]];

    fn modeled(theta: &[Matrix], at: &Columns) -> Matrix {
        relu(layers(theta, at).2.exp().sub_scalar(1.0))
    }

    fn gradient(theta: &[Matrix], at: &Columns) -> Vec<Matrix> {
        let (first, second, output) = layers(theta, at);
        let exponential = output.exp();
        let raised = exponential.clone().sub_scalar(1.0);
        let by_modeled = at.by_modeled(&relu(raised.clone()));
        let by_output = by_modeled * positive(&raised) * exponential;
        let by_second = by_output.clone().matmul(theta[4].clone().transpose()) * positive(&second);
        let by_first = by_second.clone().matmul(theta[2].clone().transpose()) * positive(&first);
        vec![
            input(at).transpose().matmul(by_first.clone()),
            by_first.sum_dim(0),
            relu(first).transpose().matmul(by_second.clone()),
            by_second.sum_dim(0),
            relu(second).transpose().matmul(by_output.clone()),
            by_output.sum_dim(0),
        ]
    }
}

/// The network's input: half and difference vector.
fn input(at: &Columns) -> Matrix {
    let [hx, hz] = at.half();
    let [dx, dy, dz] = at.difference();
    let hy = hx.zeros_like();
    Tensor::cat(vec![hx, hy, hz, dx, dy, dz], 1)
}

/// What each layer computes, before its activation.
fn layers(theta: &[Matrix], at: &Columns) -> (Matrix, Matrix, Matrix) {
    let affine = |values: Matrix, layer: usize| {
        values.matmul(theta[2 * layer].clone()) + theta[2 * layer + 1].clone()
    };
    let first = affine(input(at), 0);
    let second = affine(relu(first.clone()), 1);
    let output = affine(relu(second.clone()), 2);
    (first, second, output)
}

/// f = k_d / pi + k_s (q + 2) / (2 pi) (max(<w_o, r>, 0) + 1e-5)^q.
impl Program for Phong {
    const SHAPES: &[[usize; 2]] = &[[1, 3], [1, 3], [1, 1]];

    fn modeled(theta: &[Matrix], at: &Columns) -> Matrix {
        let (sum, ratio) = (sigmoid(theta[0].clone()), sigmoid(theta[1].clone()));
        let diffuse = sum.clone() * ratio.clone();
        let specular = sum * (-ratio).add_scalar(1.0);
        diffuse * FRAC_1_PI + specular * lobe(&theta[2], &base(at))
    }

    fn gradient(theta: &[Matrix], at: &Columns) -> Vec<Matrix> {
        let (sum, ratio) = (sigmoid(theta[0].clone()), sigmoid(theta[1].clone()));
        let opposite = |share: &Matrix| (-share.clone()).add_scalar(1.0);
        let base = base(at);
        let q = theta[2].clone().exp();
        let lobe = lobe(&theta[2], &base);
        let by_modeled = at.by_modeled(&Self::modeled(theta, at));
        let mixture = ratio.clone() * FRAC_1_PI + opposite(&ratio) * lobe.clone();
        let contrast = (-lobe.clone()).add_scalar(FRAC_1_PI);
        let by_lobe = by_modeled.clone() * sum.clone() * opposite(&ratio);
        // d/dq (q + 2) b^q = b^q + (q + 2) b^q ln b
        let power = (base.clone().log() * q.clone()).exp();
        let lobe_by_q = power * (0.5 * FRAC_1_PI) + lobe * base.log();
        vec![
            (by_modeled.clone() * mixture).sum_dim(0) * sum.clone() * opposite(&sum),
            (by_modeled * contrast * sum).sum_dim(0) * ratio.clone() * opposite(&ratio),
            (by_lobe * lobe_by_q).sum_dim(0).sum_dim(1) * q,
        ]
    }
}

/// max(<w_o, r>, 0) + 1e-5, r the mirror direction of w_i.
fn base(at: &Columns) -> Matrix {
    let [hx, hz] = at.half();
    let [ix, iy, iz] = at.incoming();
    let twice = (hx.clone() * ix.clone() + hz.clone() * iz.clone()) * 2.0;
    let [ox, oy, oz] = [
        twice.clone() * hx - ix.clone(),
        -iy.clone(),
        twice * hz - iz.clone(),
    ];
    relu(oz * iz - ox * ix - oy * iy).add_scalar(1e-5)
}

/// (q + 2) / (2 pi) base^q, q = exp(exponent).
fn lobe(exponent: &Matrix, base: &Matrix) -> Matrix {
    let q = exponent.clone().exp();
    (base.clone().log() * q.clone()).exp() * q.add_scalar(2.0) * (0.5 * FRAC_1_PI)
}

/// f = k_d / pi + k_s D G F / (pi cos_i cos_o).
impl Program for CookTorrance {
    const SHAPES: &[[usize; 2]] = &[[1, 3], [1, 3], [1, 1], [1, 1]];

    fn modeled(theta: &[Matrix], at: &Columns) -> Matrix {
        let [k_d, k_s, alpha, f_0] = [0, 1, 2, 3].map(|index| sigmoid(theta[index].clone()));
        let beckmann = beckmann(at, &alpha).0;
        k_d * FRAC_1_PI + k_s * (beckmann * geometry(at) * fresnel(at, &f_0).0)
    }

    fn gradient(theta: &[Matrix], at: &Columns) -> Vec<Matrix> {
        let [k_d, k_s, alpha, f_0] = [0, 1, 2, 3].map(|index| sigmoid(theta[index].clone()));
        let by_logit = |value: &Matrix| value.clone() * (-value.clone()).add_scalar(1.0);
        let (d, d_by_alpha) = beckmann(at, &alpha);
        let (f, f_by_f_0) = fresnel(at, &f_0);
        let g = geometry(at);
        let by_modeled = at.by_modeled(&Self::modeled(theta, at));
        let by_lobe = (by_modeled.clone() * k_s.clone()).sum_dim(1);
        let by_alpha = by_lobe.clone() * d_by_alpha * g.clone() * f.clone();
        let by_f_0 = by_lobe * d.clone() * g.clone() * f_by_f_0;
        vec![
            by_modeled.clone().sum_dim(0) * FRAC_1_PI * by_logit(&k_d),
            (by_modeled * (d * g * f)).sum_dim(0) * by_logit(&k_s),
            by_alpha.sum_dim(0) * by_logit(&alpha),
            by_f_0.sum_dim(0) * by_logit(&f_0),
        ]
    }
}

/// What Cook-Torrance's denominators are offset by.
const EPSILON: f64 = 1e-6;

fn square(values: Matrix) -> Matrix {
    values.clone() * values
}

/// D = exp(-tan^2 theta_h / alpha^2) / (alpha^2 cos^4 theta_h), and dD/dalpha.
fn beckmann(at: &Columns, alpha: &Matrix) -> (Matrix, Matrix) {
    let [sin, cos] = at.half().map(square);
    let below_sin = (square(alpha.clone()) * cos.clone()).add_scalar(EPSILON);
    let below = (square(alpha.clone()) * square(cos.clone())).add_scalar(EPSILON);
    let d = (-(sin.clone() / below_sin.clone())).exp() / below.clone();
    let slope = sin * cos.clone() / square(below_sin) - square(cos) / below;
    (d.clone(), d * slope * alpha.clone() * 2.0)
}

/// F = F0 + (1 - F0) (1 - cos theta_d)^5, and dF/dF0.
fn fresnel(at: &Columns, f_0: &Matrix) -> (Matrix, Matrix) {
    let [_, _, dz] = at.difference();
    let opposite = (-dz).add_scalar(1.0);
    let fifth = square(square(opposite.clone())) * opposite;
    let rest = (-fifth.clone()).add_scalar(1.0);
    (f_0.clone() * rest.clone() + fifth, rest)
}

/// G / (pi cos_i cos_o), G = min(1, 2 cos theta_h min(cos_i, cos_o) / cos theta_d).
fn geometry(at: &Columns) -> Matrix {
    let [hx, hz] = at.half();
    let [dx, _, dz] = at.difference();
    let (up, along) = (hz.clone() * dz.clone(), hx * dx);
    let (incoming, outgoing) = (up.clone() - along.clone(), up + along);
    // min(a, b) = a - max(a - b, 0)
    let lower = incoming.clone() - relu(incoming.clone() - outgoing.clone());
    let unmasked = hz * lower * 2.0 / dz.add_scalar(EPSILON);
    let g = (-relu((-unmasked).add_scalar(1.0))).add_scalar(1.0);
    g / (incoming * outgoing * PI).add_scalar(EPSILON)
}

/// The outer loss and its slopes, as burn finds them.
struct Witnessed {
    loss: f64,
    initial: Vec<f64>,
    step_sizes: Vec<f64>,
    angles: Vec<f64>,
    measured: Vec<f64>,
}

/// burn 0.21 loses gradients when two threads build or differentiate graphs at once
/// (tracel-ai/burn#5573), so they take turns.
static TURN: Mutex<()> = Mutex::new(());

fn witness<P: Program>(problem: &Problem) -> Witnessed {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let matrices = |list: &[f64]| -> Vec<Matrix> {
        let mut rest = list;
        let shapes = P::SHAPES.iter();
        shapes
            .map(|shape| {
                let (values, after) = rest.split_at(shape[0] * shape[1]);
                rest = after;
                matrix(values, *shape).require_grad()
            })
            .collect()
    };
    let initial = matrices(&problem.initial);
    let step_sizes = matrices(&problem.step_sizes);
    let mut inner = Columns::new(&problem.inner);
    inner.angles = inner.angles.require_grad();
    inner.measured = inner.measured.require_grad();

    let mut theta = initial.clone();
    for _ in 0..problem.steps {
        let gradient = P::gradient(&theta, &inner);
        for ((theta, step_size), slope) in theta.iter_mut().zip(&step_sizes).zip(gradient) {
            *theta = theta.clone() - step_size.clone() * slope;
        }
    }
    let outer = Columns::new(&problem.outer);
    let loss = outer.loss(P::modeled(&theta, &outer));

    let gradients = loss.backward();
    let slopes = |tensors: &[Matrix]| -> Vec<f64> {
        let lists = tensors.iter().map(|tensor| match tensor.grad(&gradients) {
            Some(slopes) => list(slopes),
            // burn leaves out what the loss does not depend on.
            None => vec![0.0; tensor.dims().iter().product()],
        });
        lists.collect::<Vec<_>>().concat()
    };
    Witnessed {
        loss: loss.into_scalar(),
        initial: slopes(&initial),
        step_sizes: slopes(&step_sizes),
        angles: slopes(&[inner.angles]),
        measured: slopes(&[inner.measured]),
    }
}

/// From slopes by the coordinates of half and difference vector to slopes by the angles.
fn by_angles(variables: Variables, slopes: Variables) -> [f64; 3] {
    let [hx, hz, dx, dy, dz, ..] = variables;
    let [by_hx, by_hz, by_dx, by_dy, by_dz, ..] = slopes;
    let [_, theta_d, phi_d] = angles_of(variables);
    let (sin, cos) = phi_d.sin_cos();
    [
        by_hx * hz - by_hz * hx,
        dz * (by_dx * cos + by_dy * sin) - by_dz * theta_d.sin(),
        by_dy * dx - by_dx * dy,
    ]
}

/// The largest difference of two lists, relative to the largest entry.
fn disagreement(found: &[f64], witnessed: &[f64]) -> f64 {
    assert_eq!(found.len(), witnessed.len());
    let largest = witnessed
        .iter()
        .fold(0.0_f64, |most, slope| most.max(slope.abs()));
    let differences = found.iter().zip(witnessed).map(|(a, b)| (a - b).abs());
    let difference = differences.fold(0.0, |most: f64, difference| {
        if difference.is_nan() {
            difference
        } else {
            most.max(difference)
        }
    });
    if difference == 0.0 {
        0.0
    } else {
        difference / largest
    }
}

fn compare<M: Model + Program>(problem: &Problem) -> Result<[f64; 4], String> {
    let found = problem.meta_gradient::<M>();
    let witnessed = witness::<M>(problem);
    if (found.loss - witnessed.loss).abs() > 1e-12 {
        return Err(format!(
            "the loss is {} and not {}",
            found.loss, witnessed.loss
        ));
    }
    let slopes = by_variables(&found);
    let pairs = problem.inner.iter().zip(&slopes);
    let angles: Vec<f64> = pairs.flat_map(|(at, by)| by_angles(*at, *by)).collect();
    let measured: Vec<f64> = slopes.iter().flat_map(|by| by[5..].to_vec()).collect();
    let disagreements = [
        disagreement(&found.initial, &witnessed.initial),
        disagreement(&found.step_sizes, &witnessed.step_sizes),
        disagreement(&angles, &witnessed.angles),
        disagreement(&measured, &witnessed.measured),
    ];
    // Written so that a NaN fails as well.
    if !disagreements.iter().all(|error| *error <= TOLERANCE) {
        return Err(format!("disagreements: {disagreements:?}"));
    }
    Ok(disagreements)
}

fn compare_many<M: Model + Program>(cases: u32, problems: impl Strategy<Value = Problem>) {
    let largest = std::cell::Cell::new([0.0_f64; 4]);
    let config = ProptestConfig {
        cases,
        max_shrink_iters: 50,
        failure_persistence: None,
        ..ProptestConfig::default()
    };
    let outcome = TestRunner::new(config).run(&problems, |problem| {
        let found = compare::<M>(&problem).map_err(TestCaseError::fail)?;
        let so_far = largest.get();
        largest.set(std::array::from_fn(|i| so_far[i].max(found[i])));
        Ok(())
    });
    if let Err(error) = outcome {
        panic!("{error}");
    }
    let [initial, step_sizes, angles, measured] = largest.get();
    println!(
        "{} against burn: initial parameters {initial:.1e}, step sizes {step_sizes:.1e}, angles \
         {angles:.1e}, measured values {measured:.1e}",
        M::KIND.name()
    );
}

#[test]
fn phong_agrees_with_burn() {
    compare_many::<Phong>(60, problems::<Phong>(phong(), PHONG_STEPS, 20, [8, 40]));
}

#[test]
fn cook_torrance_agrees_with_burn() {
    let problems = problems::<CookTorrance>(cook_torrance(), COOK_TORRANCE_STEPS, 20, [8, 40]);
    compare_many::<CookTorrance>(60, problems);
}

#[test]
fn neural_agrees_with_burn() {
    compare_many::<Neural>(60, problems::<Neural>(neural(), NEURAL_STEPS, 20, [8, 40]));
}
