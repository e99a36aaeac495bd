//! The whole estimator by the formulas of `docs/recipe.md`, directly in f64.

use std::f64::consts::{PI, TAU};

use glimpse_core::model::ModelKind::{self, CookTorrance, Linear, Phong};

use crate::recipes::{Contents, GaussNewton, Net, Start};

/// Readings of red, green and blue; None if missing.
pub(crate) type Readings = Vec<Option<[f32; 3]>>;

/// The synthetic reading of a sample.
pub(crate) fn color(sample: usize) -> [f32; 3] {
    let k = sample as f32;
    [0.2 + 0.1 * k, 0.3 / (1.0 + k), 0.02 + 0.05 * k]
}

/// hx, hz, dx, dy, dz.
pub(crate) type Place = [f64; 5];

pub(crate) fn cosines([hx, hz, dx, _, dz]: Place) -> [f64; 2] {
    [hz * dz - hx * dx, hz * dz + hx * dx]
}

fn places(angles: &[f32]) -> Vec<Place> {
    let triples = angles.as_chunks().0.iter();
    let places = triples.map(|triple: &[f32; 3]| {
        let [theta_h, theta_d, phi_d] = triple.map(f64::from);
        let (x, y) = (phi_d.cos(), phi_d.sin());
        [
            theta_h.sin(),
            theta_h.cos(),
            theta_d.sin() * x,
            theta_d.sin() * y,
            theta_d.cos(),
        ]
    });
    places.collect()
}

pub(crate) fn logistic(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}

/// Phong by the paper's formula.
pub(crate) fn phong(list: &[f64], [hx, hz, dx, dy, dz]: Place) -> [f64; 3] {
    let [incoming, outgoing] = cosines([hx, hz, dx, dy, dz]);
    // The cosine between the outgoing direction and the mirrored incoming one.
    let (along, up) = (dx * hz, dz * hx);
    let mirror = incoming * outgoing - (up + along) * (up - along) + dy * dy;
    let q = list[6].exp();
    let lobe = (q + 2.0) / TAU * (mirror.max(0.0) + 1e-5).powf(q);
    std::array::from_fn(|channel| {
        let (sum, ratio) = (logistic(list[channel]), logistic(list[3 + channel]));
        sum * ratio / PI + sum * (1.0 - ratio) * lobe
    })
}

/// Cook-Torrance by the paper's formula, with denominators offset by 1e-6.
pub(crate) fn cook_torrance(list: &[f64], [hx, hz, dx, dy, dz]: Place) -> [f64; 3] {
    let [theta_h, theta_d] = [hx.atan2(hz), dz.acos()];
    let [incoming, outgoing] = cosines([hx, hz, dx, dy, dz]);
    let [alpha, f_0] = [list[6], list[7]].map(logistic);
    let epsilon = 1e-6;
    let tangent = theta_h.sin().powi(2) / ((alpha * theta_h.cos()).powi(2) + epsilon);
    let d = (-tangent).exp() / (alpha.powi(2) * theta_h.cos().powi(4) + epsilon);
    let lower = incoming.min(outgoing);
    let g = (2.0 * theta_h.cos() * lower / (theta_d.cos() + epsilon)).min(1.0);
    let f = f_0 + (1.0 - f_0) * (1.0 - theta_d.cos()).powi(5);
    std::array::from_fn(|channel| {
        let (k_d, k_s) = (logistic(list[channel]), logistic(list[3 + channel]));
        k_d / PI + k_s * d * g * f / (PI * incoming * outgoing + epsilon)
    })
}

/// The network as three matrix products, without the clamp of negative results.
pub(crate) fn neural(list: &[f64], [hx, hz, dx, dy, dz]: Place) -> [f64; 3] {
    let mut values = vec![hx, 0.0, hz, dx, dy, dz];
    let mut rest = list;
    for outputs in [21, 21, 3] {
        let (weights, after) = rest.split_at(values.len() * outputs);
        let (bias, after) = after.split_at(outputs);
        rest = after;
        let row = |output: usize| {
            let products = values.iter().enumerate();
            let products = products.map(|(input, value)| value * weights[input * outputs + output]);
            bias[output] + products.sum::<f64>()
        };
        let is_last = rest.is_empty();
        let sums = (0..outputs).map(row);
        values = sums
            .map(|z| if is_last { z.exp() - 1.0 } else { z.max(0.0) })
            .collect();
    }
    [values[0], values[1], values[2]]
}

