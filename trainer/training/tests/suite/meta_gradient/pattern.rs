//! From the meta-gradient by samples to the one by the pattern's logits.

use std::f64::consts::{FRAC_PI_2, PI};

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{CookTorrance, Model, Neural, Phong, Sample, SampleGradient};
use glimpse_gradcheck::{Differences, Traced, parameters, scale_of};
use glimpse_kernels::LaneModel;
use glimpse_kernels::inner_loop::InnerLoop;
use glimpse_kernels::lanes::{Octet, OctetAt, WIDTH};
use glimpse_materials::sampling::sobol_valid;
use glimpse_materials::{Material, Procedural};
use glimpse_training::meta::pattern::{Pattern, angles_of, logits_of};
use glimpse_training::meta::pool::Pool;
use glimpse_training::meta::start::first_guess;
use glimpse_training::meta::variation::Variation;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::lanes::unpack;
use crate::problem::Found;
use crate::support::{double, named, network};

const STEPS: usize = 5;
const BARRIER: f64 = 0.005;

/// Angles of a sample's logits.
pub(crate) fn angles(logits: [f64; 3]) -> [f64; 3] {
    let ranges = [FRAC_PI_2, FRAC_PI_2, PI];
    std::array::from_fn(|i| ranges[i] / (1.0 + (-logits[i]).exp()))
}

fn at(logits: [f64; 3]) -> HalfDifference<f64> {
    HalfDifference::from_angles(named(angles(logits)))
}

pub(crate) fn is_valid(logits: [f64; 3]) -> bool {
    at(logits).cos_theta_i() > 0.0 && at(logits).cos_theta_o() > 0.0
}

/// What a variation of the first of two materials with the other is.
fn varied(materials: [&dyn Material; 2], variation: &Variation, logits: [f64; 3]) -> [f64; 3] {
    let [theta_h, theta_d, phi_d] = angles(logits).map(|angle| angle as f32);
    let at = Angles {
        theta_h,
        theta_d,
        phi_d,
    };
    let [material, partner] = materials.map(|material| material.brdf(at).map(f64::from));
    let share = f64::from(variation.share);
    std::array::from_fn(|i| {
        let filtered = f64::from(variation.gains[i]) * material[variation.order[i]];
        filtered + share * (partner[i] - filtered)
    })
}

/// Valid samples and one whose directions are below the horizon, as logits.
pub(crate) fn logits_with_one_below(valid: usize, random: &mut ChaCha8Rng) -> Vec<[f32; 3]> {
    let places = sobol_valid(valid, random.random()).into_iter();
    let mut logits: Vec<_> = places.map(logits_of).collect();
    let below = [
        random.random_range(1.5..2.5),
        random.random_range(1.5..2.5),
        -2.5,
    ];
    logits.insert(random.random_range(0..=valid), below);
    logits
}

/// The barrier of a sample below the horizon, by its angles.
pub(crate) fn barrier([theta_h, theta_d, _]: [f64; 3]) -> f64 {
    BARRIER * (theta_h * theta_h + theta_d * theta_d)
}

/// A task: its pattern, what to begin with, and what judges.
struct Task<'a> {
    materials: [&'a dyn Material; 2],
    variation: Variation,
    initial: &'a [f32],
    step_sizes: &'a [f32],
    outer: &'a [Sample<f64>],
}