fn unclamped(model: ModelKind, list: &[f64], at: Place) -> [f64; 3] {
    match model {
        Phong => phong(list, at),
        CookTorrance => cook_torrance(list, at),
        _ => neural(list, at),
    }
}

/// Solves a linear system by Gaussian elimination.
pub(crate) fn solve(mut matrix: Vec<Vec<f64>>, mut right: Vec<f64>) -> Vec<f64> {
    let order = right.len();
    for pivot in 0..order {
        let (above, below) = matrix.split_at_mut(pivot + 1);
        let pivot_row = &above[pivot][pivot..];
        for (index, row) in below.iter_mut().enumerate() {
            let factor = row[pivot] / pivot_row[0];
            for (entry, other) in row[pivot..].iter_mut().zip(pivot_row) {
                *entry -= factor * other;
            }
            right[pivot + 1 + index] -= factor * right[pivot];
        }
    }
    for row in (0..order).rev() {
        for column in row + 1..order {
            right[row] -= matrix[row][column] * right[column];
        }
        right[row] /= matrix[row][row];
    }
    right
}

/// A least-squares problem with a Gaussian prior.
pub(crate) struct Normal {
    pub(crate) matrix: Vec<Vec<f64>>,
    pub(crate) right: Vec<f64>,
}

impl Normal {
    pub(crate) fn new(precision: &[impl Copy + Into<f64>]) -> Self {
        let right = vec![0.0; precision.len()];
        let mut matrix = vec![right.clone(); precision.len()];
        for (index, precision) in precision.iter().enumerate() {
            matrix[index][index] = (*precision).into();
        }
        Self { matrix, right }
    }