impl Task<'_> {
    /// Outer loss and barrier in double precision.
    fn loss<M: Model>(&self, logits: &[[f64; 3]]) -> Traced {
        let trace = |list: &[f32]| -> Vec<Traced> {
            list.iter().map(|value| Traced((*value).into())).collect()
        };
        let traced = |sample: &Sample<f64>| {
            let at = &sample.at;
            let [hx, hz, dx, dy, dz] = [at.hx, at.hz, at.dx, at.dy, at.dz].map(Traced);
            Sample {
                at: HalfDifference { hx, hz, dx, dy, dz },
                measured: sample.measured.map(Traced),
                weight: Traced(sample.weight),
            }
        };
        let (valid, invalid): (Vec<[f64; 3]>, Vec<_>) =
            logits.iter().partition(|each| is_valid(**each));
        let weight = 1.0 / (3.0 * valid.len() as f64);
        let inner: Vec<Sample<Traced>> = valid
            .iter()
            .map(|each| {
                traced(&Sample {
                    at: at(*each),
                    measured: varied(self.materials, &self.variation, *each),
                    weight,
                })
            })
            .collect();
        let (initial, step_sizes) = (trace(self.initial), trace(self.step_sizes));
        let inner_loop = InnerLoop::<M, Traced>::new(&initial, &step_sizes, STEPS);
        let learned = inner_loop.fit(&inner[..]);
        let mut ignored = parameters([], Traced(0.0));
        let outer = self.outer.iter().map(traced).map(|sample| {
            M::accumulate_gradient::<Traced, false>(&learned, &sample, &mut ignored).loss()
        });
        let barriers = invalid
            .into_iter()
            .map(|each| Traced(barrier(angles(each))));
        outer
            .chain(barriers)
            .fold(Traced(0.0), |sum, each| sum + each)
    }
}

/// Compares the gradient of outer loss and barrier by all logits, for both kinds of material.
fn compare<M: LaneModel>() {
    // The gradient under test is found in single precision.
    let mut differences = Differences::new(1e-4, 1e-4);
    for seed in 0..40 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let materials: [Box<dyn Material>; 2] = [
            Box::new(Procedural::new(seed as usize, 1)),
            Box::new(network(&mut random)),
        ];
        let pool = Pool::new(&materials, 512, seed);
        let initial = first_guess(M::KIND, &mut random);
        let step_sizes: Vec<f32> = (0..M::PARAMETERS)
            .map(|_| random.random_range(-6.0..-3.0f32).exp())
            .collect();
        for (index, material) in materials.iter().enumerate() {
            let logits = logits_with_one_below(7, &mut random);
            let pattern = Pattern::from_logits(logits.as_flattened());
            let variation = Variation::random(2.0, materials.len(), &mut random);
            let partner = &*materials[variation.partner];
            let measured = pattern.measure_varied(&**material, partner, &variation);
            let outer = pool.draw_varied(index, &variation, 64, &mut random);
            let inner_loop = InnerLoop::<M, f32>::new(&initial, &step_sizes, STEPS);
            let [inner, outer] = [measured.octets(), outer.octets()];
            let found = Found::compute(&inner_loop, &[&inner], &outer, inner.zero_derivatives());
            let by_logits = measured.gradient_by_logits(&found.samples);
            let slopes = double(&by_logits);
            let scale = 100.0 * scale_of(&slopes);

            let task = Task {
                materials: [&**material, partner],
                variation,
                initial: &initial,
                step_sizes: &step_sizes,
                outer: &unpack(&outer),
            };
            let logits: Vec<[f64; 3]> = logits.iter().map(|each| each.map(f64::from)).collect();
            let expected = task.loss::<M>(&logits).0;
            let total = f64::from(found.loss + pattern.barrier());
            if (total - expected).abs() > 1e-6 {
                // Single precision came down on another side of a kink. (Were it anything else,
                // too much would be discarded.)
                differences.discard(slopes.len());
                continue;
            }
            for (index, slope) in slopes.iter().enumerate() {
                let what = format!("logit {index}");
                let outcome = differences.compare(&what, *slope, scale, |offset| {
                    let mut logits = logits.clone();
                    logits[index / 3][index % 3] += offset;
                    task.loss::<M>(&logits)
                });
                if let Err(error) = outcome {
                    panic!("seed {seed}, {}: {error}", material.name());
                }
            }
        }
    }
    // All but the azimuths of invalid samples.
    differences.conclude(
        &format!("{} by logits", M::KIND.name()),
        40 * 2 * 23 * 9 / 10,
    );
}

#[test]
fn phong_by_logits_agrees_with_differences() {
    compare::<Phong>();
}

#[test]
fn cook_torrance_by_logits_agrees_with_differences() {
    compare::<CookTorrance>();
}

#[test]
fn neural_by_logits_agrees_with_differences() {
    compare::<Neural>();
}

#[test]
fn an_invalid_sample_has_the_barrier_s_slope_and_nothing_else() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let logits = logits_with_one_below(7, &mut random);
    let pattern = Pattern::from_logits(logits.as_flattened());
    let measured = pattern.measure(&Procedural::new(0, 0));
    // Whatever is said of the samples.
    let by_logits = measured.gradient_by_logits(&[random_gradient(&mut random)]);
    let mut wide = logits.iter().map(|each| each.map(f64::from));
    let index = wide.clone().position(|logits| !is_valid(logits));
    let index = index.expect("a sample is invalid");
    let place = angles(wide.nth(index).expect("it is there"));
    // d(0.005 theta^2) / d(logit), theta = pi/2 sigmoid(logit)
    let slope = |theta: f64| 2.0 * BARRIER * theta * theta * (1.0 - theta / FRAC_PI_2);
    let expected = [slope(place[0]), slope(place[1]), 0.0];
    for (found, expected) in by_logits[3 * index..][..3].iter().zip(expected) {
        assert!((f64::from(*found) - expected).abs() <= 1e-6 * expected);
    }
    let barrier = barrier(place);
    assert!((f64::from(pattern.barrier()) - barrier).abs() < 1e-6 * barrier);
}

fn random_gradient(random: &mut ChaCha8Rng) -> SampleGradient<Octet> {
    let mut octet = || Octet(std::array::from_fn(|_| random.random_range(-1.0..1.0)));
    SampleGradient {
        at: OctetAt {
            hx: octet(),
            hz: octet(),
            dx: octet(),
            dy: octet(),
            dz: octet(),
        },
        measured: [octet(), octet(), octet()],
    }
}

/// Whatever the gradient by places is, the chain to the logits is right.
#[test]
fn the_chain_carries_places() {
    let mut largest = 0.0_f64;
    for seed in 0..50 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let network = network(&mut random);
        let logits: Vec<[f32; 3]> = sobol_valid(WIDTH, seed as u32)
            .into_iter()
            .map(logits_of)
            .collect();
        let pattern = Pattern::from_logits(logits.as_flattened());
        let by = random_gradient(&mut random);
        let found = pattern.measure(&network).gradient_by_logits(&[by]);

        for (lane, logits) in logits.iter().enumerate() {
            // Places, each times its slope.
            let product = |logits: [f64; 3]| {
                let at = at(logits);
                let place = [at.hx, at.hz, at.dx, at.dy, at.dz];
                let slopes = [by.at.hx, by.at.hz, by.at.dx, by.at.dy, by.at.dz];
                let places = place.iter().zip(slopes);
                places.map(|(x, by)| x * f64::from(by.0[lane])).sum::<f64>()
            };
            let logits = logits.map(f64::from);
            for i in 0..3 {
                let step = 1e-4;
                let at = |offset: f64| {
                    let mut logits = logits;
                    logits[i] += offset;
                    product(logits)
                };
                let [low, middle, high] = [-step, 0.0, step].map(at);
                let (left, right) = ((middle - low) / step, (high - middle) / step);
                // At a kink of the network the one-sided differences disagree.
                if (left - right).abs() > 1e-2 {
                    continue;
                }
                let error = (f64::from(found[3 * lane + i]) - 0.5 * (left + right)).abs();
                largest = largest.max(error);
                assert!(
                    error < 1e-4,
                    "seed {seed}, sample {lane}, logit {i}: {error}"
                );
            }
        }
    }
    println!("the chain to the logits: largest error {largest:.1e}");
}

#[test]
fn angles_and_logits_are_each_other_s_inverse() {
    for place in sobol_valid(1000, 1) {
        let logits = logits_of(place);
        let found = angles_of(logits);
        let expected = angles(logits.map(f64::from));
        let found = [found.theta_h, found.theta_d, found.phi_d];
        let place = [place.theta_h, place.theta_d, place.phi_d];
        let ranges = [FRAC_PI_2, FRAC_PI_2, PI];
        for i in 0..3 {
            assert!((f64::from(found[i]) - expected[i]).abs() < 1e-6);
            // Within a thousandth of the ends, angles are moved inside.
            let moved = f64::from(place[i]).clamp(1e-3 * ranges[i], (1.0 - 1e-3) * ranges[i]);
            assert!((f64::from(found[i]) - moved).abs() < 1e-6);
        }
    }
}