    pub(crate) fn add(&mut self, row: &[f64], weight: f64, residual: f64) {
        for ((line, entry), left) in self.matrix.iter_mut().zip(&mut self.right).zip(row) {
            *entry += weight * left * residual;
            for (sum, other) in line.iter_mut().zip(row) {
                *sum += weight * left * other;
            }
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn weighted(weights: &[i8], scale: f32, values: &[f64]) -> f64 {
    let terms = weights
        .iter()
        .zip(values)
        .map(|(weight, value)| f64::from(*weight) * value);
    terms.sum::<f64>() * f64::from(scale)
}

/// An activation, rounded to an integer of 16 bits.
fn rounded(activation: f64) -> f64 {
    (activation * 32_767.0).round() / 32_767.0
}

/// The coefficients of the net, from u of each sample.
fn net_coefficients(net: &Net, mapped: &[Option<[f64; 3]>]) -> [Vec<f64>; 3] {
    let (m, rows) = (usize::from(net.components), net.bias.len());
    let present = mapped.iter().flatten().count() as f64;
    let gain = (mapped.len() as f64 / present).sqrt();
    let factor = f64::from(net.scale) * gain;
    let weight = |sample: usize, column: usize, row: usize| {
        f64::from(net.readings[(sample * 3 + column) * rows + row])
            * f64::from(net.reading_scales[row])
    };
    [0, 1, 2].map(|channel| {
        let row = |row: usize| {
            let terms = mapped.iter().enumerate().map(|(sample, u)| match u {
                Some(u) => {
                    let mean = (u[0] + u[1] + u[2]) / 3.0;
                    factor * (weight(sample, 0, row) * u[channel] + weight(sample, 1, row) * mean)
                }
                None => weight(sample, 2, row),
            });
            f64::from(net.bias[row]) + terms.sum::<f64>()
        };
        let hidden: Vec<f64> = (m..rows).map(|index| rounded(row(index).tanh())).collect();
        let output = |k: usize| {
            let weights = &net.output[k * hidden.len()..];
            weighted(weights, net.output_scales[k], &hidden)
        };
        (0..m).map(|k| row(k) + output(k)).collect()
    })
}

/// theta_0 of each parameter.
fn start_parameters(start: &Start, initial: &[f32], coefficients: &[Vec<f64>; 3]) -> Vec<f64> {
    let a = coefficients.concat();
    let factor = (1.2 / (dot(&a, &a) / a.len() as f64).sqrt()).min(1.0);
    let units = start.bias.iter().zip(&start.hidden_scales).enumerate();
    let units = units.map(|(unit, (bias, scale))| {
        let sum = weighted(&start.hidden[unit * a.len()..], *scale, &a);
        rounded((factor * sum + f64::from(*bias)).tanh())
    });
    let units: Vec<f64> = units.collect();
    let parameters = initial.iter().zip(&start.output_scales).enumerate();
    let parameters = parameters.map(|(index, (phi, scale))| {
        f64::from(*phi) + weighted(&start.output[index * units.len()..], *scale, &units)
    });
    parameters.collect()
}

/// The BRDF of a mapped value; 0 if it is negative.
fn unmapped(mapped: f64, at: Place) -> f64 {
    let [incoming, outgoing] = cosines(at);
    (0.001 * (mapped.exp() - 1.0) / (incoming * outgoing)).max(0.0)
}

/// Replaces the parameters of the channels by their mean.
fn average(model: ModelKind, parameters: &mut [f64]) {
    let colors = match model {
        Phong | CookTorrance => 0..6,
        _ => 609..675,
    };
    for triple in parameters[colors].as_chunks_mut::<3>().0 {
        *triple = [triple.iter().sum::<f64>() / 3.0; 3];
    }
}

/// The derivatives of each channel of a function with respect to some parameters, as central differences.
fn derivatives(
    list: &[f64],
    active: &[usize],
    function: impl Fn(&[f64]) -> [f64; 3],
) -> Vec<[f64; 3]> {
    const STEP: f64 = 1e-5;
    let mut moved = list.to_vec();
    let derivatives = active.iter().map(|index| {
        moved[*index] = list[*index] + STEP;
        let above = function(&moved);
        moved[*index] = list[*index] - STEP;
        let below = function(&moved);
        moved[*index] = list[*index];
        [0, 1, 2].map(|channel| (above[channel] - below[channel]) / (2.0 * STEP))
    });
    derivatives.collect()
}

/// A reading with its weight.
struct Weighted {
    at: Place,
    measured: [f64; 3],
    weight: f64,
}

/// The change of the parameters by a Gauss-Newton step.
fn gauss_newton_step(
    (model, steps): (ModelKind, &GaussNewton),
    readings: &[Weighted],
    initial: &[f64],
    parameters: &[f64],
) -> Vec<f64> {
    let systems: Vec<(Vec<usize>, Vec<usize>)> = match model {
        Phong | CookTorrance => vec![((0..parameters.len()).collect(), vec![0, 1, 2])],
        _ => (0..3)
            .map(|c| ((0..22).map(|k| 609 + 3 * k + c).collect(), vec![c]))
            .collect(),
    };
    let mut change = vec![0.0; parameters.len()];
    for (active, channels) in systems {
        let mut normal = Normal::new(&steps.precision);
        for ((right, p), index) in normal.right.iter_mut().zip(&steps.precision).zip(&active) {
            *right = f64::from(*p) * (initial[*index] - parameters[*index]);
        }
        for reading in readings {
            let [c, _] = cosines(reading.at);
            let f = unclamped(model, parameters, reading.at);
            let rows = derivatives(parameters, &active, |p| unclamped(model, p, reading.at));
            for channel in &channels {
                let shifted = 1.0 + f[*channel] * c;
                let residual = ((1.0 + reading.measured[*channel] * c) / shifted).ln();
                let d = f64::from(steps.error_scale);
                let weight = reading.weight * d / (d + residual.abs());
                let row: Vec<f64> = rows.iter().map(|by| by[*channel] * c / shifted).collect();
                normal.add(&row, weight, residual);
            }
        }
        for (index, delta) in active.iter().zip(solve(normal.matrix, normal.right)) {
            change[*index] = delta;
        }
    }
    change
}

/// The result of a fit.
#[derive(Clone, Debug)]
pub(crate) struct Estimate {
    pub(crate) values: Vec<f64>,
    /// The error at each reading.
    pub(crate) errors: Vec<Option<f64>>,
    /// The mean of |t|, 0 without a ridge stage.
    pub(crate) innovation: f64,
    pub(crate) predicted_loss: Option<f64>,
}

impl Estimate {
    pub(crate) fn mean_error(&self) -> f64 {
        let errors = self.errors.iter().flatten();
        errors.clone().sum::<f64>() / errors.count() as f64
    }
}

/// The coefficients of the stages net and ridge, and the innovation.
fn coefficients(
    contents: &Contents,
    samples: &[(Place, Option<[f64; 3]>)],
) -> ([Vec<f64>; 3], f64) {
    let ridge = contents.ridge.as_ref().unwrap();
    let components = ridge.precision.len();
    let mapped = samples
        .iter()
        .zip(&ridge.center)
        .map(|((at, measured), center)| {
            let [incoming, outgoing] = cosines(*at);
            let w = incoming * outgoing;
            measured.map(|y| y.map(|y| ((y * w + 0.001) / 0.001).ln() - f64::from(*center)))
        });
    let mapped: Vec<_> = mapped.collect();
    let mut a = match &contents.net {
        Some(net) => net_coefficients(net, &mapped),
        None => [const { Vec::new() }; 3],
    };
    a.iter_mut().for_each(|a| a.resize(components, 0.0));
    let mut rows = Vec::new();
    let mut targets = Vec::new();
    let mut weights = Vec::new();
    for (sample, u) in mapped.iter().enumerate() {
        if let Some(u) = u {
            let row = ridge.rows.row(sample, components);
            targets.push([0, 1, 2].map(|channel| u[channel] - dot(&row, &a[channel])));
            rows.push(row);
            let scale = contents
                .noise
                .as_ref()
                .map_or(1.0, |noise| noise.scales[sample]);
            weights.push(f64::from(scale * scale));
        }
    }
    let sum: f64 = targets.iter().flatten().map(|t| t.abs()).sum();
    let innovation = sum / (3 * targets.len()) as f64;
    let solve_list = |precision: &[f32], target: &dyn Fn(&[f64; 3]) -> f64| {
        let mut normal = Normal::new(precision);
        for ((row, t), weight) in rows.iter().zip(&targets).zip(&weights) {
            normal.add(row, *weight, target(t));
        }
        solve(normal.matrix, normal.right)
    };
    let has_means = !ridge.difference_precision.is_empty();
    let mean = |t: &[f64; 3]| {
        if has_means {
            t.iter().sum::<f64>() / 3.0
        } else {
            0.0
        }
    };
    let of_mean = solve_list(&ridge.precision, &mean);
    let precision = if has_means {
        &ridge.difference_precision
    } else {
        &ridge.precision
    };
    for (channel, a) in a.iter_mut().enumerate() {
        let z = solve_list(precision, &|t| t[channel] - mean(t));
        for ((a, z), of_mean) in a.iter_mut().zip(z).zip(&of_mean) {
            *a += z + of_mean;
        }
    }
    (a, innovation)
}

/// The steps of SGD from the initial parameters, each with the gradient of all readings.
fn sgd_parameters(contents: &Contents, readings: &[Weighted], is_gray: bool) -> Vec<f64> {
    let (model, sgd) = (contents.model(), contents.sgd.as_ref().unwrap());
    let all: Vec<usize> = (0..sgd.initial.len()).collect();
    let brdf = |p: &[f64], at: Place| unclamped(model, p, at).map(|f| f.max(0.0));
    let mut parameters: Vec<f64> = sgd.initial.iter().copied().map(f64::from).collect();
    if is_gray {
        average(model, &mut parameters);
    }
    for _ in 0..sgd.steps {
        let mut gradient = vec![0.0; all.len()];
        for reading in readings {
            let [c, _] = cosines(reading.at);
            let f = brdf(&parameters, reading.at);
            let slopes = [0, 1, 2].map(|channel| {
                let sign = (f[channel] - reading.measured[channel]).signum();
                reading.weight * sign * c / (1.0 + f[channel] * c)
            });
            let rows = derivatives(&parameters, &all, |p| brdf(p, reading.at));
            for (sum, row) in gradient.iter_mut().zip(rows) {
                *sum += dot(&slopes, &row);
            }
        }
        for ((parameter, step_size), by) in parameters.iter_mut().zip(&sgd.step_sizes).zip(gradient)
        {
            *parameter -= f64::from(*step_size) * by;
        }
        if is_gray {
            average(model, &mut parameters);
        }
    }
    parameters
}

/// Fits readings, none of which is below the smallest valid one.
pub(crate) fn estimate(contents: &Contents, readings: &Readings) -> Estimate {
    let model = contents.model();
    let is_gray = readings.iter().flatten().all(|[r, g, b]| r == g && g == b);
    let present = readings.iter().flatten().count() as f64;
    let measured = readings
        .iter()
        .map(|reading| reading.map(|y| y.map(f64::from)));
    let samples: Vec<_> = places(&contents.pattern.directions)
        .into_iter()
        .zip(measured)
        .collect();
    let with_weight = |weight: f64| {
        let present = samples.iter();
        present.filter_map(move |(at, y)| {
            Some(Weighted {
                at: *at,
                measured: (*y)?,
                weight,
            })
        })
    };
    let (mut lists, mut innovation) = ([const { Vec::new() }; 3], 0.0);
    let values = if contents.sgd.is_some() {
        sgd_parameters(
            contents,
            &with_weight(1.0 / (3.0 * present)).collect::<Vec<_>>(),
            is_gray,
        )
    } else {
        (lists, innovation) = coefficients(contents, &samples);
        match (&contents.start, &contents.gauss_newton) {
            (Some(start), Some(steps)) => {
                let directions = places(&steps.directions);
                let weight = 1.0 / directions.len() as f64;
                let components = lists[0].len();
                let virtual_readings = directions.iter().enumerate().map(|(index, at)| {
                    let row = steps.rows.row(index, components);
                    let center = f64::from(steps.center[index]);
                    let brdf = |a: &Vec<f64>| unmapped(center + dot(&row, a), *at);
                    Weighted {
                        at: *at,
                        measured: lists.each_ref().map(brdf),
                        weight,
                    }
                });
                let own = with_weight(f64::from(steps.reading_weight) / present);
                let readings: Vec<_> = virtual_readings.chain(own).collect();
                let mut initial = start_parameters(start, &steps.initial, &lists);
                if is_gray {
                    average(model, &mut initial);
                }
                let mut parameters = initial.clone();
                for _ in 0..steps.steps {
                    let change =
                        gauss_newton_step((model, steps), &readings, &initial, &parameters);
                    parameters
                        .iter_mut()
                        .zip(change)
                        .for_each(|(p, delta)| *p += delta);
                    if is_gray {
                        average(model, &mut parameters);
                    }
                }
                parameters
            }
            _ => lists.concat(),
        }
    };
    let errors = samples.iter().enumerate().map(|(index, (at, measured))| {
        let f = match model {
            Linear => {
                let ridge = contents.ridge.as_ref().unwrap();
                let row = ridge.rows.row(index, lists[0].len());
                let center = f64::from(ridge.center[index]);
                lists
                    .each_ref()
                    .map(|a| unmapped(center + dot(&row, a), *at))
            }
            _ => unclamped(model, &values, *at).map(|f| f.max(0.0)),
        };
        let [c, _] = cosines(*at);
        measured.map(|y| {
            let errors = [0, 1, 2].map(|i| ((1.0 + f[i] * c) / (1.0 + y[i] * c)).ln().abs());
            errors.iter().sum::<f64>() / 3.0
        })
    });
    let mut estimate = Estimate {
        errors: errors.collect(),
        values,
        innovation,
        predicted_loss: None,
    };
    estimate.predicted_loss = contents.prediction.as_ref().map(|prediction| {
        let means = (0..lists[0].len()).map(|k| (lists[0][k] + lists[1][k] + lists[2][k]) / 3.0);
        let [bias, weights @ ..] = &prediction.weights[..] else {
            panic!("no weights")
        };
        let terms = weights.iter().zip(means).map(|(q, a)| f64::from(*q) * a);
        let mut sum = f64::from(*bias) + terms.sum::<f64>();
        sum += f64::from(prediction.innovation) * (innovation + 1e-3).ln();
        sum += f64::from(prediction.residual) * (estimate.mean_error() + 1e-4).ln();
        let factor = prediction.partial_loss.get(present as usize - 1);
        (sum + factor.map_or(0.0, |factor| f64::from(*factor))).exp()
    });
    estimate
}
